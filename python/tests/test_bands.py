"""A match in bands of rows: a survey, each band by itself, and the merge."""

from __future__ import annotations

import inspect
import pickle
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import epirig

Scan = Callable[..., epirig.Sequence]


@pytest.fixture
def scan(epirig_scan: Scan) -> epirig.Sequence:
    """A sequence of its own, because plan and packed frames come into its folder."""
    return epirig_scan(step_mm=7.5)


def test_bands_give_the_bits_of_one_match(scan: epirig.Sequence, tmp_path: Path) -> None:
    whole = scan.match(block_rows=24, method="normalised", region=(10, 20, 200, 180), memory="2GiB")
    plan = scan.survey(block_rows=24, method="normalised", region=(10, 20, 200, 180), bands=3)
    assert len(plan["task"]["bands"]) == 3 and plan["task"]["settings"]["method"] == "normalised"
    done = [scan.match_band(band) for band in np.arange(3)[::-1]]
    assert [(one["band"], one["bands"], one["matched_before"]) for one in done] == [(2, 3, 0), (1, 3, 0), (0, 3, 0)]
    # Bands follow each other.
    assert done[2]["rows"][1] == done[1]["rows"][0] and done[1]["rows"][1] == done[0]["rows"][0]
    with pytest.raises(epirig.OptionError, match="holds results already"):
        scan.merge()
    merged = scan.merge(out=tmp_path / "merged", figure_row=100)
    assert type(merged) is type(whole) and merged.folder == tmp_path / "merged"
    for name in whole.maps:
        one, other = whole.find_map(name), merged.find_map(name)
        assert one is not None and other is not None and np.array_equal(one, other, equal_nan=True), name
    assert {**merged.record, "seconds": 0} == {**whole.record, "seconds": 0}
    assert scan.merge(overwrite=True).record["frames_blake3"] == whole.record["frames_blake3"]
    # Frames that are one block are one band.
    assert len(scan.survey(overwrite=True)["task"]["bands"]) == 1


def test_a_merge_names_the_bands_that_are_missing(scan: epirig.Sequence) -> None:
    with pytest.raises(epirig.OptionError, match="has no plan"):
        scan.match_band(0)
    scan.survey(block_rows=48)
    for band in (0, 3):
        scan.match_band(band)
    with pytest.raises(epirig.DataError, match=r"of 4 bands .* 1 to 2 \(not there\)") as caught:
        scan.merge()
    assert caught.value.exit_code == 5 and not (scan.folder / "results").exists()
    # Other processes hand it on whole.
    again = pickle.loads(pickle.dumps(caught.value))
    assert (str(again), again.exit_code, again.kind) == (str(caught.value), 5, "data")
    with pytest.raises(epirig.OptionError, match="there is no band 4; the last is 3"):
        scan.match_band(4)
    with pytest.raises(epirig.OptionError, match="the plan of another match"):
        scan.survey(block_rows=24)


def test_a_band_that_was_interrupted_goes_on_where_it_was(scan: epirig.Sequence) -> None:
    def press(what: str, done: int, total: int) -> None:
        if list((scan.folder / "bands").glob("*.part")):
            raise KeyboardInterrupt

    scan.survey(block_rows=8, bands=1)
    with pytest.raises(epirig.Interrupted) as caught:
        scan.match_band(0, progress=press)
    assert caught.value.exit_code == 130
    done = scan.match_band(0)
    # 192 rows are 24 blocks of 8.
    assert 1 <= done["matched_before"] < 24 and done["matched_before"] + done["matched"] == 24
    assert scan.match_band(0) == {**done, "matched_before": 24, "matched": 0}


def test_options_are_those_of_the_step() -> None:
    def options(step: Callable[..., object]) -> list[str]:
        return list(inspect.signature(step).parameters)

    match = options(epirig.Sequence.match)
    assert not {"survey", "bands", "band", "merge"} & set(match)
    # What the command line refuses together is no option.
    without = [name for name in match if name not in ("out", "figure_row", "memory")]
    assert sorted(options(epirig.Sequence.survey)) == sorted([*without, "bands"])
    assert options(epirig.Sequence.match_band) == ["self", "band", "progress"]
    assert options(epirig.Sequence.merge) == ["self", "out", "overwrite", "figure_row", "progress"]
