"""Sequences and results as layers of napari: ``napari --plugin epirig FOLDER``."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from ._results import Results, Surface
from ._sequence import Sequence

Layer = tuple[Any, dict[str, Any], str]


def reader(path: str | os.PathLike[str] | list[str]) -> Callable[[Any], list[Layer]] | None:
    """What reads a path; None if it is neither a sequence nor results."""
    if isinstance(path, list) or not Path(path).is_dir():
        return None
    here = Path(path)
    records = [here / name for name in ("sequence.json", "match.json", "surface.json")]
    return layers if any(record.is_file() for record in records) else None


def layers(path: str | os.PathLike[str]) -> list[Layer]:
    """Frames of a sequence, with the maps of its results if it was matched; or the maps of results. Heights and
    disparities are visible, the rest is there to be switched on."""
    here = Path(path)
    if not (here / "sequence.json").is_file():
        return _maps(Results(here) if (here / "match.json").is_file() else Surface(here))
    sequence = Sequence(here)
    frames: Layer = (sequence.frames(), {"name": here.name, "metadata": {"epirig": sequence.record}}, "image")
    is_matched = (here / "results" / "match.json").is_file()
    return [frames, *(_maps(sequence.results()) if is_matched else [])]


def _maps(results: Results | Surface) -> list[Layer]:
    shown = {"disparity", "height", "height-without-form"}
    found: list[Layer] = []
    for name, title in results.maps.items():
        values = results.find_map(name)
        if values is None:
            continue
        facts = {"name": title, "visible": name in shown, "metadata": {"epirig": results.record}}
        if name in ("mask", "used"):
            found.append((values.astype(np.uint8), facts, "labels"))
        else:
            finite = values[np.isfinite(values)]
            limits = {"contrast_limits": [float(end) for end in np.percentile(finite, (1, 99))]} if finite.size else {}
            found.append((values, {**facts, "colormap": "viridis", **limits}, "image"))
    return found
