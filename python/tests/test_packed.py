"""A packed volume is read by other software, and arrays of other software are matched."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import epirig


def test_other_software_reads_the_packed_volume(sequence: epirig.Sequence, tmp_path: Path) -> None:
    zarr: Any = pytest.importorskip("zarr")
    dask: Any = pytest.importorskip("dask.array")
    napari: Any = pytest.importorskip("napari_ome_zarr")
    folder = tmp_path / "volume.zarr"
    told = sequence.pack(out=folder)
    frames = sequence.frames()
    assert (told["frames"], told["rows"], told["columns"]) == frames.shape
    array = zarr.open_group(folder, mode="r")["0"]
    assert np.array_equal(array[:], frames)
    assert array.shards == (1, 192, 256) and array.chunks == (1, 16, 256)
    assert np.array_equal(array[:, 70:75], frames[:, 70:75])
    mean = dask.from_zarr(str(folder / "0")).astype(float).mean(axis=0).compute()
    assert np.allclose(mean, frames.mean(axis=0))
    reader = napari.napari_get_reader(str(folder))
    ((layer, *_),) = [layer for layer in reader(str(folder))]
    assert np.array_equal(np.asarray(layer[0]), frames)


def test_the_packed_volume_gives_the_same_maps(sequence: epirig.Sequence, tmp_path: Path) -> None:
    by_images = sequence.match(out=tmp_path / "images")
    sequence.pack()
    notes = sequence.match(out=tmp_path / "packed")
    for name in ("disparity", "sigma", "cost", "confidence"):
        assert np.array_equal(by_images.map(name), notes.map(name), equal_nan=True), name


def test_an_array_of_other_software_is_matched(tmp_path: Path, frames: NDArray[np.uint8]) -> None:
    zarr: Any = pytest.importorskip("zarr")
    expected = epirig.match_array(frames)
    layouts: dict[str, dict[str, Any]] = {
        "plain": {},
        "second": {"zarr_format": 2, "compressors": None},
        "shards": {"shards": (1, 48, 96)},
    }
    for name, options in layouts.items():
        place = tmp_path / f"{name}.zarr"
        zarr.create_array(str(place), data=frames, chunks=(1, 16, 32), **options)
        imported = epirig.import_images([place], out=tmp_path / name)
        assert np.array_equal(imported.frames(), frames), name
        found = imported.match()
        assert np.array_equal(found.disparity, expected.disparity, equal_nan=True), name
