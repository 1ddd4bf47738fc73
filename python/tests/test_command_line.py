"""The package does what the command line does, to the last bit and in the same words."""

from __future__ import annotations

import inspect
import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import epirig
from epirig import _native

HERE = Path(__file__).parent


def command(*words: Any) -> subprocess.CompletedProcess[str]:
    """The program of the package, as a person calls it."""
    program = Path(sys.executable).with_name("epirig")
    return subprocess.run([program, *map(str, words)], capture_output=True, text=True, check=False)


@pytest.mark.parametrize(
    "options",
    [
        {},
        {"quick": True},
        {"ordering_constraint": "off", "reference": "first"},
        {"method": "normalised", "window": 5},
        {"method": "ncc-mean", "range": (-5.0, 40.5)},
        {"reference": 3, "semi_global": True, "max_sigma": 0.25},
    ],
)
def test_frames_in_memory_give_what_the_command_line_writes(
    sequence: epirig.Sequence, written: Path, options: dict[str, Any]
) -> None:
    words = []
    for name, value in options.items():
        option = "--" + name.replace("_", "-")
        text = "..".join(map(str, value)) if isinstance(value, tuple) else str(value)
        words += [option] if value is True else [f"{option}={text}"]
    out = written / "-".join(options or ["usual"])
    ended = command("match", sequence.folder, "--out", out, "--json", "--as-captured", *words)
    assert ended.returncode == 0, ended.stderr
    record = json.loads(ended.stdout)
    maps = epirig.match_array(sequence.frames(), tau=sequence.tau(), **options)
    found = epirig.Results(out)
    for name in ("disparity", "sigma", "cost", "confidence"):
        assert np.array_equal(getattr(maps, name), found.map(name), equal_nan=True), name
    assert np.array_equal(maps.validity, found.validity)
    # The record says which search was used; the options, which was asked for.
    used = {**maps.settings, "search": record["settings"]["search"]}
    assert used == record["settings"]
    assert (maps.reference, list(maps.range_px)) == (record["reference"], [record["minimum_px"], record["maximum_px"]])
    in_process = sequence.match(out=written / f"again-{out.name}", as_captured=True, **options)
    assert np.array_equal(in_process.disparity, found.disparity, equal_nan=True)
    assert {**in_process.record, "seconds": 0} == {**record, "seconds": 0}


def test_options_and_defaults_are_those_of_the_command_line() -> None:
    verbs = {verb["verb"]: verb for verb in json.loads(_native.verbs())}
    matching = [option for option in verbs["match"]["options"] if option["heading"] == "Matching"]
    parameters = inspect.signature(epirig.match_array).parameters
    assert list(parameters)[3:-1] == [option["long"].replace("-", "_") for option in matching]
    for option in matching:
        default = parameters[option["long"].replace("-", "_")].default
        told = option["default"]
        assert default == (told and type(default)(told)) if option["kind"] != "flag" else default is False
    assert "Cost function" in (epirig.match_array.__doc__ or "")
    check = subprocess.run([sys.executable, "-I", HERE.parent / "generate.py", "--check"], check=False)
    assert check.returncode == 0


def test_a_failure_has_the_words_and_the_code_of_the_command_line(tmp_path: Path) -> None:
    missing = tmp_path / "nowhere"
    ended = command("match", missing)
    with pytest.raises(epirig.EpirigError) as caught:
        epirig.Sequence(missing)
    assert ended.returncode == caught.value.exit_code
    assert " ".join(ended.stderr.split()) == f"error: {caught.value}"
    assert command("--version").stdout == f"epirig {epirig.__version__}\n"
    assert command("match").returncode == 2
    assert command("frobnicate").returncode == 2


SCRIPT = """
import resource, sys, numpy as np, epirig
if sys.argv[1] == "empty":
    pass
else:
    epirig.match_array(np.load(sys.argv[1], mmap_mode="r"))
print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)
"""


def test_the_peak_of_memory_is_that_of_the_command_line(tmp_path: Path) -> None:
    """Of a match of 40 frames of 1000 x 1000 px: at most 1.2 times that of the command line, beside the interpreter."""
    t, y, x = np.ogrid[0:40, 0:1000, 0:1000]
    place = x - 6.0 * t / 39
    light = np.empty((40, 1000, 1000), np.uint8)
    for index in range(40):
        light[index] = 120 + 60 * np.sin(0.9 * place[index] + y[0]) + 50 * np.sin(0.37 * place[index] - 2 * y[0])
    np.save(tmp_path / "frames.npy", light)

    def peak(what: Any) -> int:
        ended = subprocess.run([sys.executable, "-c", SCRIPT, str(what)], capture_output=True, text=True, check=True)
        return 1024 * int(ended.stdout)

    images = tmp_path / "images"
    images.mkdir()
    for index, frame in enumerate(light):
        (images / f"{index:03}.pgm").write_bytes(b"P5 1000 1000 255\n" + frame.tobytes())
    sequence = epirig.import_images([images], out=tmp_path / "seq")
    program = Path(sys.executable).with_name("epirig")
    child = subprocess.Popen([program, "match", sequence.folder], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    _, status, used = os.wait4(child.pid, 0)
    child.returncode = os.waitstatus_to_exitcode(status)
    assert child.returncode == 0
    peak_of_program = 1024 * used.ru_maxrss
    interpreter, library = peak("empty"), peak(tmp_path / "frames.npy")
    print(f"the program {peak_of_program / 1e6:.0f} MB, the library {library / 1e6:.0f} MB, of which Python {interpreter / 1e6:.0f} MB")
    # Both have the interpreter. A memory-mapped file counts as far as it has been read. The maps of a match are in
    # memory a second time, as those of NumPy; a fifth more is the most that a caller should notice.
    assert library - light.nbytes < 1.2 * peak_of_program
