"""Long work: threads, progress, Ctrl-C, and no growth."""

from __future__ import annotations

import logging
import os
import resource
import shutil
import signal
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

import epirig

Bytes = NDArray[np.uint8]


@pytest.fixture(scope="module")
def large() -> Bytes:
    """Some seconds of work."""
    t, y, x = np.ogrid[0:60, 0:1200, 0:1600]
    out = np.empty((60, 1200, 1600), np.uint8)
    for index in range(60):
        place = x[0] - 6.0 * index / 59
        out[index] = 120 + 60 * np.sin(0.9 * place + y[0]) + 50 * np.sin(0.37 * place - 2 * y[0])
    return out


def test_ten_matches_in_threads_are_ten_matches(frames: Bytes) -> None:
    expected = [epirig.match_array(frames, reference=index) for index in range(10)]
    with ThreadPoolExecutor(10) as pool:
        found = list(pool.map(lambda index: epirig.match_array(frames, reference=index), range(10)))
    for one, other in zip(found, expected, strict=True):
        assert np.array_equal(one.disparity, other.disparity, equal_nan=True)


def test_python_goes_on_during_a_match(large: Bytes) -> None:
    counts: list[float] = []

    def count() -> None:
        begun = time.monotonic()
        while thread.is_alive():
            counts.append(time.monotonic() - begun)
            time.sleep(0.01)

    thread = threading.Thread(target=epirig.match_array, args=(large,))
    thread.start()
    count()
    thread.join()
    assert len(counts) > 20, "the lock was held"


def test_progress_is_told_in_order(large: Bytes) -> None:
    told: list[tuple[str, int, int]] = []
    epirig.match_array(large, progress=lambda *what: told.append(what))
    names = list(dict.fromkeys(what for what, _, _ in told))
    assert "matching" in names and "refining" in names and names.index("matching") < names.index("refining")
    assert all(0 <= done <= total for _, done, total in told)
    assert told[-1][1] == told[-1][2]


def test_an_exception_of_the_listener_ends_the_match(large: Bytes) -> None:
    def refuse(what: str, done: int, total: int) -> None:
        raise RuntimeError(f"not {what}")

    with pytest.raises(RuntimeError, match="not ") as caught:
        epirig.match_array(large, progress=refuse)
    assert "refining" not in str(caught.value)


def test_ctrl_c_ends_a_match_early(large: Bytes) -> None:
    told: list[tuple[str, int, int]] = []
    sent: list[float] = []

    def press(what: str, done: int, total: int) -> None:
        told.append((what, done, total))
        if not sent:
            sent.append(time.monotonic())
            os.kill(os.getpid(), signal.SIGINT)

    with pytest.raises(epirig.Interrupted) as caught:
        epirig.match_array(large, progress=press)
    print(f"it ended {time.monotonic() - sent[0]:.3f} s after Ctrl-C")
    assert caught.value.exit_code == 130 and "interrupted" in str(caught.value)
    # The last rows were not fitted.
    assert ("refining", large.shape[1], large.shape[1]) not in told
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
    assert epirig.match_array(large[:, :100]).answered.any()


def test_an_exception_in_one_thread_leaves_the_scan_of_another(large: Bytes, tmp_path: Path) -> None:
    def refuse(what: str, done: int, total: int) -> None:
        raise RuntimeError("no")

    small = ["camera.size=64x48", "plan.settle=100 ms"]
    with ThreadPoolExecutor(1) as pool:
        scan = pool.submit(epirig.capture, out=tmp_path / "seq", rig="sim", set=small, frames=61, step_mm=2.5)
        for _ in range(3):
            with pytest.raises(RuntimeError):
                epirig.match_array(large, progress=refuse)
        assert scan.result().ended == "complete"


def test_a_fork_is_refused_rather_than_waiting_for_ever(frames: Bytes) -> None:
    epirig.match_array(frames)
    child = os.fork()
    if child == 0:
        try:
            epirig.match_array(frames)
        except epirig.EpirigError as error:
            os._exit(7 if "spawn" in str(error) else 1)
        os._exit(0)
    assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 7


def test_two_hundred_matches_keep_no_memory(frames: Bytes) -> None:
    def held() -> int:
        return int(Path("/proc/self/statm").read_text().split()[1]) * resource.getpagesize()

    wide = np.tile(frames, (1, 1, 2))
    some = {"range": (5, 7), "search": "factorised", "quick": True}
    for _ in range(50):
        epirig.match_array(wide, **some)  # type: ignore[arg-type]
    before = held()
    for _ in range(200):
        epirig.match_array(wide, **some)  # type: ignore[arg-type]
    grown = held() - before
    # One match has 15 frames and 5 maps of 48 x 192: 200 of them that stayed would be 60 MB.
    assert grown < 8e6, f"grown by {grown / 1e6:.1f} MB"


def test_remarks_go_to_the_log(sequence: epirig.Sequence, tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    with caplog.at_level(logging.INFO, logger="epirig"):
        sequence.match(out=tmp_path / "out")
    assert any("matching needs up to" in record.message for record in caplog.records)


def test_nothing_is_printed(sequence: epirig.Sequence, tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    sequence.match(out=tmp_path / "out")
    sequence.verify()
    printed = capfd.readouterr()
    assert (printed.out, printed.err) == ("", "")


def test_ctrl_c_ends_a_scan_that_can_be_resumed(tmp_path: Path) -> None:
    def press(what: str, done: int, total: int) -> None:
        if what == "capturing" and done >= 3 and not pressed:
            pressed.append(done)
            os.kill(os.getpid(), signal.SIGINT)

    pressed: list[int] = []
    slow = ["camera.size=64x48", "plan.settle=100 ms"]
    with pytest.raises(epirig.Interrupted) as caught:
        epirig.capture(out=tmp_path / "seq", rig="sim", set=slow, frames=31, step_mm=5, progress=press)
    assert caught.value.exit_code == 7
    begun = epirig.Sequence(tmp_path / "seq")
    assert begun.ended == "aborted" and 3 <= len(begun) < 31
    ended = epirig.resume(tmp_path / "seq")
    assert ended.ended == "complete" and len(ended) == 31
    assert ended.verify()["findings"] == []


def test_a_scan_that_has_not_begun_ends_at_its_start(tmp_path: Path) -> None:
    begun: list[str] = []

    def refuse(what: str, done: int, total: int) -> None:
        begun.append(what)
        raise RuntimeError("never")

    slow = ["camera.size=64x48", "plan.settle=100 ms", "sim.real_time=true"]
    with pytest.raises(RuntimeError, match="never"):
        epirig.capture(out=tmp_path / "seq", rig="sim", set=slow, frames=31, step_mm=5, progress=refuse)
    # The listener is not asked again, so its exceptions do not stop the stage in a move.
    assert len(begun) == 1
    ended = epirig.Sequence(tmp_path / "seq")
    assert ended.ended == "aborted" and len(ended) < 31


def test_a_surface_that_was_interrupted_is_not_written(tmp_path: Path) -> None:
    small = ["camera.size=512x512", "plan.settle=20 ms"]
    sequence = epirig.capture(out=tmp_path / "seq", rig="sim", set=small, frames=21, step_mm=7.5)
    sequence.match()
    done: list[str] = []
    sequence.surface(progress=lambda what, *_: done.append(what))
    for phase in dict.fromkeys(done):

        def press(what: str, done: int, total: int, phase: str = phase) -> None:
            if what == phase:
                raise KeyboardInterrupt

        out = tmp_path / "surface"
        try:
            sequence.surface(out=out, progress=press)
        except epirig.Interrupted:
            assert not out.exists(), phase
        else:
            # The phase was too short to be told this time.
            shutil.rmtree(out)


def test_ctrl_c_ends_other_work(sequence: epirig.Sequence, tmp_path: Path) -> None:
    def press(what: str, done: int, total: int) -> None:
        raise KeyboardInterrupt

    with pytest.raises(epirig.Interrupted) as caught:
        sequence.verify(progress=press)
    assert caught.value.exit_code == 130
    assert not list(tmp_path.iterdir())
