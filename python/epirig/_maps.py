"""Maps of a match, and the match of frames in memory."""

from __future__ import annotations

import json
from dataclasses import dataclass
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _native
from ._call import Progress
from ._errors import DataError

if TYPE_CHECKING:
    from matplotlib.axes import Axes

VALIDITY: MappingProxyType[int, str] = MappingProxyType(dict(_native.validity_classes()))
"""What the values of ``validity`` mean; 255 is an answer."""

ANSWERED = next(value for value, name in VALIDITY.items() if name == "answered")


@dataclass(frozen=True, eq=False, repr=False)
class Maps:
    """Maps of (rows, columns) over the pixels of the reference frame. The arrays own their memory."""

    disparity: NDArray[np.float32]
    """Disparity in px over the whole baseline, signed; NaN without an answer. A point at column x of the
    reference frame r lies at x + disparity * (tau[t] - tau[r]) in frame t."""
    sigma: NDArray[np.float32]
    """Standard uncertainty of the disparity, in px; NaN without an answer."""
    cost: NDArray[np.float32]
    """Cost of the chosen candidate: DN^2 for the variance, 1 - correlation otherwise."""
    confidence: NDArray[np.float32]
    """How much better it is than the best candidate elsewhere, 0 to 1; NaN without a rival."""
    validity: NDArray[np.uint8]
    """Why a pixel has an answer or none: the keys of ``epirig.VALIDITY``."""
    settings: dict[str, Any]
    """The options, as ``match.json`` has them."""
    reference: int
    """Index of the reference frame, from 0."""
    range_px: tuple[float, float]
    """Smallest and largest disparity searched, in px."""
    range_found: bool
    """Whether the range was found from the data."""
    ordering_constraint: str
    """Whether the ordering constraint was applied: ``on`` or ``off``."""

    @property
    def answered(self) -> NDArray[np.bool_]:
        """Which pixels have an answer."""
        return np.asarray(self.validity == ANSWERED)

    def shares(self) -> dict[str, float]:
        """Share of the pixels of each validity, by its name; they add up to 1."""
        return {name: float(np.mean(self.validity == value)) for value, name in VALIDITY.items()}

    def __repr__(self) -> str:
        rows, columns = self.disparity.shape
        answered, (low, high) = self.answered.mean(), self.range_px
        return f"<Maps of {rows} rows x {columns} columns, {answered:.1%} answered, {low:g} .. {high:g} px searched>"

    def plot(self, name: str = "disparity", axes: Axes | None = None) -> Axes:
        """Draws a map with its scale: disparity, sigma, cost or confidence; needs matplotlib."""
        titles = {row[0]: row[1:] for row in _native.map_names("match")}
        return draw(getattr(self, name), *titles[name], axes)


def _plain(name: str, given: ArrayLike, dimensions: int, kinds: str) -> NDArray[Any]:
    """The argument as an array of numbers with so many dimensions."""
    array = np.asarray(given)
    if np.ma.isMaskedArray(given):
        why = "a masked array, whose mask would be lost"
    elif array.ndim != dimensions:
        why = f"of {array.ndim} dimension(s)"
    elif array.dtype.kind not in kinds:
        why = f"of {array.dtype}"
    elif array.dtype.kind == "f" and np.isnan(array).any():
        why = "NaN in places"
    else:
        return array
    what = {1: "a number for each frame", 2: "(rows, columns) of bool"}[dimensions]
    raise DataError(f"{name} is {why}; give {what}", 5, "data")


def draw(values: NDArray[np.float32], title: str, unit: str, axes: Axes | None) -> Axes:
    """Draws a map with its scale. Its colours span all but the outermost hundredths of the values."""
    import matplotlib.pyplot as plt

    axes = plt.subplots()[1] if axes is None else axes
    known = values[np.isfinite(values)]
    low, high = np.percentile(known, [1, 99]) if known.size else (0.0, 1.0)
    picture = axes.imshow(values, vmin=low, vmax=high, interpolation="nearest")
    figure = axes.get_figure()
    if figure is not None:
        figure.colorbar(picture, ax=axes, label=f"{title} ({unit})" if unit else title)
    axes.set_title(title)
    axes.set_xlabel("x (px)")
    axes.set_ylabel("y (px)")
    return axes


def matched(
    frames: ArrayLike,
    options: list[str],
    tau: ArrayLike | None,
    mask: ArrayLike | None,
    progress: Progress | None,
) -> Maps:
    """The match itself, with the options as words of the command line."""
    places = None if tau is None else _plain("tau", tau, 1, "iuf").astype(float).tolist()
    inside = None if mask is None else (_plain("mask", mask, 2, "biuf") != 0).view(np.uint8)
    disparity, sigma, cost, confidence, validity, text = _native.match_array(
        frames, options, places, inside, progress
    )
    facts = json.loads(text)
    return Maps(
        disparity,
        sigma,
        cost,
        confidence,
        validity,
        facts["settings"],
        facts["reference"],
        (facts["minimum_px"], facts["maximum_px"]),
        facts["range_found"],
        facts["ordering_constraint"],
    )
