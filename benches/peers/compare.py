"""Measures epirig's whole match beside its peers: time and error on one scene, in one run, on the same cores. See README.md."""

import argparse
import contextlib
import functools
import importlib.metadata
import itertools
import json
import os
import platform
import subprocess
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import cv2
import numba
import numpy as np
from PIL import Image

import alternatives
import four_scenes
import peers
import reference
import scene as scenes
import tracks

REPOSITORY = Path(__file__).resolve().parents[2]
PACKAGES = ("numpy", "numba", "opencv-python", "pyvale")


@dataclass
class Run:
    """What one method made of the scene."""

    name: str
    frames: str
    seconds: float
    disparity: np.ndarray
    sigma: np.ndarray | None = None
    remark: str = ""
    place: np.ndarray | None = None
    """Where along x the disparity holds, in px, if not at the centres of the pixels."""


REPEATED_S = 10
"""Short runs vary most, so they are repeated for so long."""


def repeated(repeats):
    """Counts `repeats` runs, and more until `REPEATED_S` have passed; a run of more than 20 s is not repeated, nor is a single one."""
    first = time.perf_counter()
    for count in itertools.count():
        begun = time.perf_counter()
        enough = count >= repeats and (repeats == 1 or begun - first > REPEATED_S)
        if enough or (count == 1 and begun - first > 20):
            return
        yield count


def best_of(repeats, work):
    """Least seconds of the runs, and the last result."""
    least = np.inf
    for _ in repeated(repeats):
        begun = time.perf_counter()
        result = work()
        least = min(least, time.perf_counter() - begun)
    return least, result


def run_program(arguments):
    """Runs a command; its wall time in s."""
    begun = time.perf_counter()
    subprocess.run(arguments, stdout=subprocess.DEVNULL, check=True)
    return time.perf_counter() - begun


def epirig(program, folder, scene, range_px, repeats, options):
    """epirig by its command line. Seconds are those of the matching, as match.json has them; the remark tells those of the command."""
    sequence = folder / "sequence"
    if not sequence.exists():
        images = folder / "images"
        images.mkdir(exist_ok=True)
        for t, frame in enumerate(scene.frames):
            Image.fromarray(frame).save(images / f"{t:04}.png", compress_level=1)
        run_program([program, "import", images, "--out", sequence, "--quiet"])
    results = folder / "results"
    # The scenes know the truth of the first frame.
    command = [program, "match", sequence, "--reference", "first", "--out", results, "--overwrite", "--quiet", *options]
    if range_px is not None:
        command.append(f"--range={range_px[0]}..{range_px[1]}")
    runs = []
    for _ in repeated(repeats):
        wall = run_program(command)
        runs.append((json.loads((results / "match.json").read_text())["seconds"], wall))
    seconds, wall = min(runs)
    name = " ".join(["epirig", *options]) + (", range unknown" if range_px is None else "")
    return Run(
        name,
        "all",
        seconds,
        np.asarray(Image.open(results / "disparity.tiff"), float),
        np.asarray(Image.open(results / "sigma.tiff"), float),
        f"{name}: the whole command (reading PNG, matching, writing maps and pictures) takes {wall:.1f} s",
    )


def measured(arguments, scene, folder):
    """Every method asked for, one after the other."""
    frames, range_px = scene.frames, scene.size.range_px
    first, last = frames[0], frames[-1]

    def peer(name, used, work):
        seconds, disparity = best_of(arguments.repeats, work)
        return Run(name, used, seconds, disparity.astype(float))

    def numba_reference():
        reference.compile_all()
        return peer("Numba: cost volume, then Gauss-Newton", "all", lambda: reference.match(frames, range_px))

    def pyvale():
        threads = arguments.threads
        for side in (11, 21):
            yield peer(
                f"pyvale DIC, {side} x {side}",
                "first and last",
                lambda side=side: peers.pyvale_dic(first, last, range_px, threads, side),
            )

    methods = {
        "epirig": lambda: [
            epirig(arguments.program, folder, scene, known, arguments.repeats, options)
            for options in ((), ("--quick",))
            for known in (range_px, None)
        ],
        "numba": lambda: [numba_reference()],
        "sgbm": lambda: [
            peer("OpenCV StereoSGBM", "first and last", lambda: peers.sgbm(first, last, range_px))
        ],
        "dis": lambda: [peer("OpenCV DIS flow", "first and last", lambda: peers.dis_flow(first, last))],
        "pyvale": pyvale,
    }
    for name, method in methods.items():
        if name not in arguments.without:
            for run in method():
                print(f"{run.name}: {run.seconds:.2f} s", flush=True)
                yield run


def table(runs, scene):
    """The runs as a Markdown table. Errors are over all answered pixels that both end frames see."""
    lines = [
        "| method | frames used | time, s | times epirig | times epirig --quick | mean error, px | away from steps, px | RMS, px | 99 % below, px "
        "| within 0.1 px | over 1 px | answered |",
        "| --- | --- " + "| ---: " * 10 + "|",
    ]
    quick = next(run for run in runs if run.name == "epirig --quick")
    for run in runs:
        error = np.abs(run.disparity - scene.disparity)
        answered = scene.visible & np.isfinite(error)
        share = answered.sum() / scene.visible.sum()
        away = error[answered & ~scene.near_step].mean()
        error = error[answered]
        lines.append(
            f"| {run.name} | {run.frames} | {run.seconds:.2f} | {run.seconds / runs[0].seconds:.2g} | {run.seconds / quick.seconds:.2g} "
            f"| {error.mean():.4f} "
            f"| {away:.4f} | {np.sqrt(np.mean(error**2)):.3f} | {np.quantile(error, 0.99):.3f} "
            f"| {np.mean(error < 0.1):.2%} | {np.mean(error > 1):.2%} | {share:.1%} |"
        )
    return "\n".join(lines)


def sigma_coverage(run, scene):
    """How many errors lie within one and two of the sigmas that were stated."""
    ratio = (np.abs(run.disparity - scene.disparity) / run.sigma)[scene.visible]
    ratio = ratio[np.isfinite(ratio)]
    return f"{run.name}: {np.mean(ratio < 1):.1%} of the errors lie within one sigma, {np.mean(ratio < 2):.1%} within two"


WRONG_PX = 0.25
"""An answer that is off by more is wrong, not inaccurate."""

ALTERNATIVES = {
    "dynamic programming [3]": ("first and last", alternatives.dynamic_programming),
    "confidently stable matching [9]": ("first and last", alternatives.stable_matching),
    "verification [8]": (f"{alternatives.IMAGES} at random", alternatives.verification),
    "Lucas-Kanade, frame to frame [10]": ("all", functools.partial(tracks.lucas_kanade, to_first=False)),
    "Lucas-Kanade, each to the first [10]": ("all", functools.partial(tracks.lucas_kanade, to_first=True)),
    "lines of features [1]": ("all", tracks.bolles),
}


def measured_alternatives(arguments, scene, folder):
    """epirig and the paper's alternatives on one of the four scenes."""
    folder.mkdir()
    for options in ((), ("--quick",)):
        yield epirig(arguments.program, folder, scene, scene.range_px, arguments.repeats, options)
    for name, (used, method) in ALTERNATIVES.items():
        # On a corner of the scene first, so that no timing contains compilation.
        method(scene.frames[:, :24, :128], scene.range_px)
        seconds, answer = best_of(arguments.repeats, lambda method=method: method(scene.frames, scene.range_px))
        disparity, place = answer if isinstance(answer, tuple) else (answer, None)
        yield Run(name, used, seconds, disparity, place=place)


def errors(run, scene):
    """Signed error of every pixel, at the place the method states."""
    columns = np.arange(scene.disparity.shape[1])
    beside = 0 if run.place is None else scene.slant * (run.place - columns)
    return run.disparity - scene.disparity - beside


def alternatives_table(runs, scene):
    """The runs on one of the four scenes, as a Markdown table. Errors are over all answered pixels that both end frames see."""
    lines = [
        "| method | frames used | time, s | answered | mean error, px | wrong | mean error of the others, px |",
        "| --- | --- " + "| ---: " * 5 + "|",
    ]
    for run in runs:
        error = np.abs(errors(run, scene))
        answered = scene.visible & np.isfinite(error)
        error = error[answered]
        right = error[error <= WRONG_PX]
        lines.append(
            f"| {run.name} | {run.frames} | {run.seconds:.2f} | {answered.sum() / scene.visible.sum():.1%} | {error.mean():.4f} "
            f"| {1 - right.size / error.size:.2%} | {right.mean():.4f} |"
        )
    return "\n".join(lines)


def hollows_table(runs, scene):
    """What is left of the tile's relief: its mean depth, and how far errors of pixels lie apart. Without wrong answers."""
    lines = ["| method | depth of the hollows, px | standard deviation of the errors, px |", "| --- " + "| ---: " * 2 + "|"]
    share = np.broadcast_to(four_scenes.hollow_share(np.arange(scene.disparity.shape[1], dtype=float)), scene.disparity.shape)
    for run in runs:
        error = errors(run, scene)
        right = scene.visible & (np.abs(error) <= WRONG_PX)
        depth = four_scenes.HOLLOW_PX + error[right & (share == 0)].mean() - error[right & (share == 1)].mean()
        lines.append(f"| {run.name} | {depth:.4f} | {error[right].std():.4f} |")
    return "\n".join(lines)


def bars_table(runs, scene):
    """How much of each bar is found: share of all of its pixels that have a right answer."""
    bars = four_scenes.BARS
    lines = ["| method " + "".join(f"| {width} px " for _, width in bars) + "|", "| --- " + "| ---: " * len(bars) + "|"]
    for run in runs:
        right = np.abs(errors(run, scene)) <= WRONG_PX
        shares = [right[slice(*four_scenes.BAR_ROWS), left : left + width].mean() for left, width in bars]
        lines.append(f"| {run.name} " + "".join(f"| {share:.0%} " for share in shares) + "|")
    return "\n".join(lines)


def compare_alternatives(arguments, folder):
    """A heading and a table for each of the four scenes."""
    more = {
        "tile": ("The relief, without wrong answers:", hollows_table),
        "bars": ("Share of the pixels of each bar that have a right answer:", bars_table),
    }
    parts = []
    for name in four_scenes.SCENES:
        scene = four_scenes.render(name)
        runs = []
        for run in measured_alternatives(arguments, scene, folder / name):
            print(f"{name}, {run.name}: {run.seconds:.2f} s", flush=True)
            runs.append(run)
        parts += [f"### {scene.title}", "", alternatives_table(runs, scene), ""]
        if name in more:
            intro, made = more[name]
            parts += [intro, "", made(runs, scene), ""]
    return parts


def windows_bound(scene):
    """What a match by windows of 5 x 5 px could reach at best: the median of its absolute errors, in px.

    By the bound of Cramer and Rao, a disparity over the whole baseline has the variance 12 s^2 / (N G): s is the noise with that of the
    rounding, N the number of frames, and G the sum of the squared slopes along x in the window. Half of the errors of a normal
    distribution are within 0.6745 standard deviations.
    """
    variance = four_scenes.NOISE_DN**2 + 1 / 12
    slopes = cv2.Sobel(np.median(scene.frames[:2], axis=0), cv2.CV_64F, 1, 0, ksize=1) / 2
    sums = cv2.boxFilter(slopes**2, cv2.CV_64F, (5, 5), normalize=False)
    return 0.6745 * np.median(np.sqrt(12 * variance / (len(scene.frames) * sums[scene.visible])))


def check(arguments, folder):
    """epirig alone, on the small scene and on the four: whether half of its errors are below what windows of 5 x 5 px could reach."""
    small = scenes.render(scenes.SMALL)
    lines, failed = ["| scene | median error, px | its bound, px | answered |", "| --- | ---: | ---: | ---: |"], False
    for name, scene, range_px in [
        ("peers", small, small.size.range_px),
        *((name, scene, scene.range_px) for name in four_scenes.SCENES for scene in [four_scenes.render(name)]),
    ]:
        (folder / name).mkdir()
        run = epirig(arguments.program, folder / name, scene, range_px, 1, ())
        error = np.abs(run.disparity - scene.disparity)[scene.visible]
        answered = np.isfinite(error).mean()
        median, bound = np.nanmedian(error), windows_bound(scene)
        failed |= not (median < bound and answered > 0.9)
        lines.append(f"| {name} | {median:.4f} | {bound:.4f} | {answered:.1%} |")
    return lines, failed


def processor():
    """The processor's name, as far as the system tells."""
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
        return next(line.split(":")[1].strip() for line in lines if line.startswith("model name"))
    except (OSError, StopIteration):
        return platform.processor() or platform.machine()


def revision():
    """The revision of the repository that the program is presumed to be built from."""
    command = ["git", "-C", REPOSITORY, "describe", "--always", "--dirty"]
    answer = subprocess.run(command, capture_output=True, text=True, check=False)
    return answer.stdout.strip() or "unknown"


def version(package):
    """The version of an installed package."""
    try:
        return importlib.metadata.version(package)
    except importlib.metadata.PackageNotFoundError:
        return "not installed"


def conditions(arguments, extent, packages):
    """What was measured with what, in one sentence."""
    cores = "1 core" if arguments.threads == 1 else f"{arguments.threads} cores"
    return (
        f"{extent}; {cores} of {processor()}; epirig at {revision()}; Python {platform.python_version()}, "
        + ", ".join(f"{package} {version(package)}" for package in packages)
        + "."
    )


def compare_peers(arguments, folder):
    """The table of the peers, and what epirig says of itself."""
    size = scenes.SMALL if arguments.small else scenes.FULL
    scene = scenes.render(size)
    runs = list(measured(arguments, scene, folder))
    ours = [run for run in runs if run.sigma is not None]
    extent = f"{size.side_px} x {size.side_px} pixels, {size.frames} frames, {size.range_px[1] - size.range_px[0]:.0f} px of range"
    return [
        conditions(arguments, extent, PACKAGES),
        "",
        table(runs, scene),
        "",
        *[f"- {run.remark}." for run in ours],
        *[f"- {sigma_coverage(run, scene)}." for run in ours],
        "",
    ]


def main():
    """Parses the command line, runs everything, prints and writes the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--program", type=Path, default=REPOSITORY / "target/release/epirig", help="epirig, built in release mode")
    parser.add_argument("--small", action="store_true", help="256 x 256 x 40 instead of 1024 x 1024 x 100")
    parser.add_argument("--alternatives", action="store_true", help="the paper's alternatives on four scenes, instead of the peers")
    parser.add_argument("--check", action="store_true", help="epirig alone, in a minute; exit code 1 if its errors are not what they should be")
    parser.add_argument("--threads", type=int, default=len(os.sched_getaffinity(0)), help="cores for every method [default: all]")
    parser.add_argument("--repeats", type=int, default=3, help="the best of so many runs counts, and of more if they are short [default: 3]")
    parser.add_argument("--without", nargs="*", default=[], choices=["numba", "sgbm", "dis", "pyvale"], help="methods to leave out")
    parser.add_argument("--out", type=Path, help="also write the table to this file")
    arguments = parser.parse_args()

    os.sched_setaffinity(0, sorted(os.sched_getaffinity(0))[: arguments.threads])
    os.environ["RAYON_NUM_THREADS"] = str(arguments.threads)
    cv2.setNumThreads(arguments.threads)
    numba.set_num_threads(arguments.threads)

    arguments.program = arguments.program.resolve()
    out = arguments.out and arguments.out.resolve()
    failed = False
    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
        # pyvale leaves a log where it runs.
        if arguments.check:
            lines, failed = check(arguments, Path(folder))
        elif arguments.alternatives:
            extent = f"{four_scenes.COLUMNS} x {four_scenes.ROWS} pixels, {four_scenes.FRAMES} frames"
            lines = [conditions(arguments, extent, PACKAGES[:-1]), "", *compare_alternatives(arguments, Path(folder))]
        else:
            lines = compare_peers(arguments, Path(folder))
    text = "\n".join(lines)
    print(text)
    if out:
        out.write_text(text)
    if failed:
        raise SystemExit("epirig's errors are larger than they should be, or answers are missing")


if __name__ == "__main__":
    main()
