"""A simulated rig by hand, and its scans frame by frame."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest

import epirig

SMALL = ["camera.size=96x64", "plan.settle=20 ms", "plan.frames=7", "plan.step=3 mm"]
# In real time, but quick.
REAL = ["sim.real_time=true", "stage.velocity=100 mm/s", "stage.acceleration=1000 mm/s2"]


def test_stage_and_camera_are_moved_by_hand() -> None:
    rig = epirig.Rig(rig="sim", set=SMALL)
    with pytest.raises(epirig.OptionError, match="not connected"):
        rig.home()
    with rig:
        assert rig.position_mm is None and not rig.moving and rig.travel_mm >= 150
        rig.home()
        assert rig.position_mm == pytest.approx(0, abs=1e-3)
        first = rig.grab()
        assert first.shape == (64, 96)
        rig.move_to(20)
        assert rig.position_mm == pytest.approx(20, abs=0.01)
        assert np.mean(rig.grab() != first) > 0.2
        with pytest.raises(epirig.EpirigError, match="outside"):
            rig.move_to(-5)
        assert all(rig.names)
    with pytest.raises(epirig.OptionError, match="not connected"):
        rig.grab()


def test_a_rig_that_is_not_there_is_a_device_error(tmp_path: Path) -> None:
    with pytest.raises(epirig.DeviceError) as caught:
        epirig.Rig(port=str(tmp_path / "none"), camera="sim").connect()
    assert caught.value.exit_code == 3
    with pytest.raises(epirig.EpirigError, match="there is no key stage.colour"):
        epirig.Rig(rig="sim", set=["stage.colour=red"]).connect()


def test_frames_come_as_they_are_taken(tmp_path: Path) -> None:
    taken = list(epirig.Rig(rig="sim", set=SMALL).capture(tmp_path / "seq"))
    assert [frame.index for frame in taken] == list(range(7))
    sequence = epirig.Sequence(tmp_path / "seq")
    assert sequence.ended == "complete"
    assert np.array_equal(np.stack([frame.image for frame in taken]), sequence.frames())
    assert sequence.positions_mm is not None
    assert [frame.reported_mm for frame in taken] == pytest.approx(list(sequence.positions_mm))
    assert all(frame.certificate for frame in taken)


def test_who_leaves_early_can_resume(tmp_path: Path) -> None:
    rig = epirig.Rig(rig="sim", set=[*SMALL, *REAL])
    for frame in rig.capture(tmp_path / "seq"):
        if frame.index == 1:
            break
    # The generator is closed here, and the scan with it.
    begun = epirig.Sequence(tmp_path / "seq")
    # The stage rests until the loop asks for the next frame.
    assert len(begun) == 2 and begun.ended == "aborted"
    rest = [frame.index for frame in rig.resume(begun)]
    assert rest == list(range(2, 7))
    assert epirig.Sequence(tmp_path / "seq").verify()["findings"] == []


def test_ctrl_c_in_the_loop_leaves_a_scan_to_resume(tmp_path: Path) -> None:
    rig = epirig.Rig(rig="sim", set=[*SMALL, *REAL])
    with pytest.raises(KeyboardInterrupt):
        for frame in rig.capture(tmp_path / "seq"):
            if frame.index == 2:
                os.kill(os.getpid(), signal.SIGINT)
    assert epirig.Sequence(tmp_path / "seq").ended == "aborted"


def test_the_scan_waits_for_the_loop_and_hears_another_thread(tmp_path: Path) -> None:
    rig = epirig.Rig(rig="sim", set=SMALL)
    taken = []
    with rig:
        for frame in rig.capture(tmp_path / "seq"):
            taken.append(frame.index)
            time.sleep(0.2)
            assert len(list((tmp_path / "seq" / "frames").glob("*.png"))) <= frame.index + 1
            if frame.index == 3:
                thread = threading.Thread(target=rig.stop)
                thread.start()
                thread.join()
                break
        assert epirig.Sequence(tmp_path / "seq").ended == "aborted" and taken == [0, 1, 2, 3]
    with rig:
        with pytest.raises(epirig.EpirigError) as caught:
            for frame in rig.resume(tmp_path / "seq"):
                taken.append(frame.index)
                rig.stop()
        assert caught.value.exit_code == 7 and not isinstance(caught.value, KeyboardInterrupt)


ENDS = """
import sys, threading, time, tempfile
from epirig.testing import simulated_rig
rig = simulated_rig(stage=sys.argv[1], frames=9, columns=64, rows=48, real_time=True)
if sys.argv[2] == "move":
    rig.connect()
    rig.home()
    threading.Thread(target=rig.move_to, args=(100,), daemon=True).start()
else:
    scan = rig.capture(tempfile.mkdtemp() + "/seq")
    threading.Thread(target=lambda: list(scan), daemon=True).start()
time.sleep(0.5)
"""


@pytest.mark.parametrize(("stage", "what"), [("native", "move"), ("sim", "scan")])
def test_a_program_that_ends_meanwhile_ends_well(stage: str, what: str) -> None:
    ended = subprocess.run([sys.executable, "-c", ENDS, stage, what], capture_output=True, text=True, timeout=60, check=False)
    assert ended.returncode == 0, ended.stderr


def test_ctrl_c_and_other_threads_stop_a_stage_that_moves() -> None:
    slow = [*SMALL, *REAL, "stage.velocity=20 mm/s"]
    with epirig.Rig(rig="sim", set=slow) as rig:
        rig.home()
        stops = [(lambda: os.kill(os.getpid(), signal.SIGINT), epirig.Interrupted), (rig.stop, epirig.EpirigError)]
        for stop, raised in stops:
            thread = threading.Timer(0.5, stop)
            thread.start()
            begun = time.monotonic()
            with pytest.raises(raised):
                rig.move_to(150)
            thread.join()
            # 150 mm take 7 seconds.
            assert time.monotonic() - begun < 6 and not rig.moving
            rig.move_to(1)
