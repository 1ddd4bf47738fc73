"""A match in bands of rows, one band a task of Dask: in two processes of this machine, or by the workers of a scheduler.

    python dask_bands.py SEQ [--scheduler ADDRESS] [--block-rows ROWS]

All workers see the folder of the sequence under the same name. A worker that does one band at a time on eight threads:

    RAYON_NUM_THREADS=8 dask worker ADDRESS --nthreads 1
"""
# mypy: allow-untyped-calls

from __future__ import annotations

import argparse
import os
from pathlib import Path
from typing import Any

import numpy as np
from dask.distributed import Client, as_completed, get_worker
from dask.system import CPU_COUNT

import epirig

PROCESSES = 2


def match_band(folder: Path, band: int) -> dict[str, Any]:
    # The first match of a process begins its threads. Without a number of its own a worker has as many as Dask gives it.
    os.environ.setdefault("RAYON_NUM_THREADS", str(get_worker().state.nthreads))
    return epirig.Sequence(folder).match_band(band)


def main() -> None:
    options = argparse.ArgumentParser(description="Match a sequence in bands of rows, with Dask.")
    options.add_argument("sequence", metavar="SEQ")
    options.add_argument("--scheduler", metavar="ADDRESS", help="such as tcp://10.0.0.1:8786")
    options.add_argument("--block-rows", metavar="ROWS", type=int)
    asked = options.parse_args()
    sequence = epirig.Sequence(asked.sequence)
    bands = len(sequence.survey(block_rows=asked.block_rows)["task"]["bands"])
    share = {"RAYON_NUM_THREADS": str(max(1, CPU_COUNT // PROCESSES))}
    here = {"n_workers": PROCESSES, "threads_per_worker": 1, "env": share, "dashboard_address": None}
    with Client(asked.scheduler) if asked.scheduler else Client(**here) as client:
        # A band that fails, or whose worker dies, is tried again. Blocks that are matched already stay.
        tasks = client.map(match_band, [sequence.folder] * bands, range(bands), retries=2, pure=False)
        for _, done in as_completed(tasks, with_results=True):
            first, end = done["rows"]
            print(f"band {done['band']} of {bands}: rows {first} .. {end - 1}")
    results = sequence.merge()
    print(f"median disparity {np.nanmedian(results.disparity):.4f} px: {results.folder}")


if __name__ == "__main__":
    main()
