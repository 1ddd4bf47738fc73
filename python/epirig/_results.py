"""Results in a folder: those of a match, and of a surface."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from . import _native
from ._errors import DataError
from ._maps import ANSWERED, draw

if TYPE_CHECKING:
    from matplotlib.axes import Axes


class _Folder:
    """Results of one verb, with their maps of (rows, columns)."""

    _verb: str

    def __init__(self, folder: str | os.PathLike[str], record: dict[str, Any] | None = None) -> None:
        self.folder = Path(folder).absolute()
        """Where the results are."""
        self._bytes = self._record_bytes()
        try:
            self.record: dict[str, Any] = json.loads(self._bytes) if record is None else record
            """The record, as ``--json`` prints it."""
        except ValueError as error:
            raise DataError(f"{self._path}: it is no record: {error}", 5, "data") from error

    @property
    def _path(self) -> Path:
        return self.folder / f"{self._verb}.json"

    def _record_bytes(self) -> bytes:
        try:
            return self._path.read_bytes()
        except OSError as error:
            raise DataError(f"{self.folder} has no results of {self._verb}: {error}", 5, "data") from error

    def __repr__(self) -> str:
        return f"{type(self).__name__}({str(self.folder)!r})"

    @property
    def maps(self) -> dict[str, str]:
        """The maps that these results may have: the name of each, and what it shows, with its unit."""
        names = _native.map_names(self._verb)
        return {name: f"{title} ({unit})" if unit else title for name, title, unit in names}

    def map(self, name: str) -> NDArray[np.float32]:
        """A map by its name; NaN where there is no value. It is compared with its hash in the record."""
        found = self.find_map(name)
        if found is None:
            hint = "; heights need the focal length and the positions" if "height" in name else ""
            raise DataError(f"{self.folder} has no map {name}{hint}", 5, "data")
        return found

    def find_map(self, name: str) -> NDArray[np.float32] | None:
        """The same; None if these results do not have it, such as heights without a scale."""
        if name not in self.maps:
            raise KeyError(f"there is no map {name}; there are {', '.join(self.maps)}")
        if self._record_bytes() != self._bytes:
            raise DataError(f"{self.folder} has other results than these by now; open it again", 5, "data")
        found: NDArray[np.float32] | None = _native.result_map(self.folder, name)
        return found

    def plot(self, name: str, axes: Axes | None = None) -> Axes:
        """Draws a map with its scale; needs matplotlib."""
        titles = {name: (title, unit) for name, title, unit in _native.map_names(self._verb)}
        values = self.map(name)
        return draw(values, *titles[name], axes)


class Results(_Folder):
    """Results of a match: maps of (rows, columns) over the pixels of the reference frame."""

    _verb = "match"

    @property
    def disparity(self) -> NDArray[np.float32]:
        """Disparity in px over the whole baseline; NaN without an answer."""
        return self.map("disparity")

    @property
    def sigma(self) -> NDArray[np.float32]:
        """Standard uncertainty of the disparity, in px."""
        return self.map("sigma")

    @property
    def validity(self) -> NDArray[np.uint8]:
        """Why a pixel has an answer or none: the keys of ``epirig.VALIDITY``."""
        return self.map("mask").astype(np.uint8)

    @property
    def answered(self) -> NDArray[np.bool_]:
        """Which pixels have an answer."""
        return np.asarray(self.validity == ANSWERED)

    @property
    def height_mm(self) -> NDArray[np.float32]:
        """Height in mm, where focal length and positions are known."""
        return self.map("height")

    @property
    def height_sigma_mm(self) -> NDArray[np.float32]:
        """Standard uncertainty of the height, in mm."""
        return self.map("height-sigma")

    def plot(self, name: str = "disparity", axes: Axes | None = None) -> Axes:
        """Draws a map with its scale; needs matplotlib."""
        return super().plot(name, axes)


class Surface(_Folder):
    """A surface: the depth of its hollows with its interval and budget, and the heights without the form."""

    _verb = "surface"

    @classmethod
    def of(
        cls,
        sequence: Path,
        results: str | os.PathLike[str] | None,
        out: str | os.PathLike[str] | None,
        record: dict[str, Any],
    ) -> Surface:
        """The surface that ``epirig surface`` has written."""
        matched = sequence / "results" if results is None else Path(results)
        return cls(matched / "surface" if out is None else out, record)

    @property
    def depth_mm(self) -> float | None:
        """Depth of the hollows, in mm; None if there are no two levels."""
        levels = self.record["levels"]
        return None if levels is None else float(levels["depth"]["depth_mm"])

    @property
    def interval_mm(self) -> tuple[float, float] | None:
        """The interval that holds the depth with a probability of 95 %, in mm; None if it is not known."""
        levels, depth = self.record["levels"], self.depth_mm
        if levels is None or depth is None:
            return None
        combined = levels["budget"]["combined"]
        if combined is None:
            return None
        half = float(combined["half_width_95_mm"])
        return depth - half, depth + half

    @property
    def budget(self) -> list[dict[str, Any]]:
        """The contributions to the uncertainty of the depth: name, evaluation (A or B), sigma_mm, share."""
        levels = self.record["levels"]
        return [] if levels is None else list(levels["budget"]["contributions"])

    @property
    def conclusion(self) -> str:
        """The result in a sentence."""
        return str(self.record["conclusion"]["sentence"])

    @property
    def verdict(self) -> str | None:
        """``pass``, ``fail`` or ``undecided``; None without a tolerance."""
        verdict = self.record["conclusion"]["verdict"]
        return None if verdict is None else str(verdict)

    @property
    def judgements(self) -> list[dict[str, Any]]:
        """Each value with its limits: characteristic, part, limits, value, conformance_probability, verdict."""
        conformity = self.record["conformity"]
        return [] if conformity is None else list(conformity["judgements"])

    @property
    def height_mm(self) -> NDArray[np.float32]:
        """Height in mm without the form; NaN where it is not used."""
        return self.map("height-without-form")

    @property
    def report(self) -> Path:
        """The report as a page (HTML)."""
        return self.folder / "report.html"

    def plot(self, name: str = "height-without-form", axes: Axes | None = None) -> Axes:
        """Draws a map with its scale; needs matplotlib."""
        return super().plot(name, axes)
