"""Frames in any layout give the maps that a plain array of them gives; what are no frames is refused."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import epirig

Bytes = NDArray[np.uint8]


def same(one: epirig.Maps, other: epirig.Maps) -> bool:
    names = ["disparity", "sigma", "cost", "confidence", "validity"]
    return all(np.array_equal(getattr(one, name), getattr(other, name), equal_nan=name != "validity") for name in names)


def test_maps_are_owned_and_of_the_size_of_a_frame(frames: Bytes) -> None:
    maps = epirig.match_array(frames)
    for values in (maps.disparity, maps.sigma, maps.cost, maps.confidence):
        assert values.shape == (48, 96) and values.dtype == np.float32 and values.flags.writeable
    assert maps.validity.dtype == np.uint8
    assert np.abs(maps.disparity[8:-8, 12:-12] - 6).max() < 0.02
    assert maps.answered[24, 48] and epirig.VALIDITY[int(maps.validity[24, 48])] == "answered"
    assert maps.shares()["answered"] == pytest.approx(maps.answered.mean())
    assert maps.reference == 7 and maps.range_found and maps.range_px[0] < 6 < maps.range_px[1]


@pytest.mark.parametrize("dtype", ["u1", "<u2", ">u2", "<f4", ">f4", "f2", "<f8", ">f8"])
def test_every_layout_is_the_same_frames(frames: Bytes, dtype: str, tmp_path: Path) -> None:
    plain = frames.astype(dtype)
    expected = epirig.match_array(np.ascontiguousarray(plain, dtype=plain.dtype.newbyteorder("=")))
    assert np.abs(expected.disparity[8:-8, 12:-12] - 6).max() < 0.02
    reversed_columns = plain[:, :, ::-1].copy()[:, :, ::-1]
    padded = np.zeros((15, 97, 200), dtype)[:, :96:2, 3:195:2]
    padded[:] = plain
    frozen = plain.copy()
    frozen.setflags(write=False)
    raw = np.zeros(1 + plain.nbytes, np.uint8)[1:].view(dtype).reshape(plain.shape)
    raw[:] = plain
    np.save(tmp_path / "frames.npy", plain)
    mapped = np.load(tmp_path / "frames.npy", mmap_mode="r")
    layouts: list[Any] = [
        np.asfortranarray(plain),
        np.moveaxis(np.ascontiguousarray(np.moveaxis(plain, 0, -1)), -1, 0),
        reversed_columns,
        padded,
        frozen,
        raw,
        mapped,
        list(plain),
        [np.asfortranarray(frame) for frame in plain],
        tuple(plain),
    ]
    for layout in layouts:
        assert same(epirig.match_array(layout), expected)


def test_floats_may_have_any_unit(frames: Bytes) -> None:
    expected = epirig.match_array(frames.astype(np.float32))
    for factor in (1 / 256, 64.0, 2.0**-40):
        assert same(epirig.match_array(frames * np.float32(factor)), expected)
    for factor in (2.0**-900, 2.0**1000):
        assert same(epirig.match_array(frames * factor), expected)


def test_positions_and_mask_are_used(frames: Bytes) -> None:
    moved = np.linspace(0, 1, 15) ** 1.1
    uneven = epirig.match_array(frames, tau=moved)
    assert not np.allclose(uneven.disparity[24, 40:56], 6, atol=1e-3)
    tau = list(range(15))
    assert same(epirig.match_array(frames, tau=tau), epirig.match_array(frames))
    mask = np.zeros((48, 96))
    mask[10:30, 20:60] = 1
    # True may be any other byte than 0.
    odd = (2 * mask).astype(np.uint8).view(bool)
    for same_mask in (mask, mask > 0, odd):
        maps = epirig.match_array(frames, mask=same_mask)
        assert np.array_equal(maps.answered, mask > 0)


def refused(frames: Any, kind: type[epirig.EpirigError] = epirig.DataError, **options: Any) -> str:
    with pytest.raises(kind) as caught:
        epirig.match_array(frames, **options)
    assert isinstance(caught.value, ValueError)
    assert caught.value.exit_code in (2, 5, 8)
    return str(caught.value)


def test_what_are_no_frames_is_refused_in_words(frames: Bytes) -> None:
    assert "int has no frames" in refused(5)
    assert "shape (96,)" in refused(frames[0])
    assert "take one channel" in refused(np.stack([frames] * 3, axis=-1))
    assert "at least 3 frames" in refused(frames[:2])
    assert "there are no frames" in refused([])
    assert "at least 3 frames and 8 columns" in refused(frames[:, :, :5])
    assert refused(frames[:, :0])
    for dtype in ("complex64", "int32", "int64", "bool", "uint32", "U3", "O"):
        assert f"frame 0 is of {np.dtype(dtype)}" in refused(frames.astype(dtype))
    assert "frame 1 is no array" in refused([frames[0], [[1, 2], [3]], frames[2]])
    assert re.search("frame 2 is 95 x 48 .* 96 x 48", refused([frames[0], frames[1], frames[2][:, 1:]]))
    assert "frame 1 is of float32, and frame 0 is not" in refused([frames[0], frames[1].astype("f4"), frames[2]])
    assert "frame 1 is 96 x 48 of 16 bit" in refused([frames[0], frames[1].astype("u2"), frames[2]])
    for value in (np.nan, np.inf, -np.inf):
        broken = frames.astype(np.float32)
        broken[3, 5, 7] = value
        assert "frame 3 has" in refused(broken) and "row 5, column 7" in refused(broken)
    assert "no range of disparities" in refused(np.zeros_like(frames))
    assert "no range of disparities" in refused(np.zeros(frames.shape, np.float32))


def test_options_that_cannot_be_used_are_refused_in_the_words_of_the_command_line(frames: Bytes) -> None:
    option = epirig.OptionError
    assert "the window is 4, but must be odd" in refused(frames, option, window=4)
    assert "give the smaller number first" in refused(frames, option, range=(9, 3))
    assert "invalid value 'x' for '--method" in refused(frames, option, method="x")
    assert "there is no frame 15 to refer to" in refused(frames, option, reference=15)
    assert "the mask has 3 rows" in refused(frames, option, mask=np.ones((3, 3)))
    assert "no pixel is inside the mask" in refused(frames, option, mask=np.zeros((48, 96)))
    assert "give (rows, columns) of bool" in refused(frames, mask=frames)
    masked = np.ma.masked_array(frames, mask=frames < 40)
    assert "whose mask would be lost" in refused(masked)
    assert "whose mask would be lost" in refused(frames, mask=masked[0])
    assert "mask is NaN in places" in refused(frames, mask=np.full((48, 96), np.nan))
    for tau in (np.zeros((3, 5)), np.zeros(15, complex), "abc", [None] * 15):
        assert "give a number for each frame" in refused(frames, tau=tau)
    assert "ordering-constraint" in refused(frames, option, ordering_constraint=False)
    assert "--window" in refused(frames, option, window=True)
    assert "2 positions are given for 15 frames" in refused(frames, tau=[0, 1])
    assert "must increase strictly" in refused(frames, tau=np.zeros(15))
    with pytest.raises(TypeError, match="unexpected keyword"):
        epirig.match_array(frames, windw=3)  # type: ignore[call-arg]
    try:
        epirig.match_array(frames, range=(9, 3))
    except epirig.EpirigError as error:
        assert (error.exit_code, error.kind, error.advice) == (2, "usage", "give the smaller number first")


def test_options_are_taken_as_numpy_has_them(frames: Bytes) -> None:
    expected = epirig.match_array(frames, quick=True, window=5, range=(4, 8), max_sigma=0.5)
    given = epirig.match_array(
        frames,
        quick=np.True_,  # type: ignore[arg-type]
        window=np.int64(5),  # type: ignore[arg-type]
        range=np.array([4, 8]),  # type: ignore[arg-type]
        max_sigma=np.float32(0.5),  # type: ignore[arg-type]
    )
    assert same(given, expected) and given.settings == expected.settings
    assert repr(expected).startswith("<Maps of 48 rows x 96 columns, ")


def test_a_map_is_drawn(frames: Bytes, tmp_path: Path) -> None:
    pyplot = pytest.importorskip("matplotlib.pyplot")
    pyplot.switch_backend("agg")
    axes = epirig.match_array(frames).plot()
    assert axes.get_title() == "Disparity" and axes.images[0].get_size() == (48, 96)
    pyplot.savefig(tmp_path / "map.png")
    empty = epirig.match_array(frames, max_sigma=1e-9)
    assert not empty.answered.any()
    empty.plot("sigma", axes)
