"""Long work: threads, progress, Ctrl-C, and no growth."""

from __future__ import annotations

import logging
import os
import resource
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

    with pytest.raises(RuntimeError, match="not "):
        epirig.match_array(large, progress=refuse)


def test_ctrl_c_ends_a_match_soon(large: Bytes) -> None:
    begun = time.monotonic()
    epirig.match_array(large)
    whole = time.monotonic() - begun
    waited = []
    for share in (0.3, 0.7):
        sent: list[float] = []

        def press(share: float = share, sent: list[float] = sent) -> None:
            time.sleep(share * whole)
            sent.append(time.monotonic())
            os.kill(os.getpid(), signal.SIGINT)

        thread = threading.Thread(target=press)
        thread.start()
        try:
            with pytest.raises(KeyboardInterrupt) as caught:
                epirig.match_array(large)
                # A match that was too fast is interrupted here.
                time.sleep(60)
        finally:
            thread.join()
        waited.append(time.monotonic() - sent[0])
        if isinstance(caught.value, epirig.Interrupted):
            assert caught.value.exit_code == 130 and "interrupted" in str(caught.value)
    print(f"a match of {whole:.1f} s ended {max(waited):.3f} s after Ctrl-C, or sooner")
    # Timings decide nothing here but whether Ctrl-C is heard at all.
    assert max(waited) < 30
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


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


def test_ctrl_c_ends_other_work(sequence: epirig.Sequence, tmp_path: Path) -> None:
    def press(what: str, done: int, total: int) -> None:
        raise KeyboardInterrupt

    with pytest.raises(epirig.Interrupted) as caught:
        sequence.verify(progress=press)
    assert caught.value.exit_code == 130
    assert not list(tmp_path.iterdir())
