"""The simulated rig as fixtures: faults by script, and the truth beside the result."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import epirig
from epirig.testing import truth

Rigs = Callable[..., epirig.Rig]
Scans = Callable[..., epirig.Sequence]


def test_the_truth_stands_beside_the_result(epirig_scan: Scans) -> None:
    sequence = epirig_scan(frames=31, step_mm=3)
    results = sequence.match()
    known = truth(sequence)
    assert known.reference == results.record["reference"] == 15
    assert known.disparity.shape == results.disparity.shape == (192, 256)
    assert sequence.positions_mm is not None and np.allclose(known.positions_mm, sequence.positions_mm)
    assert np.allclose(known.tau, sequence.tau())
    errors = known.errors(results)
    # The aim of the project is a hundredth of a pixel.
    assert np.nanmean(np.abs(errors)) < 0.01
    assert np.isfinite(errors).sum() > 0.95 * np.isfinite(known.disparity).sum()
    assert np.nanmax(known.height_mm) == pytest.approx(0, abs=1e-4)
    assert np.nanmin(known.height_mm) == pytest.approx(-0.2, abs=1e-4)
    first = truth(sequence, 0)
    assert not np.array_equal(first.disparity, known.disparity, equal_nan=True)
    with pytest.raises(epirig.DataError, match="was measured in frame 15"):
        first.errors(results)
    assert np.array_equal(known.errors(epirig.match_array(sequence.frames(), tau=sequence.tau())), errors, equal_nan=True)
    with pytest.raises(epirig.EpirigError, match="no frame 99"):
        truth(sequence, 99)


def test_a_turned_camera_has_the_truth_of_its_rectified_frames(epirig_scan: Scans) -> None:
    turned = ["sim.roll=0.7 deg", "sim.step_error=5 um"]
    sequence = epirig_scan(frames=5, settings=turned)
    with pytest.raises(epirig.EpirigError, match="turned or distorts"):
        truth(sequence)
    sequence.calibrate()
    known = truth(sequence)
    assert sequence.positions_mm is not None
    errors_mm = known.positions_mm - sequence.positions_mm
    assert known.disparity.ndim == 2 and 0 < np.abs(errors_mm).max() < 0.03


def test_photographs_have_no_truth(tmp_path: Path, frames: np.ndarray) -> None:
    (tmp_path / "photos").mkdir()
    for index, frame in enumerate(frames):
        (tmp_path / "photos" / f"{index:02}.pgm").write_bytes(b"P5 96 48 255\n" + frame.tobytes())
    sequence = epirig.import_images([tmp_path / "photos"], out=tmp_path / "seq")
    with pytest.raises(epirig.EpirigError, match="nobody knows its truth"):
        truth(sequence)


@pytest.mark.parametrize("stage", ["sim", "native", "grbl", "zaber"])
def test_each_stage_scans_without_hardware(epirig_scan: Scans, stage: str) -> None:
    sequence = epirig_scan(stage=stage, frames=5, columns=64, rows=48)
    assert len(sequence) == 5 and sequence.ended == "complete"


def test_a_lost_step_is_noticed(epirig_rig: Rigs, tmp_path: Path) -> None:
    rig = epirig_rig(frames=9, faults=["lost-steps@4/0.1mm"])
    with pytest.raises(epirig.DeviceError, match=r"home was found \+0.1000 mm"):
        list(rig.capture(tmp_path / "seq"))
    assert epirig.Sequence(tmp_path / "seq").ended == "not-closed"


def test_a_camera_that_stalls_and_a_link_that_lies_cost_time_and_no_frame(
    epirig_scan: Scans, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level("INFO", "epirig")
    small = {"frames": 7, "columns": 64, "rows": 48}
    sound = epirig_scan(**small)
    for faults in (["camera-silent@3/2s", "camera-torn@4"], ["noise@3/10s", "reset@5+0.2s"]):
        stage = "native" if "noise@3/10s" in faults else "sim"
        again = epirig_scan(**small, faults=faults, stage=stage)
        assert np.array_equal(again.frames(), sound.frames())
    assert "has restarted" in caplog.text


def test_a_camera_that_goes_is_no_key_that_was_pressed(epirig_rig: Rigs, tmp_path: Path) -> None:
    rig = epirig_rig(frames=7, faults=["camera-gone@3"], wait_s=0.1)
    with pytest.raises(epirig.DeviceError) as caught:
        list(rig.capture(tmp_path / "seq"))
    assert caught.value.exit_code == 7 and not isinstance(caught.value, KeyboardInterrupt)
    with pytest.raises(epirig.EpirigError, match="3 of 7 frames"):
        truth(epirig.Sequence(tmp_path / "seq"))
    # The fault has happened; who resumes has a camera again.
    assert [frame.index for frame in rig.resume(tmp_path / "seq")] == [3, 4, 5, 6]


def test_faults_come_at_frames_of_a_rig_that_is_moved_by_hand(epirig_rig: Rigs) -> None:
    with epirig_rig(stage="native", frames=5, faults=["reset@2+0.1s", "camera-no-signal@3"]) as rig:
        rig.home()
        rig.move_to(12)
        with pytest.raises(epirig.DeviceError, match="restarted"):
            rig.move_to(14)
        rig.home()
        rig.move_to(14)
        rig.grab()
        rig.move_to(16)
        with pytest.raises(epirig.DeviceError, match="no signal"):
            rig.grab()


def test_a_move_that_is_refused_uses_up_no_fault(epirig_rig: Rigs) -> None:
    with epirig_rig(stage="native", frames=5, faults=["reset@1+0.1s", "camera-no-signal@1"]) as rig:
        with pytest.raises(epirig.EpirigError):
            rig.move_to(12)
        rig.home()
        rig.grab()
        rig.move_to(10)
        with pytest.raises(epirig.DeviceError, match="restarted"):
            rig.move_to(12)
        rig.home()
        rig.move_to(14)
        # It was due at frame 1, and this is the next frame.
        with pytest.raises(epirig.DeviceError, match="no signal"):
            rig.grab()


def test_what_cannot_happen_is_refused(epirig_rig: Rigs) -> None:
    for faults, words in [
        (["fire@3"], "must be faults such as"),
        (["lost-steps@99/1mm"], "there is no frame 99"),
        (["mute@3/1s"], "needs a stage at the end of a simulated line"),
    ]:
        with pytest.raises(epirig.OptionError, match=words):
            epirig_rig(frames=5, faults=faults).connect()
