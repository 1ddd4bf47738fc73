"""What a match costs over rows, columns, frames, range of disparities and bands.

    python3 benches/scale/measure.py [--program target/release/epirig] [--largest 8192] [--folder /dev/shm]

Each series changes one size of a scene: a textured plane, noise of 1 DN, 8 bit. Printed are the seconds of the matching
and of the whole command, the peak of its memory, and how the time grows: the exponent of a power law between neighbours,
which is 1 for a cost in proportion. Needs numpy. Measure on a machine that does nothing else.
"""

import argparse
import json
import math
import multiprocessing
import os
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

FINE = 4  # Samples of the texture for each pixel.


def scene(folder: Path, rows: int, columns: int, frames: int, disparity: float) -> None:
    """Writes the frames of a plane, which moves by `disparity` px over all of them, as PGM."""
    import numpy as np

    random = np.random.default_rng(1)
    folder.mkdir()
    width = (columns + int(abs(disparity)) + 8) * FINE
    # One texture of 256 rows, repeated: what a row costs does not depend on the others.
    texture = random.normal(size=(min(rows, 256), width)).astype(np.float32)
    kernel = np.hanning(4 * FINE + 1).astype(np.float32)
    spectrum = np.fft.rfft(texture, axis=1) * np.fft.rfft(kernel, width)
    texture = np.fft.irfft(spectrum, width, axis=1).astype(np.float32)
    texture *= 40.0 / texture.std()
    for t in range(frames):
        place = (np.arange(columns) + 4 + disparity * t / (frames - 1)) * FINE
        left = place.astype(int)
        share = (place - left).astype(np.float32)
        part = 128.0 + texture[:, left] * (1.0 - share) + texture[:, left + 1] * share
        part = np.tile(part, (math.ceil(rows / len(part)), 1))[:rows]
        part += random.normal(size=part.shape).astype(np.float32)
        samples = np.clip(np.rint(part), 0, 255).astype(np.uint8)
        (folder / f"{t:04}.pgm").write_bytes(b"P5 %d %d 255\n" % (columns, rows) + samples.tobytes())


def run(arguments: list[str]) -> tuple[dict, float, float]:
    """The JSON that the program prints, seconds, and the peak of its memory in MB."""
    begun = time.monotonic()
    process = subprocess.Popen([*arguments, "--quiet", "--json"], stdout=subprocess.PIPE)
    told = process.stdout.read()
    _, status, usage = os.wait4(process.pid, 0)
    if status != 0:
        sys.exit(f"{' '.join(arguments)} has failed")
    return json.loads(told), time.monotonic() - begun, usage.ru_maxrss / 1024


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--program", default="target/release/epirig")
    parser.add_argument("--largest", type=int, default=8192, help="most rows")
    parser.add_argument("--folder", default=None, help="where scenes are made")
    options = parser.parse_args()
    program = str(Path(options.program).resolve())
    usual = {"rows": 512, "columns": 1024, "frames": 50, "disparity": 40.0}
    doubled = [2**power for power in range(8, 14) if 2**power <= options.largest]
    series = [
        ("rows", doubled, []),
        ("rows", doubled, ["--quick"]),
        ("columns", [512, 1024, 2048, 4096], []),
        ("frames", [25, 50, 100, 200], []),
        ("disparity", [20.0, 40.0, 80.0, 160.0], []),
    ]
    with tempfile.TemporaryDirectory(dir=options.folder) as folder:
        for what, values, more in series:
            print(f"\n{what} {' '.join(more)}".rstrip())
            print(f"{what:>10} {'matching s':>11} {'command s':>10} {'peak MB':>8} {'exponent':>9}")
            before = None
            for value in values:
                sizes = {**usual, what: value}
                place = Path(folder) / "scene"
                # In a process of its own: a child that is measured begins with the memory of its parent.
                making = multiprocessing.Process(target=scene, args=(Path(folder) / "photos",), kwargs=sizes)
                making.start()
                making.join()
                run([program, "import", str(Path(folder) / "photos"), "--out", str(place)])
                told, seconds, peak = min(
                    (run([program, "match", str(place), "--overwrite", *more]) for _ in range(2)),
                    key=lambda measured: measured[0]["seconds"],
                )
                matching = told["seconds"]
                exponent = "" if before is None else f"{math.log2(matching / before):9.2f}"
                print(f"{value:10g} {matching:11.2f} {seconds:10.2f} {peak:8.0f} {exponent}", flush=True)
                before = matching
                shutil.rmtree(place)
                shutil.rmtree(Path(folder) / "photos")


if __name__ == "__main__":
    main()
