"""A sequence from its scan to its surface."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import epirig


def test_a_scan_becomes_a_surface(tmp_path: Path) -> None:
    small = ["camera.size=768x768", "plan.settle=20 ms"]
    sequence = epirig.capture(out=tmp_path / "seq", rig="sim", set=small, frames=21, step_mm=7.5)
    assert len(sequence) == 21 and sequence.ended == "complete"
    assert sequence.positions_mm is not None and np.allclose(np.diff(sequence.positions_mm), 7.5, atol=0.01)
    assert sequence.verify()["findings"] == []
    frames = sequence.frames()
    assert frames.shape == (21, 768, 768) and frames.dtype in (np.uint8, np.uint16)
    assert np.array_equal(epirig.Sequence(sequence.folder).frames(), frames)
    results = sequence.match()
    assert results.disparity.shape == (768, 768)
    assert set(results.maps) >= {"disparity", "sigma", "height", "height-sigma"}
    assert np.array_equal(np.isfinite(results.disparity), results.answered)
    surface = sequence.surface()
    assert surface.depth_mm is not None and surface.interval_mm is not None
    low, high = surface.interval_mm
    # The simulated tile has hollows of 0.2 mm.
    assert low < 0.2 < high and high - low < 0.02
    assert sum(part["share"] or 0 for part in surface.budget) == pytest.approx(1)
    assert surface.report.read_text().startswith("<!DOCTYPE html>") and "0.2" in surface.conclusion
    written = sequence.export(map="height", out=tmp_path / "height.npy")
    assert written is not None and np.array_equal(np.load(tmp_path / "height.npy"), results.height_mm, equal_nan=True)
    again = epirig.Sequence(sequence.folder)
    record = {**again.results().record}
    del record["files"]
    assert record == results.record and again.measured_surface().depth_mm == surface.depth_mm
    assert surface.verdict is None and surface.judgements == []
    # A verdict is a result, and no exception.
    judged = sequence.surface(tolerance="0.5..0.6 mm, sa ..1 mm", overwrite=True)
    assert judged.verdict == "fail" and [one["verdict"] for one in judged.judgements] == ["fail", "pass"]
    with pytest.raises(epirig.OptionError, match="0.2 \\+- 0.01 mm"):
        sequence.surface(tolerance="0.5", overwrite=True)
    (listed,) = epirig.list_sequences(folder=tmp_path)["sequences"]
    assert (listed["name"], listed["verdict"], listed["depth_mm"]) == ("seq", "fail", judged.depth_mm)
    assert epirig.trend(folder=tmp_path)["trends"] == [], "one sequence is no trend"


def test_maps_that_are_not_there_are_named(sequence: epirig.Sequence, tmp_path: Path) -> None:
    results = sequence.match(out=tmp_path / "out")
    with pytest.raises(KeyError, match="there are disparity, sigma"):
        results.map("relief")
    (tmp_path / "out" / "sigma.tiff").write_bytes(b"II*")
    with pytest.raises(epirig.DataError, match="sigma.tiff"):
        results.map("sigma")


def test_images_become_a_sequence(tmp_path: Path, frames: np.ndarray) -> None:
    images = tmp_path / "images"
    images.mkdir()
    for index, frame in enumerate(frames):
        (images / f"{index:02}.pgm").write_bytes(b"P5 96 48 255\n" + frame.tobytes())
    sequence = epirig.import_images([images], out=tmp_path / "seq")
    assert np.array_equal(sequence.frames(), frames)
    with pytest.raises(epirig.OptionError, match="has no calibration"):
        sequence.frames(rectified=True)
    with pytest.raises(epirig.EpirigError) as caught:
        epirig.import_images([images / "none*.png"], out=tmp_path / "other")
    assert caught.value.exit_code in (1, 2, 5)
    assert not (tmp_path / "other").exists()


@pytest.mark.parametrize("dtype", ["u1", "<u2", ">u2"])
def test_an_array_becomes_a_sequence(tmp_path: Path, frames: np.ndarray, dtype: str) -> None:
    light = (frames.astype(dtype) * (1 if dtype == "u1" else 257)).astype(dtype)
    positions_mm = np.linspace(3, 17, len(frames)) ** 1.1
    sequence = epirig.Sequence.from_array(light[:, ::-1], tmp_path / "seq", positions_mm=positions_mm, focal_length_px=900)
    assert np.array_equal(sequence.frames(), light[:, ::-1])
    assert sequence.positions_mm is not None and np.allclose(sequence.positions_mm, positions_mm, atol=1e-9)
    equal = epirig.Sequence.from_array(list(frames), tmp_path / "other", step_mm=0.5)
    assert equal.positions_mm is not None and np.allclose(np.diff(equal.positions_mm), 0.5)
    for wrong in (frames[0], frames.astype(float), frames.astype(np.uint32), np.zeros((0, 4, 4), np.uint8)):
        with pytest.raises(epirig.EpirigError):
            epirig.Sequence.from_array(wrong, tmp_path / "wrong")
    with pytest.raises(epirig.EpirigError, match="positions"):
        epirig.Sequence.from_array(frames, tmp_path / "wrong", positions_mm=[1, 2])
    assert not (tmp_path / "wrong").exists()


def test_findings_are_in_the_message_and_in_the_report(tmp_path: Path, frames: np.ndarray) -> None:
    sequence = epirig.Sequence.from_array(frames, tmp_path / "seq")
    damaged = sorted((sequence.folder / "frames").iterdir())[3]
    damaged.write_bytes(damaged.read_bytes()[:-9])
    with pytest.raises(epirig.DataError, match=damaged.name) as caught:
        sequence.verify()
    assert caught.value.report["findings"][0]["file"].endswith(damaged.name)


def test_results_that_were_replaced_are_not_mixed_with_others(sequence: epirig.Sequence, tmp_path: Path) -> None:
    first = sequence.match(out=tmp_path / "out")
    second = sequence.match(out=tmp_path / "out", overwrite=True, max_sigma=0.5)
    assert second.disparity.shape == (192, 256)
    with pytest.raises(epirig.DataError, match="other results than these by now"):
        first.map("sigma")
    with pytest.raises(epirig.DataError, match="no results of match"):
        epirig.Results(tmp_path)
    (tmp_path / "match.json").write_text("{")
    with pytest.raises(epirig.DataError, match="it is no record"):
        epirig.Results(tmp_path)


def test_a_sequence_stays_where_it_is(sequence: epirig.Sequence, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(sequence.folder.parent)
    near = epirig.Sequence(sequence.folder.name)
    monkeypatch.chdir("/")
    assert near.verify()["findings"] == []
