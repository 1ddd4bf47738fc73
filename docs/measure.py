#!/usr/bin/env python3
"""Measures what README.md and the book quote of size, time and memory, with the standard library only.

measure.py PROGRAM           prints a table: what the docs say, and what is measured here
measure.py PROGRAM --check   exits with code 1 if a size or a memory is not what the docs say

Times are those of this machine, and decide nothing. PROGRAM is epirig, built in release mode. Linux only: peaks of memory are the
kernel's.
"""

import argparse
import json
import os
import pathlib
import re
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parent.parent
SLACK = 0.1
"""A quoted size has two digits at most, and images are compressed a little better or worse by their noise."""
MATCHES = ((1024, 51), (1024, 26), (512, 101))
"""Side in px and number of the frames that are matched for the memory."""


def quoted(page, pattern):
    """The numbers that a page of the docs says in the sentence of `pattern`, whose line breaks may be anywhere."""
    text = " ".join((ROOT / page).read_text().split())
    found = re.search(pattern, text)
    if not found:
        sys.exit(f'{page} does not say "{pattern}" any more: change it here, too')
    return [float(number) for number in found.groups()]


def run(program, *arguments):
    """Seconds of the command, and the peak of its memory in bytes."""
    # A process of its own, whose only child is the command: peaks of children are those of the largest one so far.
    ask = (
        "import resource, subprocess, sys, time\n"
        "begun = time.perf_counter()\n"
        "subprocess.run(sys.argv[1:], check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)\n"
        "print(time.perf_counter() - begun, resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss * 1024)\n"
    )
    command = [sys.executable, "-c", ask, program, *map(str, arguments)]
    seconds, peak = subprocess.run(command, check=True, capture_output=True, text=True).stdout.split()
    return float(seconds), float(peak)


def size(folder):
    """Bytes of all files in a folder."""
    return sum(path.stat().st_size for path in folder.rglob("*") if path.is_file())


def main():
    """Measures, prints the table, and compares."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program", type=lambda path: pathlib.Path(path).resolve())
    parser.add_argument("--check", action="store_true", help="exit with code 1 if a size or a memory is not what the docs say")
    arguments = parser.parse_args()
    rows, wrong = [], []

    def row(what, says, found, fits=True):
        rows.append(f"| {what} | {says} | {found} |")
        if not fits:
            wrong.append(f"{what}: the docs say {says}, measured {found}")

    seconds_said, megabytes_said = quoted("README.md", r"the measurement about (\d+) seconds\. The results take (\d+) MB")
    per_pixel, per_pixel_quick = quoted("docs/src/accuracy.md", r"(\d+) bytes for each pixel of the map \((\d+) with `--quick`\)")
    program_mb, thread_mb = quoted("docs/src/accuracy.md", r"(\d+) MB for the program and (\d+) MB for each thread")
    threads = len(os.sched_getaffinity(0))

    with tempfile.TemporaryDirectory() as scratch:
        scratch = pathlib.Path(scratch)
        demo = scratch / "demo"
        seconds, peak = run(arguments.program, "demo", "--out", demo)
        megabytes = size(demo) / 1e6
        row("`epirig demo`: time", f"{seconds_said:.0f} s", f"{seconds:.0f} s")
        row("`epirig demo`: size", f"{megabytes_said:.0f} MB", f"{megabytes:.1f} MB", abs(megabytes / megabytes_said - 1) < SLACK)
        row("`epirig demo`: peak memory", "-", f"{peak / 1e6:.0f} MB")
        for side, frames in MATCHES:
            sequence = scratch / f"{side}-{frames}"
            run(arguments.program, "demo", "--size", side, "--frames", frames, "--out", sequence)
            for options, bytes_each in (((), per_pixel), (("--quick",), per_pixel_quick)):
                results = scratch / "results"
                _, peak = run(arguments.program, "match", sequence, "--overwrite", "--out", results, *options)
                match = json.loads((results / "match.json").read_text())
                rows_at_once = 16 * side * frames
                limit = side**2 * (frames + bytes_each) + program_mb * 1e6 + threads * (thread_mb * 1e6 + rows_at_once)
                what = " ".join(["`epirig match`", *options]) + f", {frames} frames of {side} x {side} px"
                row(f"{what}: peak memory", f"at most {limit / 1e6:.0f} MB", f"{peak / 1e6:.0f} MB", peak < limit)
                row(f"{what}: time of the matching", "-", f"{match['seconds']:.2f} s")

    print("| figure | docs | here |\n| --- | --- | --- |", *rows, sep="\n")
    if arguments.check and wrong:
        sys.exit("\n".join(wrong))


if __name__ == "__main__":
    main()
