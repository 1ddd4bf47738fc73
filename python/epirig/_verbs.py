"""The verbs of the command line, and the match of frames in memory. Written by generate.py."""

from __future__ import annotations

from collections.abc import Sequence as Several
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, Union

from numpy.typing import ArrayLike

from ._call import REQUIRED, Progress, call, words
from ._maps import Maps, matched
from ._results import Results, Surface

if TYPE_CHECKING:
    from ._sequence import Sequence

Place = Union[str, "PathLike[str]"]


def match_array(
    frames: ArrayLike,
    *,
    tau: ArrayLike | None = None,
    mask: ArrayLike | None = None,
    quick: bool = False,
    method: Literal["variance", "normalised", "ncc-first", "ncc-mean"] = "variance",
    range: Several[float] | str | None = None,
    reference: Literal["first", "middle", "last"] | int = "middle",
    disparity_step: float = 0.25,
    window: int | None = None,
    search: Literal["factorised", "exhaustive"] = "factorised",
    semi_global: bool = False,
    interpolation: Literal["linear", "cubic", "b-spline"] = "b-spline",
    ordering_constraint: Literal["on", "off", "auto"] = "auto",
    occlusion: Literal["none", "one-side", "auto"] = "auto",
    min_visible: float = 0.5,
    max_sigma: float = 3,
    min_confidence: float = 0.03,
    wanted_sigma: float = 0.003,
    no_fit: bool = False,
    block_rows: int | None = None,
    progress: Progress | None = None,
) -> Maps:
    """Disparity of every pixel of the reference frame, with its standard uncertainty.

    The disparity is that over the whole baseline, from the first to the last of these frames, in px: positive
    if a point moves to the right. A point moves along its row from frame to frame; frames whose points also move across rows are to be
    rectified before. The options are those of ``epirig match``, with its defaults.

    >>> import epirig
    >>> import numpy as np
    >>> t, y, x = np.ogrid[0:15, 0:48, 0:96]
    >>> place = x - 6.0 * t / 14  # moves by 6 px along the rows
    >>> frames = 120 + 60 * np.sin(0.9 * place + y) + 50 * np.sin(0.37 * place - 2 * y)
    >>> maps = epirig.match_array(frames.astype(np.uint8))
    >>> print(f"{np.nanmedian(maps.disparity):.2f} px")
    6.00 px

    Parameters
    ----------
    frames
        Array of (frames, rows, columns), or a sequence of arrays of (rows, columns), of uint8, uint16 or
        floating point. Any layout in memory and order of bytes will do; memory-mapped files are read once
        (twice if they are floating point). The frames are copied before the match begins. Floating point
        may have any unit: the largest sample becomes 65535 DN, and zero (or the smallest, if that is
        negative) 0 DN. So subtract a large offset, and clip single samples that outshine all others.
    tau
        Position of each frame on the baseline, increasing, in any unit. Without it: equal steps.
    mask
        Array of (rows, columns); only pixels that are true are matched. Without it: all of them.
    quick
        First look: takes some 60 % of the time. Uses half of the frames if there are a hundred or
        more, looks for edges in small discs only, and searches occluding objects at half the
        resolution, too. Sigma includes what that costs, except for relief finer than the discs;
        objects narrower than some 20 px may be missed.
    method
        Cost function: how the samples along a line are compared.
        - "variance": Variance of the intensities along the line; needs equal illumination.
        - "normalised": Variance of locally normalised frames: for light that varies between frames
          and over the image.
        - "ncc-first": Correlation of windows with the reference frame's window.
        - "ncc-mean": Correlation of windows with their mean.
    range
        Range of disparities, in px over the whole baseline, such as 420..434 or -60..0. Without it:
        found from the data.
    reference
        The reference frame, whose pixels get a disparity: first, middle, last or an index from 0.
        Most points of the middle frame are seen by most frames; the paper takes the first.
    disparity_step
        Step between disparity candidates, in px.
    window
        Side of the cost's window, odd, in px. Without it: 3 for variance and normalised, 7 for
        correlation.
    search
        How candidates are searched: by sums over groups of frames, or by every sample as in the
        paper (always so for correlation).
        - "factorised": Sums over groups of neighbouring frames serve many candidates: many times
          faster.
        - "exhaustive": The samples of all frames for each candidate, as in the paper.
    semi_global
        Aggregate costs across rows (semi-global matching): for weak texture on surfaces that
        continue from row to row. The search takes about twice as long.
    interpolation
        Interpolation of frames between pixels in the exhaustive search.
        - "linear": Straight line between the two neighbours.
        - "cubic": Cubic convolution over four neighbours (Keys 1981, a = -1/2).
        - "b-spline": Cubic B-spline through all pixels of the row (Unser 1999), the most accurate.
    ordering_constraint
        Whether points keep their order from the first frame to the last.
        - "on": Points keep their order: the paper's strictly increasing mapping.
        - "off": Each pixel by itself: for objects that occlude others.
        - "auto": On, unless the sampled rows show depth edges that no strictly increasing mapping
          allows.
    occlusion
        Whether points may be occluded in part of the sequence.
        - "none": Nothing is occluded: all frames that contain the candidate count.
        - "one-side": A point may be occluded before or after the reference frame.
        - "auto": One side without the ordering constraint, none with it.
    min_visible
        Share of the frames that must see a point, above 0 and at most 1.
    max_sigma
        Reject pixels whose sigma is larger, in px.
    min_confidence
        Reject pixels whose confidence is lower, 0 to 1 (only without the ordering constraint).
    wanted_sigma
        Let the discs of the sub-pixel fit grow where they leave a larger sigma than this, in px: up
        to 115 px. ``float("inf")`` keeps all at one small size.
    no_fit
        Interpolate three costs by a parabola instead of the fit over all frames (always so for
        correlation).
    block_rows
        Match this many rows in one go, at most. Without it: as many as take 768 MiB, and 256 at
        least.
    progress
        Called with what is done, how many parts of it are done, and of how many.

    Raises
    ------
    epirig.DataError
        If the frames make no stack, or show no disparity.
    epirig.OptionError
        If an option cannot be used.
    epirig.Interrupted
        After Ctrl-C, a subclass of KeyboardInterrupt.
    """
    options = words(
        ("--quick", quick, False),
        ("--method", method, "variance"),
        ("--range", range, None),
        ("--reference", reference, "middle"),
        ("--disparity-step", disparity_step, 0.25),
        ("--window", window, None),
        ("--search", search, "factorised"),
        ("--semi-global", semi_global, False),
        ("--interpolation", interpolation, "b-spline"),
        ("--ordering-constraint", ordering_constraint, "auto"),
        ("--occlusion", occlusion, "auto"),
        ("--min-visible", min_visible, 0.5),
        ("--max-sigma", max_sigma, 3),
        ("--min-confidence", min_confidence, 0.03),
        ("--wanted-sigma", wanted_sigma, 0.003),
        ("--no-fit", no_fit, False),
        ("--block-rows", block_rows, None),
    )
    return matched(frames, options, tau, mask, progress)


def import_images(
    images: Place | Several[Place],
    *,
    out: Place,
    every: int = 1,
    sort: Literal["name", "time", "given", "motion"] = "name",
    frames: str | float | None = None,
    exclude: Several[Several[float] | str] = (),
    rotate: Literal["0", "90", "180", "270"] | int = "0",
    positions: Place | None = None,
    step_mm: float | None = None,
    bit_depth: int | None = None,
    dark: Place | None = None,
    flat: Place | None = None,
    board: Place | None = None,
    rig: Place | None = None,
    set: Several[str] = (),
    focal_length_px: float | None = None,
    principal_point_px: Several[float] | str | None = None,
    link: bool = False,
    progress: Progress | None = None,
) -> Sequence:
    """Import images, a video or a Zarr array as a sequence.

    The same as ``epirig import``.

    Parameters
    ----------
    images
        Folder, images, a pattern in quotes, a video, or a Zarr array. Images are PNG, TIFF, JPEG,
        BMP, PGM or PPM, grey or colour, 8 or 16 bit.
    out
        Folder of the new sequence.
    every
        Of a video or an array, take every N-th frame only, from the first on; frames and step_mm
        count those.
    sort
        What the images are sorted by.
        - "name": File names, as people count: frame_9 before frame_10.
        - "time": Times at which they were taken by EXIF; unless all tell it, when the files were
          last changed.
        - "given": As given; those of one folder or pattern by file names.
        - "motion": What they show: each is like the next. Numbers of other options are then those
          by name.
    frames
        First and last image to use, counted from 0 in the order of sort, both included.
    exclude
        Images to leave out: numbers as for frames, or ranges of them. Their places stay empty with
        step_mm.
    rotate
        Degrees by which all images are turned clockwise, for ``epirig match`` without a
        calibration.
        - "0": Not turned.
        - "90": What was at the top is on the right.
        - "180": What was at the top is at the bottom.
        - "270": What was at the top is on the left.
    positions
        Table of positions in mm, one for each image used: one number per line, or a column
        position_mm.
    step_mm
        Distance between neighbouring frames, in mm.
    bit_depth
        Bit depth of the camera, if it is less than that of the files.
    dark
        Folder of dark images, taken without light.
    flat
        Folder of images of a uniform target, for the flat field.
    board
        Folder of images of a hand-held chess-board in different poses, to calibrate the lens.
    rig
        Profile of the rig that took the images, of which [optics], [target] and [board] are
        recorded: a file, sim or real.
    set
        Change a key of the profile; may be repeated: set target.square="7.5 mm".
    focal_length_px
        Focal length, in px, in place of the profile's. With it and positions, heights are in mm.
        Without it: as EXIF tells, if all images agree.
    principal_point_px
        Principal point, in px: column,row. Without it: centre of the image.
    link
        Make hard links to grey PNG files instead of copies; both must be on one file system.
    progress
        Called with what is done, how many parts of it are done, and of how many.
    """
    from ._sequence import Sequence

    call(
        "import",
        words(
            (None, images, ()),
            ("--out", out, REQUIRED),
            ("--every", every, 1),
            ("--sort", sort, "name"),
            ("--frames", frames, None),
            ("--exclude", exclude, ()),
            ("--rotate", rotate, "0"),
            ("--positions", positions, None),
            ("--step-mm", step_mm, None),
            ("--bit-depth", bit_depth, None),
            ("--dark", dark, None),
            ("--flat", flat, None),
            ("--board", board, None),
            ("--rig", rig, None),
            ("--set", set, ()),
            ("--focal-length-px", focal_length_px, None),
            ("--principal-point-px", principal_point_px, None),
            ("--link", link, False),
        ),
        progress,
    )
    return Sequence(out)


def capture(
    *,
    out: Place,
    anyway: bool = False,
    rig: Place | None = None,
    set: Several[str] = (),
    step_mm: str | float | None = None,
    frames: str | float | None = None,
    start_mm: str | float | None = None,
    settle_ms: str | float | None = None,
    average: str | float | None = None,
    wait_s: str | float | None = None,
    focal_length_px: str | float | None = None,
    port: str | float | None = None,
    driver: Literal["native", "grbl", "zaber", "sim"] | None = None,
    approach_mm: str | float | None = None,
    tolerance_mm: str | float | None = None,
    velocity_mm_s: str | float | None = None,
    acceleration_mm_s2: str | float | None = None,
    axis: Literal["x", "y", "z"] | None = None,
    device: str | float | None = None,
    microstep_um: str | float | None = None,
    travel_mm: str | float | None = None,
    position_noise_um: str | float | None = None,
    backlash_um: str | float | None = None,
    transcript: Place | None = None,
    camera: str | float | None = None,
    format: str | float | None = None,
    size: str | float | None = None,
    rate_hz: str | float | None = None,
    exposure_us: str | float | None = None,
    bayer: Literal["green", "binned"] | None = None,
    patience_s: str | float | None = None,
    control: Several[str] = (),
    progress: Progress | None = None,
) -> Sequence:
    """Move the stage in steps and take a frame at each stop.

    The same as ``epirig capture``.

    Parameters
    ----------
    out
        Folder of the new sequence.
    anyway
        Begin even if the disk may be too small.
    rig
        The rig's profile: a file; sim for the simulated rig, real for one with the faults of real
        ones. Without it: ./rig.toml, else ~/.config/epirig/rig.toml, else none.
    set
        Change a key of the profile; may be repeated: set plan.step="2 mm".
    step_mm
        Distance between stops.
    frames
        Number of frames: one more than steps.
    start_mm
        Position of the first frame, from home. Without it: 0.
    settle_ms
        Time for which the stage vibrates after a move. Without it: 200.
    average
        Number of frames averaged at each stop, into one of 16 bit. Without it: 1.
    wait_s
        Longest wait for a device that has disconnected. Without it: 300.
    focal_length_px
        Focal length of the lens; a value in mm needs sensor_width.
    port
        The port: a path, usb:SERIAL, usb:VID:PID, or sim for a simulated device; by default the
        only USB serial port [env: EPIRIG_PORT].
    driver
        The protocol of the stage: epirig's own firmware, GRBL 1.1, Zaber ASCII; sim is a stage in
        memory [env: EPIRIG_DRIVER]. Without it: native.
    approach_mm
        Unidirectional approach against backlash: distance below each position from which it is
        approached. Without it: 0.
    tolerance_mm
        Allowed error of the reported position, beyond half a step. Without it: 0.
    velocity_mm_s
        Velocity of a long move (native, sim).
    acceleration_mm_s2
        Acceleration and deceleration (native, sim).
    axis
        The axis of the stage (grbl). Without it: x.
    device
        Number of the device in its chain (zaber). Without it: 1.
    microstep_um
        Length of a microstep, from the data sheet; required (zaber).
    travel_mm
        Length of the travel; positions go from 0 to this (sim). Without it: 200.
    position_noise_um
        Standard deviation of the position at rest (sim). Without it: 0.
    backlash_um
        Backlash: play between screw and nut (sim). Without it: 0.
    transcript
        Record every byte in FILE (``epirig decode`` reads it); one that exists is refused.
    camera
        The camera; by default the only one. sim shows the simulated object, replay:FOLDER shows the
        frames of a sequence [env: EPIRIG_CAMERA].
    format
        Pixel format; by default the deepest uncompressed grey.
    size
        Columns and rows; by default the largest size.
    rate_hz
        Frames per second; by default not changed.
    exposure_us
        Exposure time; under lamps on mains, whole half periods of the mains (10 ms at 50 Hz).
    bayer
        Use of a colour mosaic: the sum of the two green pixels of each cell, or of all four.
    patience_s
        Longest wait for a good frame, and for a steady picture. Without it: 10.
    control
        A control and its value, as often as needed: control gain=10.
    progress
        Called with what is done, how many parts of it are done, and of how many.
    """
    from ._sequence import Sequence

    call(
        "capture",
        words(
            ("--out", out, REQUIRED),
            ("--anyway", anyway, False),
            ("--rig", rig, None),
            ("--set", set, ()),
            ("--step-mm", step_mm, None),
            ("--frames", frames, None),
            ("--start-mm", start_mm, None),
            ("--settle-ms", settle_ms, None),
            ("--average", average, None),
            ("--wait-s", wait_s, None),
            ("--focal-length-px", focal_length_px, None),
            ("--port", port, None),
            ("--driver", driver, None),
            ("--approach-mm", approach_mm, None),
            ("--tolerance-mm", tolerance_mm, None),
            ("--velocity-mm-s", velocity_mm_s, None),
            ("--acceleration-mm-s2", acceleration_mm_s2, None),
            ("--axis", axis, None),
            ("--device", device, None),
            ("--microstep-um", microstep_um, None),
            ("--travel-mm", travel_mm, None),
            ("--position-noise-um", position_noise_um, None),
            ("--backlash-um", backlash_um, None),
            ("--transcript", transcript, None),
            ("--camera", camera, None),
            ("--format", format, None),
            ("--size", size, None),
            ("--rate-hz", rate_hz, None),
            ("--exposure-us", exposure_us, None),
            ("--bayer", bayer, None),
            ("--patience-s", patience_s, None),
            ("--control", control, ()),
        ),
        progress,
    )
    return Sequence(out)


def resume(
    sequence: Place,
    *,
    port: str | float | None = None,
    camera: str | float | None = None,
    set: Several[str] = (),
    measure: bool = False,
    tolerance: str | float | None = None,
    decision_rule: Literal["guarded-risk", "guarded-coverage", "simple"] | None = None,
    risk_percent: str | float | None = None,
    quick: bool = False,
    method: Literal["variance", "normalised", "ncc-first", "ncc-mean"] = "variance",
    range: Several[float] | str | None = None,
    reference: Literal["first", "middle", "last"] | int = "middle",
    disparity_step: float = 0.25,
    window: int | None = None,
    search: Literal["factorised", "exhaustive"] = "factorised",
    semi_global: bool = False,
    interpolation: Literal["linear", "cubic", "b-spline"] = "b-spline",
    ordering_constraint: Literal["on", "off", "auto"] = "auto",
    occlusion: Literal["none", "one-side", "auto"] = "auto",
    min_visible: float = 0.5,
    max_sigma: float = 3,
    min_confidence: float = 0.03,
    wanted_sigma: float = 0.003,
    no_fit: bool = False,
    block_rows: int | None = None,
    progress: Progress | None = None,
) -> Sequence:
    """Continue an interrupted scan.

    The same as ``epirig resume``.

    Parameters
    ----------
    sequence
        Folder of the sequence.
    port
        The stage's port, if it has changed: a path, usb:SERIAL or usb:VID:PID.
    camera
        The camera's name, if it has changed: a path, a name in /dev/v4l/by-id, usb:SERIAL.
    set
        Change a limit of the scan, or the number of dark, flat or board frames: set
        limits.shift="0.2 px".
    measure
        Calibrate, match and measure the surface then, as ``epirig run`` does.
    tolerance
        Limits of what is measured, which the verdict is about.
    decision_rule
        How the verdict is reached: guarded-risk (ISO 14253-1, proven with at most the risk),
        guarded-coverage (beyond a guard band of the expanded uncertainty), or simple (the value
        alone). Without it: guarded-risk.
    risk_percent
        Largest probability of a wrong verdict, for guarded-risk. Without it: 5.
    quick
        First look: takes some 60 % of the time. Uses half of the frames if there are a hundred or
        more, looks for edges in small discs only, and searches occluding objects at half the
        resolution, too. Sigma includes what that costs, except for relief finer than the discs;
        objects narrower than some 20 px may be missed.
    method
        Cost function: how the samples along a line are compared.
        - "variance": Variance of the intensities along the line; needs equal illumination.
        - "normalised": Variance of locally normalised frames: for light that varies between frames
          and over the image.
        - "ncc-first": Correlation of windows with the reference frame's window.
        - "ncc-mean": Correlation of windows with their mean.
    range
        Range of disparities, in px over the whole baseline, such as 420..434 or -60..0. Without it:
        found from the data.
    reference
        The reference frame, whose pixels get a disparity: first, middle, last or an index from 0.
        Most points of the middle frame are seen by most frames; the paper takes the first.
    disparity_step
        Step between disparity candidates, in px.
    window
        Side of the cost's window, odd, in px. Without it: 3 for variance and normalised, 7 for
        correlation.
    search
        How candidates are searched: by sums over groups of frames, or by every sample as in the
        paper (always so for correlation).
        - "factorised": Sums over groups of neighbouring frames serve many candidates: many times
          faster.
        - "exhaustive": The samples of all frames for each candidate, as in the paper.
    semi_global
        Aggregate costs across rows (semi-global matching): for weak texture on surfaces that
        continue from row to row. The search takes about twice as long.
    interpolation
        Interpolation of frames between pixels in the exhaustive search.
        - "linear": Straight line between the two neighbours.
        - "cubic": Cubic convolution over four neighbours (Keys 1981, a = -1/2).
        - "b-spline": Cubic B-spline through all pixels of the row (Unser 1999), the most accurate.
    ordering_constraint
        Whether points keep their order from the first frame to the last.
        - "on": Points keep their order: the paper's strictly increasing mapping.
        - "off": Each pixel by itself: for objects that occlude others.
        - "auto": On, unless the sampled rows show depth edges that no strictly increasing mapping
          allows.
    occlusion
        Whether points may be occluded in part of the sequence.
        - "none": Nothing is occluded: all frames that contain the candidate count.
        - "one-side": A point may be occluded before or after the reference frame.
        - "auto": One side without the ordering constraint, none with it.
    min_visible
        Share of the frames that must see a point, above 0 and at most 1.
    max_sigma
        Reject pixels whose sigma is larger, in px.
    min_confidence
        Reject pixels whose confidence is lower, 0 to 1 (only without the ordering constraint).
    wanted_sigma
        Let the discs of the sub-pixel fit grow where they leave a larger sigma than this, in px: up
        to 115 px. ``float("inf")`` keeps all at one small size.
    no_fit
        Interpolate three costs by a parabola instead of the fit over all frames (always so for
        correlation).
    block_rows
        Match this many rows in one go, at most. Without it: as many as take 768 MiB, and 256 at
        least.
    progress
        Called with what is done, how many parts of it are done, and of how many.
    """
    from ._sequence import Sequence

    call(
        "resume",
        words(
            (None, sequence, REQUIRED),
            ("--port", port, None),
            ("--camera", camera, None),
            ("--set", set, ()),
            ("--measure", measure, False),
            ("--tolerance", tolerance, None),
            ("--decision-rule", decision_rule, None),
            ("--risk-percent", risk_percent, None),
            ("--quick", quick, False),
            ("--method", method, "variance"),
            ("--range", range, None),
            ("--reference", reference, "middle"),
            ("--disparity-step", disparity_step, 0.25),
            ("--window", window, None),
            ("--search", search, "factorised"),
            ("--semi-global", semi_global, False),
            ("--interpolation", interpolation, "b-spline"),
            ("--ordering-constraint", ordering_constraint, "auto"),
            ("--occlusion", occlusion, "auto"),
            ("--min-visible", min_visible, 0.5),
            ("--max-sigma", max_sigma, 3),
            ("--min-confidence", min_confidence, 0.03),
            ("--wanted-sigma", wanted_sigma, 0.003),
            ("--no-fit", no_fit, False),
            ("--block-rows", block_rows, None),
        ),
        progress,
    )
    return Sequence(sequence)


def demo(
    *,
    out: Place,
    scene: Literal["tile", "cube-edge"] = "tile",
    size: int | None = None,
    frames: int | None = None,
    noise: float = 0,
    progress: Progress | None = None,
) -> Sequence:
    """Measure a simulated object from end to end, no hardware needed.

    The same as ``epirig demo``.

    Parameters
    ----------
    out
        Folder of the new sequence and its results.
    scene
        The simulated object.
        - "tile": A 15 cm tile with hollows 0.2 mm deep, 1024 px, 101 frames.
        - "cube-edge": The edge of a cube, the paper's synthetic experiment, 512 px, 100 frames.
    size
        Width and height of the frames, in px. Without it: 1024 for the tile, 512 for the cube's
        edge.
    frames
        Number of frames. Without it: 101 for the tile, 100 for the cube's edge.
    noise
        Read noise of the simulated sensor, in grey levels of 255.
    progress
        Called with what is done, how many parts of it are done, and of how many.
    """
    from ._sequence import Sequence

    call(
        "demo",
        words(
            ("--out", out, REQUIRED),
            ("--scene", scene, "tile"),
            ("--size", size, None),
            ("--frames", frames, None),
            ("--noise", noise, 0),
        ),
        progress,
    )
    return Sequence(out)


def measure(
    photos: Place | Several[Place],
    *,
    out: Place,
    overwrite: bool = False,
    every: int = 1,
    sort: Literal["name", "time", "given", "motion"] = "name",
    frames: str | float | None = None,
    exclude: Several[Several[float] | str] = (),
    rotate: Literal["0", "90", "180", "270"] | int = "0",
    positions: Place | None = None,
    step_mm: float | None = None,
    bit_depth: int | None = None,
    dark: Place | None = None,
    flat: Place | None = None,
    board: Place | None = None,
    rig: Place | None = None,
    set: Several[str] = (),
    focal_length_px: float | None = None,
    principal_point_px: Several[float] | str | None = None,
    link: bool = False,
    tolerance: str | float | None = None,
    decision_rule: Literal["guarded-risk", "guarded-coverage", "simple"] | None = None,
    risk_percent: str | float | None = None,
    quick: bool = False,
    method: Literal["variance", "normalised", "ncc-first", "ncc-mean"] = "variance",
    range: Several[float] | str | None = None,
    reference: Literal["first", "middle", "last"] | int = "middle",
    disparity_step: float = 0.25,
    window: int | None = None,
    search: Literal["factorised", "exhaustive"] = "factorised",
    semi_global: bool = False,
    interpolation: Literal["linear", "cubic", "b-spline"] = "b-spline",
    ordering_constraint: Literal["on", "off", "auto"] = "auto",
    occlusion: Literal["none", "one-side", "auto"] = "auto",
    min_visible: float = 0.5,
    max_sigma: float = 3,
    min_confidence: float = 0.03,
    wanted_sigma: float = 0.003,
    no_fit: bool = False,
    block_rows: int | None = None,
    anyway: bool = False,
    progress: Progress | None = None,
) -> Sequence:
    """Measure photographs: find their motion, match, write the results.

    The same as ``epirig measure``.

    Parameters
    ----------
    photos
        Folder, images, a pattern in quotes, or a video, as for ``epirig import``; or a sequence,
        which is measured in its place.
    out
        Folder of the new sequence and its results; not for a sequence that exists.
    overwrite
        Replace calibration and results of a sequence that exists.
    every
        Of a video or an array, take every N-th frame only, from the first on; frames and step_mm
        count those.
    sort
        What the images are sorted by.
        - "name": File names, as people count: frame_9 before frame_10.
        - "time": Times at which they were taken by EXIF; unless all tell it, when the files were
          last changed.
        - "given": As given; those of one folder or pattern by file names.
        - "motion": What they show: each is like the next. Numbers of other options are then those
          by name.
    frames
        First and last image to use, counted from 0 in the order of sort, both included.
    exclude
        Images to leave out: numbers as for frames, or ranges of them. Their places stay empty with
        step_mm.
    rotate
        Degrees by which all images are turned clockwise, for ``epirig match`` without a
        calibration.
        - "0": Not turned.
        - "90": What was at the top is on the right.
        - "180": What was at the top is at the bottom.
        - "270": What was at the top is on the left.
    positions
        Table of positions in mm, one for each image used: one number per line, or a column
        position_mm.
    step_mm
        Distance between neighbouring frames, in mm.
    bit_depth
        Bit depth of the camera, if it is less than that of the files.
    dark
        Folder of dark images, taken without light.
    flat
        Folder of images of a uniform target, for the flat field.
    board
        Folder of images of a hand-held chess-board in different poses, to calibrate the lens.
    rig
        Profile of the rig that took the images, of which [optics], [target] and [board] are
        recorded: a file, sim or real.
    set
        Change a key of the profile; may be repeated: set target.square="7.5 mm".
    focal_length_px
        Focal length, in px, in place of the profile's. With it and positions, heights are in mm.
        Without it: as EXIF tells, if all images agree.
    principal_point_px
        Principal point, in px: column,row. Without it: centre of the image.
    link
        Make hard links to grey PNG files instead of copies; both must be on one file system.
    tolerance
        Limits of what is measured, which the verdict is about.
    decision_rule
        How the verdict is reached: guarded-risk (ISO 14253-1, proven with at most the risk),
        guarded-coverage (beyond a guard band of the expanded uncertainty), or simple (the value
        alone). Without it: guarded-risk.
    risk_percent
        Largest probability of a wrong verdict, for guarded-risk. Without it: 5.
    quick
        First look: takes some 60 % of the time. Uses half of the frames if there are a hundred or
        more, looks for edges in small discs only, and searches occluding objects at half the
        resolution, too. Sigma includes what that costs, except for relief finer than the discs;
        objects narrower than some 20 px may be missed.
    method
        Cost function: how the samples along a line are compared.
        - "variance": Variance of the intensities along the line; needs equal illumination.
        - "normalised": Variance of locally normalised frames: for light that varies between frames
          and over the image.
        - "ncc-first": Correlation of windows with the reference frame's window.
        - "ncc-mean": Correlation of windows with their mean.
    range
        Range of disparities, in px over the whole baseline, such as 420..434 or -60..0. Without it:
        found from the data.
    reference
        The reference frame, whose pixels get a disparity: first, middle, last or an index from 0.
        Most points of the middle frame are seen by most frames; the paper takes the first.
    disparity_step
        Step between disparity candidates, in px.
    window
        Side of the cost's window, odd, in px. Without it: 3 for variance and normalised, 7 for
        correlation.
    search
        How candidates are searched: by sums over groups of frames, or by every sample as in the
        paper (always so for correlation).
        - "factorised": Sums over groups of neighbouring frames serve many candidates: many times
          faster.
        - "exhaustive": The samples of all frames for each candidate, as in the paper.
    semi_global
        Aggregate costs across rows (semi-global matching): for weak texture on surfaces that
        continue from row to row. The search takes about twice as long.
    interpolation
        Interpolation of frames between pixels in the exhaustive search.
        - "linear": Straight line between the two neighbours.
        - "cubic": Cubic convolution over four neighbours (Keys 1981, a = -1/2).
        - "b-spline": Cubic B-spline through all pixels of the row (Unser 1999), the most accurate.
    ordering_constraint
        Whether points keep their order from the first frame to the last.
        - "on": Points keep their order: the paper's strictly increasing mapping.
        - "off": Each pixel by itself: for objects that occlude others.
        - "auto": On, unless the sampled rows show depth edges that no strictly increasing mapping
          allows.
    occlusion
        Whether points may be occluded in part of the sequence.
        - "none": Nothing is occluded: all frames that contain the candidate count.
        - "one-side": A point may be occluded before or after the reference frame.
        - "auto": One side without the ordering constraint, none with it.
    min_visible
        Share of the frames that must see a point, above 0 and at most 1.
    max_sigma
        Reject pixels whose sigma is larger, in px.
    min_confidence
        Reject pixels whose confidence is lower, 0 to 1 (only without the ordering constraint).
    wanted_sigma
        Let the discs of the sub-pixel fit grow where they leave a larger sigma than this, in px: up
        to 115 px. ``float("inf")`` keeps all at one small size.
    no_fit
        Interpolate three costs by a parabola instead of the fit over all frames (always so for
        correlation).
    block_rows
        Match this many rows in one go, at most. Without it: as many as take 768 MiB, and 256 at
        least.
    anyway
        Continue although the scan is not closed and the positions of its frames are wrong.
    progress
        Called with what is done, how many parts of it are done, and of how many.
    """
    from ._sequence import Sequence

    call(
        "measure",
        words(
            (None, photos, ()),
            ("--out", out, REQUIRED),
            ("--overwrite", overwrite, False),
            ("--every", every, 1),
            ("--sort", sort, "name"),
            ("--frames", frames, None),
            ("--exclude", exclude, ()),
            ("--rotate", rotate, "0"),
            ("--positions", positions, None),
            ("--step-mm", step_mm, None),
            ("--bit-depth", bit_depth, None),
            ("--dark", dark, None),
            ("--flat", flat, None),
            ("--board", board, None),
            ("--rig", rig, None),
            ("--set", set, ()),
            ("--focal-length-px", focal_length_px, None),
            ("--principal-point-px", principal_point_px, None),
            ("--link", link, False),
            ("--tolerance", tolerance, None),
            ("--decision-rule", decision_rule, None),
            ("--risk-percent", risk_percent, None),
            ("--quick", quick, False),
            ("--method", method, "variance"),
            ("--range", range, None),
            ("--reference", reference, "middle"),
            ("--disparity-step", disparity_step, 0.25),
            ("--window", window, None),
            ("--search", search, "factorised"),
            ("--semi-global", semi_global, False),
            ("--interpolation", interpolation, "b-spline"),
            ("--ordering-constraint", ordering_constraint, "auto"),
            ("--occlusion", occlusion, "auto"),
            ("--min-visible", min_visible, 0.5),
            ("--max-sigma", max_sigma, 3),
            ("--min-confidence", min_confidence, 0.03),
            ("--wanted-sigma", wanted_sigma, 0.003),
            ("--no-fit", no_fit, False),
            ("--block-rows", block_rows, None),
            ("--anyway", anyway, False),
        ),
        progress,
    )
    return Sequence(out)


def compare(
    first: Place,
    second: Place,
    *,
    out: Place,
    overwrite: bool = False,
    trend: Literal["constant", "plane", "quadric", "cubic"] = "plane",
    region: Several[float] | str | None = None,
    mask: Place | None = None,
    anyway: bool = False,
    progress: Progress | None = None,
) -> dict[str, Any]:
    """Compare the heights of two scans of one object.

    The same as ``epirig compare``.

    Parameters
    ----------
    first
        Folder of the first sequence, or of results in it.
    second
        Folder of the second sequence, or of results in it.
    out
        Folder to write.
    overwrite
        Replace an existing comparison.
    trend
        Form that is removed from the difference.
        - "constant": Only the level: 1 coefficient.
        - "plane": Level and tilt: 3 coefficients.
        - "quadric": Level, tilt and bow: 6 coefficients.
        - "cubic": Level, tilt, bow and third powers, as uncorrected lenses cause: 10 coefficients.
    region
        Region of the picture, by two corners in px. Without it: all of it.
    mask
        Picture of the same size as the frames, whose pixels above half of full white are used. With
        region, pixels must lie in both. Without it: all of them.
    anyway
        Continue although the scan is not closed and the positions of its frames are wrong.
    progress
        Called with what is done, how many parts of it are done, and of how many.
    """
    record: dict[str, Any] = call(
        "compare",
        words(
            (None, first, REQUIRED),
            (None, second, REQUIRED),
            ("--out", out, REQUIRED),
            ("--overwrite", overwrite, False),
            ("--trend", trend, "plane"),
            ("--region", region, None),
            ("--mask", mask, None),
            ("--anyway", anyway, False),
        ),
        progress,
    )
    return record


def doctor(
    *,
    short: bool = False,
    out: Place = ".",
    rig: Place | None = None,
    set: Several[str] = (),
    step_mm: str | float | None = None,
    frames: str | float | None = None,
    start_mm: str | float | None = None,
    settle_ms: str | float | None = None,
    average: str | float | None = None,
    wait_s: str | float | None = None,
    focal_length_px: str | float | None = None,
    port: str | float | None = None,
    driver: Literal["native", "grbl", "zaber", "sim"] | None = None,
    approach_mm: str | float | None = None,
    tolerance_mm: str | float | None = None,
    velocity_mm_s: str | float | None = None,
    acceleration_mm_s2: str | float | None = None,
    axis: Literal["x", "y", "z"] | None = None,
    device: str | float | None = None,
    microstep_um: str | float | None = None,
    travel_mm: str | float | None = None,
    position_noise_um: str | float | None = None,
    backlash_um: str | float | None = None,
    transcript: Place | None = None,
    camera: str | float | None = None,
    format: str | float | None = None,
    size: str | float | None = None,
    rate_hz: str | float | None = None,
    exposure_us: str | float | None = None,
    bayer: Literal["green", "binned"] | None = None,
    patience_s: str | float | None = None,
    control: Several[str] = (),
    progress: Progress | None = None,
) -> dict[str, Any]:
    """Check the rig, and predict the uncertainty of heights.

    The same as ``epirig doctor``.

    Parameters
    ----------
    short
        Skip the checks that need many moves: mechanical settling and repeatability.
    out
        Folder of the sequence to come; its disk is checked for free space.
    rig
        The rig's profile: a file; sim for the simulated rig, real for one with the faults of real
        ones. Without it: ./rig.toml, else ~/.config/epirig/rig.toml, else none.
    set
        Change a key of the profile; may be repeated: set plan.step="2 mm".
    step_mm
        Distance between stops.
    frames
        Number of frames: one more than steps.
    start_mm
        Position of the first frame, from home. Without it: 0.
    settle_ms
        Time for which the stage vibrates after a move. Without it: 200.
    average
        Number of frames averaged at each stop, into one of 16 bit. Without it: 1.
    wait_s
        Longest wait for a device that has disconnected. Without it: 300.
    focal_length_px
        Focal length of the lens; a value in mm needs sensor_width.
    port
        The port: a path, usb:SERIAL, usb:VID:PID, or sim for a simulated device; by default the
        only USB serial port [env: EPIRIG_PORT].
    driver
        The protocol of the stage: epirig's own firmware, GRBL 1.1, Zaber ASCII; sim is a stage in
        memory [env: EPIRIG_DRIVER]. Without it: native.
    approach_mm
        Unidirectional approach against backlash: distance below each position from which it is
        approached. Without it: 0.
    tolerance_mm
        Allowed error of the reported position, beyond half a step. Without it: 0.
    velocity_mm_s
        Velocity of a long move (native, sim).
    acceleration_mm_s2
        Acceleration and deceleration (native, sim).
    axis
        The axis of the stage (grbl). Without it: x.
    device
        Number of the device in its chain (zaber). Without it: 1.
    microstep_um
        Length of a microstep, from the data sheet; required (zaber).
    travel_mm
        Length of the travel; positions go from 0 to this (sim). Without it: 200.
    position_noise_um
        Standard deviation of the position at rest (sim). Without it: 0.
    backlash_um
        Backlash: play between screw and nut (sim). Without it: 0.
    transcript
        Record every byte in FILE (``epirig decode`` reads it); one that exists is refused.
    camera
        The camera; by default the only one. sim shows the simulated object, replay:FOLDER shows the
        frames of a sequence [env: EPIRIG_CAMERA].
    format
        Pixel format; by default the deepest uncompressed grey.
    size
        Columns and rows; by default the largest size.
    rate_hz
        Frames per second; by default not changed.
    exposure_us
        Exposure time; under lamps on mains, whole half periods of the mains (10 ms at 50 Hz).
    bayer
        Use of a colour mosaic: the sum of the two green pixels of each cell, or of all four.
    patience_s
        Longest wait for a good frame, and for a steady picture. Without it: 10.
    control
        A control and its value, as often as needed: control gain=10.
    progress
        Called with what is done, how many parts of it are done, and of how many.
    """
    record: dict[str, Any] = call(
        "doctor",
        words(
            ("--short", short, False),
            ("--out", out, "."),
            ("--rig", rig, None),
            ("--set", set, ()),
            ("--step-mm", step_mm, None),
            ("--frames", frames, None),
            ("--start-mm", start_mm, None),
            ("--settle-ms", settle_ms, None),
            ("--average", average, None),
            ("--wait-s", wait_s, None),
            ("--focal-length-px", focal_length_px, None),
            ("--port", port, None),
            ("--driver", driver, None),
            ("--approach-mm", approach_mm, None),
            ("--tolerance-mm", tolerance_mm, None),
            ("--velocity-mm-s", velocity_mm_s, None),
            ("--acceleration-mm-s2", acceleration_mm_s2, None),
            ("--axis", axis, None),
            ("--device", device, None),
            ("--microstep-um", microstep_um, None),
            ("--travel-mm", travel_mm, None),
            ("--position-noise-um", position_noise_um, None),
            ("--backlash-um", backlash_um, None),
            ("--transcript", transcript, None),
            ("--camera", camera, None),
            ("--format", format, None),
            ("--size", size, None),
            ("--rate-hz", rate_hz, None),
            ("--exposure-us", exposure_us, None),
            ("--bayer", bayer, None),
            ("--patience-s", patience_s, None),
            ("--control", control, ()),
        ),
        progress,
    )
    return record


def plan(
    *,
    rig: Place | None = None,
    set: Several[str] = (),
    step_mm: str | float | None = None,
    frames: str | float | None = None,
    start_mm: str | float | None = None,
    settle_ms: str | float | None = None,
    average: str | float | None = None,
    wait_s: str | float | None = None,
    focal_length_px: str | float | None = None,
    port: str | float | None = None,
    driver: Literal["native", "grbl", "zaber", "sim"] | None = None,
    approach_mm: str | float | None = None,
    tolerance_mm: str | float | None = None,
    velocity_mm_s: str | float | None = None,
    acceleration_mm_s2: str | float | None = None,
    axis: Literal["x", "y", "z"] | None = None,
    device: str | float | None = None,
    microstep_um: str | float | None = None,
    travel_mm: str | float | None = None,
    position_noise_um: str | float | None = None,
    backlash_um: str | float | None = None,
    transcript: Place | None = None,
    camera: str | float | None = None,
    format: str | float | None = None,
    size: str | float | None = None,
    rate_hz: str | float | None = None,
    exposure_us: str | float | None = None,
    bayer: Literal["green", "binned"] | None = None,
    patience_s: str | float | None = None,
    control: Several[str] = (),
    progress: Progress | None = None,
) -> dict[str, Any]:
    """Print what a scan would do: positions, time, bytes.

    The same as ``epirig plan``.

    Parameters
    ----------
    rig
        The rig's profile: a file; sim for the simulated rig, real for one with the faults of real
        ones. Without it: ./rig.toml, else ~/.config/epirig/rig.toml, else none.
    set
        Change a key of the profile; may be repeated: set plan.step="2 mm".
    step_mm
        Distance between stops.
    frames
        Number of frames: one more than steps.
    start_mm
        Position of the first frame, from home. Without it: 0.
    settle_ms
        Time for which the stage vibrates after a move. Without it: 200.
    average
        Number of frames averaged at each stop, into one of 16 bit. Without it: 1.
    wait_s
        Longest wait for a device that has disconnected. Without it: 300.
    focal_length_px
        Focal length of the lens; a value in mm needs sensor_width.
    port
        The port: a path, usb:SERIAL, usb:VID:PID, or sim for a simulated device; by default the
        only USB serial port [env: EPIRIG_PORT].
    driver
        The protocol of the stage: epirig's own firmware, GRBL 1.1, Zaber ASCII; sim is a stage in
        memory [env: EPIRIG_DRIVER]. Without it: native.
    approach_mm
        Unidirectional approach against backlash: distance below each position from which it is
        approached. Without it: 0.
    tolerance_mm
        Allowed error of the reported position, beyond half a step. Without it: 0.
    velocity_mm_s
        Velocity of a long move (native, sim).
    acceleration_mm_s2
        Acceleration and deceleration (native, sim).
    axis
        The axis of the stage (grbl). Without it: x.
    device
        Number of the device in its chain (zaber). Without it: 1.
    microstep_um
        Length of a microstep, from the data sheet; required (zaber).
    travel_mm
        Length of the travel; positions go from 0 to this (sim). Without it: 200.
    position_noise_um
        Standard deviation of the position at rest (sim). Without it: 0.
    backlash_um
        Backlash: play between screw and nut (sim). Without it: 0.
    transcript
        Record every byte in FILE (``epirig decode`` reads it); one that exists is refused.
    camera
        The camera; by default the only one. sim shows the simulated object, replay:FOLDER shows the
        frames of a sequence [env: EPIRIG_CAMERA].
    format
        Pixel format; by default the deepest uncompressed grey.
    size
        Columns and rows; by default the largest size.
    rate_hz
        Frames per second; by default not changed.
    exposure_us
        Exposure time; under lamps on mains, whole half periods of the mains (10 ms at 50 Hz).
    bayer
        Use of a colour mosaic: the sum of the two green pixels of each cell, or of all four.
    patience_s
        Longest wait for a good frame, and for a steady picture. Without it: 10.
    control
        A control and its value, as often as needed: control gain=10.
    progress
        Called with what is done, how many parts of it are done, and of how many.
    """
    record: dict[str, Any] = call(
        "plan",
        words(
            ("--rig", rig, None),
            ("--set", set, ()),
            ("--step-mm", step_mm, None),
            ("--frames", frames, None),
            ("--start-mm", start_mm, None),
            ("--settle-ms", settle_ms, None),
            ("--average", average, None),
            ("--wait-s", wait_s, None),
            ("--focal-length-px", focal_length_px, None),
            ("--port", port, None),
            ("--driver", driver, None),
            ("--approach-mm", approach_mm, None),
            ("--tolerance-mm", tolerance_mm, None),
            ("--velocity-mm-s", velocity_mm_s, None),
            ("--acceleration-mm-s2", acceleration_mm_s2, None),
            ("--axis", axis, None),
            ("--device", device, None),
            ("--microstep-um", microstep_um, None),
            ("--travel-mm", travel_mm, None),
            ("--position-noise-um", position_noise_um, None),
            ("--backlash-um", backlash_um, None),
            ("--transcript", transcript, None),
            ("--camera", camera, None),
            ("--format", format, None),
            ("--size", size, None),
            ("--rate-hz", rate_hz, None),
            ("--exposure-us", exposure_us, None),
            ("--bayer", bayer, None),
            ("--patience-s", patience_s, None),
            ("--control", control, ()),
        ),
        progress,
    )
    return record


def list_sequences(
    *,
    folder: Place = ".",
    sort: Literal["begun", "name", "depth", "state", "verdict"] = "begun",
    reverse: bool = False,
    state: Literal["unreadable", "scan", "calibrated", "matched", "measured"] | None = None,
    verdict: Literal["pass", "fail", "undecided"] | None = None,
    progress: Progress | None = None,
) -> dict[str, Any]:
    """List the sequences below a folder, with depth and verdict.

    The same as ``epirig list``.

    Parameters
    ----------
    folder
        Folder to look below.
    sort
        Order of the list.
        - "begun": When they were begun, the newest last.
        - "name": Their names, in alphabetical order.
        - "depth": Their depth, the deepest last; those without one come first.
        - "state": How far the work has come.
        - "verdict": Their verdict: none, pass, undecided, fail.
    reverse
        Turn the order round.
    state
        Only sequences of this state.
        - "unreadable": Its records cannot be read.
        - "scan": It has frames.
        - "calibrated": It has a calibration.
        - "matched": It has results of `match`.
        - "measured": Its surface was measured.
    verdict
        Only sequences of this verdict.
        - "pass": Conformity is proven, or accepted.
        - "fail": Non-conformity is proven, or a value is rejected.
        - "undecided": Neither is proven, or the value is not known.
    progress
        Called with what is done, how many parts of it are done, and of how many.
    """
    record: dict[str, Any] = call(
        "list",
        words(
            (None, folder, "."),
            ("--sort", sort, "begun"),
            ("--reverse", reverse, False),
            ("--state", state, None),
            ("--verdict", verdict, None),
        ),
        progress,
    )
    return record


def trend(
    *,
    folder: Place = ".",
    measure: Literal["depth", "bow", "wall-width", "noise", "answered", "distance", "brightness", "flicker", "mapping", "blur", "stage-error", "roll", "pan"] = "depth",
    baseline: int | None = None,
    picture: Place | None = None,
    progress: Progress | None = None,
) -> dict[str, Any]:
    """Follow depth and rig over many sequences, with control charts.

    The same as ``epirig trend``.

    Parameters
    ----------
    folder
        Folder to look below.
    measure
        The quantity whose values are looked at one by one, and drawn.
        - "depth": Depth of the hollows, or height of the raised parts.
        - "bow": Bow of the form: the flatness deviation of the rig, if the object is flat.
        - "wall-width": How wide the walls look, from 10 % to 90 % of the depth.
        - "noise": Standard uncertainty of a typical disparity, by the noise.
        - "answered": Share of the object that has a disparity.
        - "distance": Distance of the object from the camera.
        - "brightness": Mean intensity of the frames.
        - "flicker": Change of the light from frame to frame.
        - "mapping": Largest mean residual of the board's corners in a part of the image: what the
          lens leaves of the x-y mapping.
        - "blur": Blur of the target's edges: the focus.
        - "stage-error": Positioning error of the stage, by the target.
        - "roll": Roll of the camera against the stage axis.
        - "pan": Pan of the camera against the stage axis.
    baseline
        Make limits of the first N sequences, which are known to be good. Without it: of all.
    picture
        Draw the control chart of measure into a PNG file; an existing file is refused.
    progress
        Called with what is done, how many parts of it are done, and of how many.
    """
    record: dict[str, Any] = call(
        "trend",
        words(
            (None, folder, "."),
            ("--measure", measure, "depth"),
            ("--baseline", baseline, None),
            ("--picture", picture, None),
        ),
        progress,
    )
    return record


def repeat(
    count: int,
    *,
    out: Place,
    anyway: bool = False,
    rig: Place | None = None,
    set: Several[str] = (),
    step_mm: str | float | None = None,
    frames: str | float | None = None,
    start_mm: str | float | None = None,
    settle_ms: str | float | None = None,
    average: str | float | None = None,
    wait_s: str | float | None = None,
    focal_length_px: str | float | None = None,
    port: str | float | None = None,
    driver: Literal["native", "grbl", "zaber", "sim"] | None = None,
    approach_mm: str | float | None = None,
    tolerance_mm: str | float | None = None,
    velocity_mm_s: str | float | None = None,
    acceleration_mm_s2: str | float | None = None,
    axis: Literal["x", "y", "z"] | None = None,
    device: str | float | None = None,
    microstep_um: str | float | None = None,
    travel_mm: str | float | None = None,
    position_noise_um: str | float | None = None,
    backlash_um: str | float | None = None,
    transcript: Place | None = None,
    camera: str | float | None = None,
    format: str | float | None = None,
    size: str | float | None = None,
    rate_hz: str | float | None = None,
    exposure_us: str | float | None = None,
    bayer: Literal["green", "binned"] | None = None,
    patience_s: str | float | None = None,
    control: Several[str] = (),
    quick: bool = False,
    method: Literal["variance", "normalised", "ncc-first", "ncc-mean"] = "variance",
    range: Several[float] | str | None = None,
    reference: Literal["first", "middle", "last"] | int = "middle",
    disparity_step: float = 0.25,
    window: int | None = None,
    search: Literal["factorised", "exhaustive"] = "factorised",
    semi_global: bool = False,
    interpolation: Literal["linear", "cubic", "b-spline"] = "b-spline",
    ordering_constraint: Literal["on", "off", "auto"] = "auto",
    occlusion: Literal["none", "one-side", "auto"] = "auto",
    min_visible: float = 0.5,
    max_sigma: float = 3,
    min_confidence: float = 0.03,
    wanted_sigma: float = 0.003,
    no_fit: bool = False,
    block_rows: int | None = None,
    progress: Progress | None = None,
) -> dict[str, Any]:
    """Scan one object many times, and tell how the results repeat.

    The same as ``epirig repeat``.

    Parameters
    ----------
    count
        How many scans there shall be.
    out
        Folder of the sequences.
    anyway
        Continue even if the checks forbid a scan.
    rig
        The rig's profile: a file; sim for the simulated rig, real for one with the faults of real
        ones. Without it: ./rig.toml, else ~/.config/epirig/rig.toml, else none.
    set
        Change a key of the profile; may be repeated: set plan.step="2 mm".
    step_mm
        Distance between stops.
    frames
        Number of frames: one more than steps.
    start_mm
        Position of the first frame, from home. Without it: 0.
    settle_ms
        Time for which the stage vibrates after a move. Without it: 200.
    average
        Number of frames averaged at each stop, into one of 16 bit. Without it: 1.
    wait_s
        Longest wait for a device that has disconnected. Without it: 300.
    focal_length_px
        Focal length of the lens; a value in mm needs sensor_width.
    port
        The port: a path, usb:SERIAL, usb:VID:PID, or sim for a simulated device; by default the
        only USB serial port [env: EPIRIG_PORT].
    driver
        The protocol of the stage: epirig's own firmware, GRBL 1.1, Zaber ASCII; sim is a stage in
        memory [env: EPIRIG_DRIVER]. Without it: native.
    approach_mm
        Unidirectional approach against backlash: distance below each position from which it is
        approached. Without it: 0.
    tolerance_mm
        Allowed error of the reported position, beyond half a step. Without it: 0.
    velocity_mm_s
        Velocity of a long move (native, sim).
    acceleration_mm_s2
        Acceleration and deceleration (native, sim).
    axis
        The axis of the stage (grbl). Without it: x.
    device
        Number of the device in its chain (zaber). Without it: 1.
    microstep_um
        Length of a microstep, from the data sheet; required (zaber).
    travel_mm
        Length of the travel; positions go from 0 to this (sim). Without it: 200.
    position_noise_um
        Standard deviation of the position at rest (sim). Without it: 0.
    backlash_um
        Backlash: play between screw and nut (sim). Without it: 0.
    transcript
        Record every byte in FILE (``epirig decode`` reads it); one that exists is refused.
    camera
        The camera; by default the only one. sim shows the simulated object, replay:FOLDER shows the
        frames of a sequence [env: EPIRIG_CAMERA].
    format
        Pixel format; by default the deepest uncompressed grey.
    size
        Columns and rows; by default the largest size.
    rate_hz
        Frames per second; by default not changed.
    exposure_us
        Exposure time; under lamps on mains, whole half periods of the mains (10 ms at 50 Hz).
    bayer
        Use of a colour mosaic: the sum of the two green pixels of each cell, or of all four.
    patience_s
        Longest wait for a good frame, and for a steady picture. Without it: 10.
    control
        A control and its value, as often as needed: control gain=10.
    quick
        First look: takes some 60 % of the time. Uses half of the frames if there are a hundred or
        more, looks for edges in small discs only, and searches occluding objects at half the
        resolution, too. Sigma includes what that costs, except for relief finer than the discs;
        objects narrower than some 20 px may be missed.
    method
        Cost function: how the samples along a line are compared.
        - "variance": Variance of the intensities along the line; needs equal illumination.
        - "normalised": Variance of locally normalised frames: for light that varies between frames
          and over the image.
        - "ncc-first": Correlation of windows with the reference frame's window.
        - "ncc-mean": Correlation of windows with their mean.
    range
        Range of disparities, in px over the whole baseline, such as 420..434 or -60..0. Without it:
        found from the data.
    reference
        The reference frame, whose pixels get a disparity: first, middle, last or an index from 0.
        Most points of the middle frame are seen by most frames; the paper takes the first.
    disparity_step
        Step between disparity candidates, in px.
    window
        Side of the cost's window, odd, in px. Without it: 3 for variance and normalised, 7 for
        correlation.
    search
        How candidates are searched: by sums over groups of frames, or by every sample as in the
        paper (always so for correlation).
        - "factorised": Sums over groups of neighbouring frames serve many candidates: many times
          faster.
        - "exhaustive": The samples of all frames for each candidate, as in the paper.
    semi_global
        Aggregate costs across rows (semi-global matching): for weak texture on surfaces that
        continue from row to row. The search takes about twice as long.
    interpolation
        Interpolation of frames between pixels in the exhaustive search.
        - "linear": Straight line between the two neighbours.
        - "cubic": Cubic convolution over four neighbours (Keys 1981, a = -1/2).
        - "b-spline": Cubic B-spline through all pixels of the row (Unser 1999), the most accurate.
    ordering_constraint
        Whether points keep their order from the first frame to the last.
        - "on": Points keep their order: the paper's strictly increasing mapping.
        - "off": Each pixel by itself: for objects that occlude others.
        - "auto": On, unless the sampled rows show depth edges that no strictly increasing mapping
          allows.
    occlusion
        Whether points may be occluded in part of the sequence.
        - "none": Nothing is occluded: all frames that contain the candidate count.
        - "one-side": A point may be occluded before or after the reference frame.
        - "auto": One side without the ordering constraint, none with it.
    min_visible
        Share of the frames that must see a point, above 0 and at most 1.
    max_sigma
        Reject pixels whose sigma is larger, in px.
    min_confidence
        Reject pixels whose confidence is lower, 0 to 1 (only without the ordering constraint).
    wanted_sigma
        Let the discs of the sub-pixel fit grow where they leave a larger sigma than this, in px: up
        to 115 px. ``float("inf")`` keeps all at one small size.
    no_fit
        Interpolate three costs by a parabola instead of the fit over all frames (always so for
        correlation).
    block_rows
        Match this many rows in one go, at most. Without it: as many as take 768 MiB, and 256 at
        least.
    progress
        Called with what is done, how many parts of it are done, and of how many.
    """
    record: dict[str, Any] = call(
        "repeat",
        words(
            (None, count, REQUIRED),
            ("--out", out, REQUIRED),
            ("--anyway", anyway, False),
            ("--rig", rig, None),
            ("--set", set, ()),
            ("--step-mm", step_mm, None),
            ("--frames", frames, None),
            ("--start-mm", start_mm, None),
            ("--settle-ms", settle_ms, None),
            ("--average", average, None),
            ("--wait-s", wait_s, None),
            ("--focal-length-px", focal_length_px, None),
            ("--port", port, None),
            ("--driver", driver, None),
            ("--approach-mm", approach_mm, None),
            ("--tolerance-mm", tolerance_mm, None),
            ("--velocity-mm-s", velocity_mm_s, None),
            ("--acceleration-mm-s2", acceleration_mm_s2, None),
            ("--axis", axis, None),
            ("--device", device, None),
            ("--microstep-um", microstep_um, None),
            ("--travel-mm", travel_mm, None),
            ("--position-noise-um", position_noise_um, None),
            ("--backlash-um", backlash_um, None),
            ("--transcript", transcript, None),
            ("--camera", camera, None),
            ("--format", format, None),
            ("--size", size, None),
            ("--rate-hz", rate_hz, None),
            ("--exposure-us", exposure_us, None),
            ("--bayer", bayer, None),
            ("--patience-s", patience_s, None),
            ("--control", control, ()),
            ("--quick", quick, False),
            ("--method", method, "variance"),
            ("--range", range, None),
            ("--reference", reference, "middle"),
            ("--disparity-step", disparity_step, 0.25),
            ("--window", window, None),
            ("--search", search, "factorised"),
            ("--semi-global", semi_global, False),
            ("--interpolation", interpolation, "b-spline"),
            ("--ordering-constraint", ordering_constraint, "auto"),
            ("--occlusion", occlusion, "auto"),
            ("--min-visible", min_visible, 0.5),
            ("--max-sigma", max_sigma, 3),
            ("--min-confidence", min_confidence, 0.03),
            ("--wanted-sigma", wanted_sigma, 0.003),
            ("--no-fit", no_fit, False),
            ("--block-rows", block_rows, None),
        ),
        progress,
    )
    return record


def characterise(
    *,
    folder: Place = ".",
    standard: Several[str] = (),
    earlier: Place | None = None,
    progress: Progress | None = None,
) -> dict[str, Any]:
    """Tell what the rig can do, from repeated scans of one object.

    The same as ``epirig characterise``.

    Parameters
    ----------
    folder
        Folder to look below.
    standard
        The object's depth is known: `0.2 +- 0.001 mm`, with 95 % coverage; may be given for each of
        several folders inside FOLDER, as `NAME=0.2 mm`.
    earlier
        Tell what has changed since earlier scans of the same object, which lie below this folder.
    progress
        Called with what is done, how many parts of it are done, and of how many.
    """
    record: dict[str, Any] = call(
        "characterise",
        words(
            (None, folder, "."),
            ("--standard", standard, ()),
            ("--earlier", earlier, None),
        ),
        progress,
    )
    return record


class RigOptions:
    """A rig, as its profile and these options describe it; nothing is connected yet.

    The options are those of ``epirig capture``.

    Parameters
    ----------
    rig
        The rig's profile: a file; sim for the simulated rig, real for one with the faults of real
        ones. Without it: ./rig.toml, else ~/.config/epirig/rig.toml, else none.
    set
        Change a key of the profile; may be repeated: set plan.step="2 mm".
    step_mm
        Distance between stops.
    frames
        Number of frames: one more than steps.
    start_mm
        Position of the first frame, from home. Without it: 0.
    settle_ms
        Time for which the stage vibrates after a move. Without it: 200.
    average
        Number of frames averaged at each stop, into one of 16 bit. Without it: 1.
    wait_s
        Longest wait for a device that has disconnected. Without it: 300.
    focal_length_px
        Focal length of the lens; a value in mm needs sensor_width.
    port
        The port: a path, usb:SERIAL, usb:VID:PID, or sim for a simulated device; by default the
        only USB serial port [env: EPIRIG_PORT].
    driver
        The protocol of the stage: epirig's own firmware, GRBL 1.1, Zaber ASCII; sim is a stage in
        memory [env: EPIRIG_DRIVER]. Without it: native.
    approach_mm
        Unidirectional approach against backlash: distance below each position from which it is
        approached. Without it: 0.
    tolerance_mm
        Allowed error of the reported position, beyond half a step. Without it: 0.
    velocity_mm_s
        Velocity of a long move (native, sim).
    acceleration_mm_s2
        Acceleration and deceleration (native, sim).
    axis
        The axis of the stage (grbl). Without it: x.
    device
        Number of the device in its chain (zaber). Without it: 1.
    microstep_um
        Length of a microstep, from the data sheet; required (zaber).
    travel_mm
        Length of the travel; positions go from 0 to this (sim). Without it: 200.
    position_noise_um
        Standard deviation of the position at rest (sim). Without it: 0.
    backlash_um
        Backlash: play between screw and nut (sim). Without it: 0.
    transcript
        Record every byte in FILE (``epirig decode`` reads it); one that exists is refused.
    camera
        The camera; by default the only one. sim shows the simulated object, replay:FOLDER shows the
        frames of a sequence [env: EPIRIG_CAMERA].
    format
        Pixel format; by default the deepest uncompressed grey.
    size
        Columns and rows; by default the largest size.
    rate_hz
        Frames per second; by default not changed.
    exposure_us
        Exposure time; under lamps on mains, whole half periods of the mains (10 ms at 50 Hz).
    bayer
        Use of a colour mosaic: the sum of the two green pixels of each cell, or of all four.
    patience_s
        Longest wait for a good frame, and for a steady picture. Without it: 10.
    control
        A control and its value, as often as needed: control gain=10.
    """

    def __init__(
        self,
        *,
        rig: Place | None = None,
        set: Several[str] = (),
        step_mm: str | float | None = None,
        frames: str | float | None = None,
        start_mm: str | float | None = None,
        settle_ms: str | float | None = None,
        average: str | float | None = None,
        wait_s: str | float | None = None,
        focal_length_px: str | float | None = None,
        port: str | float | None = None,
        driver: Literal["native", "grbl", "zaber", "sim"] | None = None,
        approach_mm: str | float | None = None,
        tolerance_mm: str | float | None = None,
        velocity_mm_s: str | float | None = None,
        acceleration_mm_s2: str | float | None = None,
        axis: Literal["x", "y", "z"] | None = None,
        device: str | float | None = None,
        microstep_um: str | float | None = None,
        travel_mm: str | float | None = None,
        position_noise_um: str | float | None = None,
        backlash_um: str | float | None = None,
        transcript: Place | None = None,
        camera: str | float | None = None,
        format: str | float | None = None,
        size: str | float | None = None,
        rate_hz: str | float | None = None,
        exposure_us: str | float | None = None,
        bayer: Literal["green", "binned"] | None = None,
        patience_s: str | float | None = None,
        control: Several[str] = (),
    ) -> None:
        self._words = words(
            ("--rig", rig, None),
            ("--set", set, ()),
            ("--step-mm", step_mm, None),
            ("--frames", frames, None),
            ("--start-mm", start_mm, None),
            ("--settle-ms", settle_ms, None),
            ("--average", average, None),
            ("--wait-s", wait_s, None),
            ("--focal-length-px", focal_length_px, None),
            ("--port", port, None),
            ("--driver", driver, None),
            ("--approach-mm", approach_mm, None),
            ("--tolerance-mm", tolerance_mm, None),
            ("--velocity-mm-s", velocity_mm_s, None),
            ("--acceleration-mm-s2", acceleration_mm_s2, None),
            ("--axis", axis, None),
            ("--device", device, None),
            ("--microstep-um", microstep_um, None),
            ("--travel-mm", travel_mm, None),
            ("--position-noise-um", position_noise_um, None),
            ("--backlash-um", backlash_um, None),
            ("--transcript", transcript, None),
            ("--camera", camera, None),
            ("--format", format, None),
            ("--size", size, None),
            ("--rate-hz", rate_hz, None),
            ("--exposure-us", exposure_us, None),
            ("--bayer", bayer, None),
            ("--patience-s", patience_s, None),
            ("--control", control, ()),
        )


class SequenceVerbs:
    """The verbs that work on a sequence."""

    folder: Path

    def verify(
        self,
        *,
        progress: Progress | None = None,
    ) -> dict[str, Any]:
        """Check frames, calibration and results against their records.

        The same as ``epirig verify``.

        Parameters
        ----------
        progress
            Called with what is done, how many parts of it are done, and of how many.
        """
        record: dict[str, Any] = call(
            "verify",
            words(
                (None, self.folder, REQUIRED),
            ),
            progress,
        )
        return record

    def calibrate(
        self,
        *,
        overwrite: bool = False,
        lens: Place | None = None,
        export_lens: Place | None = None,
        flat_field: str | float = "auto",
        no_dark: bool = False,
        no_defective_pixels: bool = False,
        no_frame_gain: bool = False,
        linearity: Place | None = None,
        positions: Literal["auto", "target", "texture", "stage"] = "auto",
        memory: str | None = None,
        anyway: bool = False,
        rig: Place | None = None,
        set: Several[str] = (),
        progress: Progress | None = None,
    ) -> dict[str, Any]:
        """Calibrate: illumination, lens, stage axis, positions of frames.

        The same as ``epirig calibrate``.

        Parameters
        ----------
        overwrite
            Replace an existing calibration.
        lens
            Read the lens from a file: .yml or .yaml of OpenCV or ROS, or calibration.json of
            another sequence. Without it: from the board frames, else from [optics].
        export_lens
            Export the lens for another program: .yml for OpenCV, .yaml for ROS (camera_info).
        flat_field
            Model of the flat field: auto (chosen by cross-validation), paper (polynomial of order
            3), order:N, pixels, none.
        no_dark
            Do not subtract the dark level.
        no_defective_pixels
            Do not replace defective pixels.
        no_frame_gain
            Do not make the frames equally bright.
        linearity
            Table of flat images at several exposures, to test the sensor's linearity. Columns: file
            and exposure (any unit).
        positions
            Source of the position of every frame.
            - "auto": The target where one is described; else the texture, where it tells more than
              the stage.
            - "target": The target.
            - "texture": The object's texture; scale and origin are the stage's.
            - "stage": The stage's report.
        memory
            Most memory to take, such as 2GiB or 800MB. Frames that are more are packed on disk
            first, and read a part at a time. The results are the same. Without it: half of what is
            free.
        anyway
            Continue although the scan is not closed and the positions of its frames are wrong.
        rig
            The rig's profile: a file; sim for the simulated rig, real for one with the faults of
            real ones. Without it: ./rig.toml, else ~/.config/epirig/rig.toml, else none.
        set
            Change a key of the profile; may be repeated: set plan.step="2 mm".
        progress
            Called with what is done, how many parts of it are done, and of how many.
        """
        record: dict[str, Any] = call(
            "calibrate",
            words(
                (None, self.folder, REQUIRED),
                ("--overwrite", overwrite, False),
                ("--lens", lens, None),
                ("--export-lens", export_lens, None),
                ("--flat-field", flat_field, "auto"),
                ("--no-dark", no_dark, False),
                ("--no-defective-pixels", no_defective_pixels, False),
                ("--no-frame-gain", no_frame_gain, False),
                ("--linearity", linearity, None),
                ("--positions", positions, "auto"),
                ("--memory", memory, None),
                ("--anyway", anyway, False),
                ("--rig", rig, None),
                ("--set", set, ()),
            ),
            progress,
        )
        return record

    def rectify(
        self,
        *,
        out: Place,
        anyway: bool = False,
        progress: Progress | None = None,
    ) -> Sequence:
        """Write corrected and rectified frames as a new sequence.

        The same as ``epirig rectify``.

        Parameters
        ----------
        out
            Folder of the new sequence.
        anyway
            Continue although the scan is not closed and the positions of its frames are wrong.
        progress
            Called with what is done, how many parts of it are done, and of how many.
        """
        from ._sequence import Sequence

        call(
            "rectify",
            words(
                (None, self.folder, REQUIRED),
                ("--out", out, REQUIRED),
                ("--anyway", anyway, False),
            ),
            progress,
        )
        return Sequence(out)

    def pack(
        self,
        *,
        out: Place | None = None,
        as_captured: bool = False,
        bundle: Place | None = None,
        with_results: bool = False,
        anyway: bool = False,
        progress: Progress | None = None,
    ) -> dict[str, Any]:
        """Pack the frames as one Zarr array, or all as one file to send.

        The same as ``epirig pack``.

        Parameters
        ----------
        out
            Folder of the array. Without it: SEQ/volume.zarr.
        as_captured
            Pack the frames as captured, without the calibration of ``epirig calibrate``.
        bundle
            Write the sequence as one zip file instead; an existing file is refused.
        with_results
            With bundle: calibration and results, too.
        anyway
            Continue although the scan is not closed and the positions of its frames are wrong.
        progress
            Called with what is done, how many parts of it are done, and of how many.
        """
        record: dict[str, Any] = call(
            "pack",
            words(
                (None, self.folder, REQUIRED),
                ("--out", out, None),
                ("--as-captured", as_captured, False),
                ("--bundle", bundle, None),
                ("--with-results", with_results, False),
                ("--anyway", anyway, False),
            ),
            progress,
        )
        return record

    def match(
        self,
        *,
        out: Place | None = None,
        overwrite: bool = False,
        figure_row: int | None = None,
        as_captured: bool = False,
        region: Several[float] | str | None = None,
        mask: Place | None = None,
        anyway: bool = False,
        memory: str | None = None,
        quick: bool = False,
        method: Literal["variance", "normalised", "ncc-first", "ncc-mean"] = "variance",
        range: Several[float] | str | None = None,
        reference: Literal["first", "middle", "last"] | int = "middle",
        disparity_step: float = 0.25,
        window: int | None = None,
        search: Literal["factorised", "exhaustive"] = "factorised",
        semi_global: bool = False,
        interpolation: Literal["linear", "cubic", "b-spline"] = "b-spline",
        ordering_constraint: Literal["on", "off", "auto"] = "auto",
        occlusion: Literal["none", "one-side", "auto"] = "auto",
        min_visible: float = 0.5,
        max_sigma: float = 3,
        min_confidence: float = 0.03,
        wanted_sigma: float = 0.003,
        no_fit: bool = False,
        block_rows: int | None = None,
        progress: Progress | None = None,
    ) -> Results:
        """Compute the disparity of every pixel, and its height.

        The same as ``epirig match``.

        Parameters
        ----------
        out
            Folder of the results. Without it: SEQ/results.
        overwrite
            Replace existing results.
        figure_row
            Row of the reference frame that the figures show. Without it: the middle one.
        as_captured
            Match the frames as captured, without the calibration of ``epirig calibrate``.
        region
            Region of the picture, by two corners in px. Without it: all of it.
        mask
            Picture of the same size as the frames, whose pixels above half of full white are used.
            With region, pixels must lie in both. Without it: all of them.
        anyway
            Continue although the scan is not closed and the positions of its frames are wrong.
        memory
            Most memory to take, such as 2GiB or 800MB. Frames that are more are packed on disk
            first, and read a part at a time. The results are the same. Without it: half of what is
            free.
        quick
            First look: takes some 60 % of the time. Uses half of the frames if there are a hundred
            or more, looks for edges in small discs only, and searches occluding objects at half the
            resolution, too. Sigma includes what that costs, except for relief finer than the discs;
            objects narrower than some 20 px may be missed.
        method
            Cost function: how the samples along a line are compared.
            - "variance": Variance of the intensities along the line; needs equal illumination.
            - "normalised": Variance of locally normalised frames: for light that varies between
              frames and over the image.
            - "ncc-first": Correlation of windows with the reference frame's window.
            - "ncc-mean": Correlation of windows with their mean.
        range
            Range of disparities, in px over the whole baseline, such as 420..434 or -60..0. Without
            it: found from the data.
        reference
            The reference frame, whose pixels get a disparity: first, middle, last or an index from
            0. Most points of the middle frame are seen by most frames; the paper takes the first.
        disparity_step
            Step between disparity candidates, in px.
        window
            Side of the cost's window, odd, in px. Without it: 3 for variance and normalised, 7 for
            correlation.
        search
            How candidates are searched: by sums over groups of frames, or by every sample as in the
            paper (always so for correlation).
            - "factorised": Sums over groups of neighbouring frames serve many candidates: many
              times faster.
            - "exhaustive": The samples of all frames for each candidate, as in the paper.
        semi_global
            Aggregate costs across rows (semi-global matching): for weak texture on surfaces that
            continue from row to row. The search takes about twice as long.
        interpolation
            Interpolation of frames between pixels in the exhaustive search.
            - "linear": Straight line between the two neighbours.
            - "cubic": Cubic convolution over four neighbours (Keys 1981, a = -1/2).
            - "b-spline": Cubic B-spline through all pixels of the row (Unser 1999), the most
              accurate.
        ordering_constraint
            Whether points keep their order from the first frame to the last.
            - "on": Points keep their order: the paper's strictly increasing mapping.
            - "off": Each pixel by itself: for objects that occlude others.
            - "auto": On, unless the sampled rows show depth edges that no strictly increasing
              mapping allows.
        occlusion
            Whether points may be occluded in part of the sequence.
            - "none": Nothing is occluded: all frames that contain the candidate count.
            - "one-side": A point may be occluded before or after the reference frame.
            - "auto": One side without the ordering constraint, none with it.
        min_visible
            Share of the frames that must see a point, above 0 and at most 1.
        max_sigma
            Reject pixels whose sigma is larger, in px.
        min_confidence
            Reject pixels whose confidence is lower, 0 to 1 (only without the ordering constraint).
        wanted_sigma
            Let the discs of the sub-pixel fit grow where they leave a larger sigma than this, in
            px: up to 115 px. ``float("inf")`` keeps all at one small size.
        no_fit
            Interpolate three costs by a parabola instead of the fit over all frames (always so for
            correlation).
        block_rows
            Match this many rows in one go, at most. Without it: as many as take 768 MiB, and 256 at
            least.
        progress
            Called with what is done, how many parts of it are done, and of how many.
        """
        record: dict[str, Any] = call(
            "match",
            words(
                (None, self.folder, REQUIRED),
                ("--out", out, None),
                ("--overwrite", overwrite, False),
                ("--figure-row", figure_row, None),
                ("--as-captured", as_captured, False),
                ("--region", region, None),
                ("--mask", mask, None),
                ("--anyway", anyway, False),
                ("--memory", memory, None),
                ("--quick", quick, False),
                ("--method", method, "variance"),
                ("--range", range, None),
                ("--reference", reference, "middle"),
                ("--disparity-step", disparity_step, 0.25),
                ("--window", window, None),
                ("--search", search, "factorised"),
                ("--semi-global", semi_global, False),
                ("--interpolation", interpolation, "b-spline"),
                ("--ordering-constraint", ordering_constraint, "auto"),
                ("--occlusion", occlusion, "auto"),
                ("--min-visible", min_visible, 0.5),
                ("--max-sigma", max_sigma, 3),
                ("--min-confidence", min_confidence, 0.03),
                ("--wanted-sigma", wanted_sigma, 0.003),
                ("--no-fit", no_fit, False),
                ("--block-rows", block_rows, None),
            ),
            progress,
        )
        return Results(self.folder / "results" if out is None else out, record)

    def surface(
        self,
        *,
        results: Place | None = None,
        out: Place | None = None,
        overwrite: bool = False,
        trend: Literal["constant", "plane", "quadric", "cubic"] = "quadric",
        region: Several[float] | str | None = None,
        mask: Place | None = None,
        with_target: bool = False,
        profile: Several[float] | str | None = None,
        profile_width: int = 1,
        s_filter_mm: float | None = None,
        l_filter_mm: float | None = None,
        tolerance: str | float | None = None,
        decision_rule: Literal["guarded-risk", "guarded-coverage", "simple"] | None = None,
        risk_percent: str | float | None = None,
        report: Several[str] = (),
        anyway: bool = False,
        progress: Progress | None = None,
    ) -> Surface:
        """Measure the depth of hollows in a surface, and its roughness.

        The same as ``epirig surface``.

        Parameters
        ----------
        results
            Folder of the matcher's results. Without it: SEQ/results.
        out
            Folder to write. Without it: surface in the folder of the results.
        overwrite
            Replace existing results of the surface.
        trend
            Form that is removed from the heights.
            - "constant": Only the level: 1 coefficient.
            - "plane": Level and tilt: 3 coefficients.
            - "quadric": Level, tilt and bow: 6 coefficients.
            - "cubic": Level, tilt, bow and third powers, as uncorrected lenses cause: 10
              coefficients.
        region
            Region of the picture, by two corners in px. Without it: all of it.
        mask
            Picture of the same size as the frames, whose pixels above half of full white are used.
            With region, pixels must lie in both. Without it: all of them.
        with_target
            Measure the chess-boards of the calibration's target, too, which are no part of the
            surface.
        profile
            Ends of a profile, in px. Without it: the middle row of the field.
        profile_width
            Width over which the profile is averaged, across its line, in px.
        s_filter_mm
            Cut-off of the S-filter, in mm: shorter waves do not count as roughness. Without it: no
            filter.
        l_filter_mm
            Cut-off of the L-filter, in mm: longer waves do not count as roughness. Without it: no
            filter.
        tolerance
            Limits of what is measured, which the verdict is about.
        decision_rule
            How the verdict is reached: guarded-risk (ISO 14253-1, proven with at most the risk),
            guarded-coverage (beyond a guard band of the expanded uncertainty), or simple (the value
            alone). Without it: guarded-risk.
        risk_percent
            Largest probability of a wrong verdict, for guarded-risk. Without it: 5.
        report
            What the report says beside the results: a key of `[report]` in a profile, such as
            customer or object; may be given several times. Without it: as recorded with the frames.
        anyway
            Continue although the scan is not closed and the positions of its frames are wrong.
        progress
            Called with what is done, how many parts of it are done, and of how many.
        """
        record: dict[str, Any] = call(
            "surface",
            words(
                (None, self.folder, REQUIRED),
                ("--results", results, None),
                ("--out", out, None),
                ("--overwrite", overwrite, False),
                ("--trend", trend, "quadric"),
                ("--region", region, None),
                ("--mask", mask, None),
                ("--with-target", with_target, False),
                ("--profile", profile, None),
                ("--profile-width", profile_width, 1),
                ("--s-filter-mm", s_filter_mm, None),
                ("--l-filter-mm", l_filter_mm, None),
                ("--tolerance", tolerance, None),
                ("--decision-rule", decision_rule, None),
                ("--risk-percent", risk_percent, None),
                ("--report", report, ()),
                ("--anyway", anyway, False),
            ),
            progress,
        )
        return Surface.of(self.folder, results, out, record)

    def evaluate(
        self,
        *,
        truth: Place | None = None,
        results: Place | None = None,
        region: Several[float] | str | None = None,
        mask: Place | None = None,
        leave_out: int | None = None,
        split_half: bool = False,
        both_ways: bool = False,
        anyway: bool = False,
        memory: str | None = None,
        quick: bool = False,
        method: Literal["variance", "normalised", "ncc-first", "ncc-mean"] = "variance",
        range: Several[float] | str | None = None,
        reference: Literal["first", "middle", "last"] | int = "middle",
        disparity_step: float = 0.25,
        window: int | None = None,
        search: Literal["factorised", "exhaustive"] = "factorised",
        semi_global: bool = False,
        interpolation: Literal["linear", "cubic", "b-spline"] = "b-spline",
        ordering_constraint: Literal["on", "off", "auto"] = "auto",
        occlusion: Literal["none", "one-side", "auto"] = "auto",
        min_visible: float = 0.5,
        max_sigma: float = 3,
        min_confidence: float = 0.03,
        wanted_sigma: float = 0.003,
        no_fit: bool = False,
        block_rows: int | None = None,
        progress: Progress | None = None,
    ) -> dict[str, Any]:
        """Evaluate disparity: by truth, left-out frames, or a second match.

        The same as ``epirig evaluate``.

        Parameters
        ----------
        truth
            True disparity of the same reference frame, in px: .pfm, .tiff or .npy.
        results
            Folder of the results to compare. Without it: SEQ/results.
        region
            Region of the picture, by two corners in px. Without it: all of it.
        mask
            Picture of the same size as the frames, whose pixels above half of full white are used.
            With region, pixels must lie in both. Without it: all of them.
        leave_out
            Leave out every Kth frame.
        split_half
            Match odd and even frames separately.
        both_ways
            Match from the first frame and from the last.
        anyway
            Continue although the scan is not closed and the positions of its frames are wrong.
        memory
            Most memory to take, such as 2GiB or 800MB. Frames that are more are packed on disk
            first, and read a part at a time. The results are the same. Without it: half of what is
            free.
        quick
            First look: takes some 60 % of the time. Uses half of the frames if there are a hundred
            or more, looks for edges in small discs only, and searches occluding objects at half the
            resolution, too. Sigma includes what that costs, except for relief finer than the discs;
            objects narrower than some 20 px may be missed.
        method
            Cost function: how the samples along a line are compared.
            - "variance": Variance of the intensities along the line; needs equal illumination.
            - "normalised": Variance of locally normalised frames: for light that varies between
              frames and over the image.
            - "ncc-first": Correlation of windows with the reference frame's window.
            - "ncc-mean": Correlation of windows with their mean.
        range
            Range of disparities, in px over the whole baseline, such as 420..434 or -60..0. Without
            it: found from the data.
        reference
            The reference frame, whose pixels get a disparity: first, middle, last or an index from
            0. Most points of the middle frame are seen by most frames; the paper takes the first.
        disparity_step
            Step between disparity candidates, in px.
        window
            Side of the cost's window, odd, in px. Without it: 3 for variance and normalised, 7 for
            correlation.
        search
            How candidates are searched: by sums over groups of frames, or by every sample as in the
            paper (always so for correlation).
            - "factorised": Sums over groups of neighbouring frames serve many candidates: many
              times faster.
            - "exhaustive": The samples of all frames for each candidate, as in the paper.
        semi_global
            Aggregate costs across rows (semi-global matching): for weak texture on surfaces that
            continue from row to row. The search takes about twice as long.
        interpolation
            Interpolation of frames between pixels in the exhaustive search.
            - "linear": Straight line between the two neighbours.
            - "cubic": Cubic convolution over four neighbours (Keys 1981, a = -1/2).
            - "b-spline": Cubic B-spline through all pixels of the row (Unser 1999), the most
              accurate.
        ordering_constraint
            Whether points keep their order from the first frame to the last.
            - "on": Points keep their order: the paper's strictly increasing mapping.
            - "off": Each pixel by itself: for objects that occlude others.
            - "auto": On, unless the sampled rows show depth edges that no strictly increasing
              mapping allows.
        occlusion
            Whether points may be occluded in part of the sequence.
            - "none": Nothing is occluded: all frames that contain the candidate count.
            - "one-side": A point may be occluded before or after the reference frame.
            - "auto": One side without the ordering constraint, none with it.
        min_visible
            Share of the frames that must see a point, above 0 and at most 1.
        max_sigma
            Reject pixels whose sigma is larger, in px.
        min_confidence
            Reject pixels whose confidence is lower, 0 to 1 (only without the ordering constraint).
        wanted_sigma
            Let the discs of the sub-pixel fit grow where they leave a larger sigma than this, in
            px: up to 115 px. ``float("inf")`` keeps all at one small size.
        no_fit
            Interpolate three costs by a parabola instead of the fit over all frames (always so for
            correlation).
        block_rows
            Match this many rows in one go, at most. Without it: as many as take 768 MiB, and 256 at
            least.
        progress
            Called with what is done, how many parts of it are done, and of how many.
        """
        record: dict[str, Any] = call(
            "evaluate",
            words(
                (None, self.folder, REQUIRED),
                ("--truth", truth, None),
                ("--results", results, None),
                ("--region", region, None),
                ("--mask", mask, None),
                ("--leave-out", leave_out, None),
                ("--split-half", split_half, False),
                ("--both-ways", both_ways, False),
                ("--anyway", anyway, False),
                ("--memory", memory, None),
                ("--quick", quick, False),
                ("--method", method, "variance"),
                ("--range", range, None),
                ("--reference", reference, "middle"),
                ("--disparity-step", disparity_step, 0.25),
                ("--window", window, None),
                ("--search", search, "factorised"),
                ("--semi-global", semi_global, False),
                ("--interpolation", interpolation, "b-spline"),
                ("--ordering-constraint", ordering_constraint, "auto"),
                ("--occlusion", occlusion, "auto"),
                ("--min-visible", min_visible, 0.5),
                ("--max-sigma", max_sigma, 3),
                ("--min-confidence", min_confidence, 0.03),
                ("--wanted-sigma", wanted_sigma, 0.003),
                ("--no-fit", no_fit, False),
                ("--block-rows", block_rows, None),
            ),
            progress,
        )
        return record

    def export(
        self,
        *,
        out: Place,
        map: Literal["disparity", "sigma", "confidence", "cost", "mask", "height", "height-sigma", "height-used", "height-without-form", "height-filtered", "used", "difference", "difference-sigma"] = "disparity",
        results: Place | None = None,
        original: bool = False,
        progress: Progress | None = None,
    ) -> dict[str, Any]:
        """Export a map of the results to the format of another program.

        The same as ``epirig export``.

        Parameters
        ----------
        map
            The map.
            - "disparity": Disparity over the whole baseline.
            - "sigma": Standard uncertainty of the disparity.
            - "confidence": How much better the chosen line is than the best line elsewhere, 0 to 1.
            - "cost": Cost of the chosen line.
            - "mask": Why a pixel has an answer or none, with the values of mask.png.
            - "height": Height as measured.
            - "height-sigma": Standard uncertainty of the height.
            - "height-used": Height as measured, where ``epirig surface`` used it.
            - "height-without-form": Height after removal of the form, as ``epirig surface`` found
              it.
            - "height-filtered": The same between the cut-offs of the filters of ``epirig surface``.
            - "used": Which heights ``epirig surface`` used, with the values of used.png.
            - "difference": Difference of height that ``epirig compare`` found.
            - "difference-sigma": Standard uncertainty of the difference.
        out
            The file to write; an existing file is refused.
        results
            Folder of the results. Without it: SEQ/results.
        original
            Write the map in the pixels of the original image of the reference frame, not of the
            rectified one. Each takes the value of the nearest rectified pixel; values stay as
            measured.
        progress
            Called with what is done, how many parts of it are done, and of how many.
        """
        record: dict[str, Any] = call(
            "export",
            words(
                (None, self.folder, REQUIRED),
                ("--map", map, "disparity"),
                ("--out", out, REQUIRED),
                ("--results", results, None),
                ("--original", original, False),
            ),
            progress,
        )
        return record

    def survey(
        self,
        *,
        bands: int | None = None,
        overwrite: bool = False,
        as_captured: bool = False,
        region: Several[float] | str | None = None,
        mask: Place | None = None,
        anyway: bool = False,
        quick: bool = False,
        method: Literal["variance", "normalised", "ncc-first", "ncc-mean"] = "variance",
        range: Several[float] | str | None = None,
        reference: Literal["first", "middle", "last"] | int = "middle",
        disparity_step: float = 0.25,
        window: int | None = None,
        search: Literal["factorised", "exhaustive"] = "factorised",
        semi_global: bool = False,
        interpolation: Literal["linear", "cubic", "b-spline"] = "b-spline",
        ordering_constraint: Literal["on", "off", "auto"] = "auto",
        occlusion: Literal["none", "one-side", "auto"] = "auto",
        min_visible: float = 0.5,
        max_sigma: float = 3,
        min_confidence: float = 0.03,
        wanted_sigma: float = 0.003,
        no_fit: bool = False,
        block_rows: int | None = None,
        progress: Progress | None = None,
    ) -> dict[str, Any]:
        """Plan the match in bands of rows, as SEQ/bands: find what holds for the whole picture, and
        pack the frames.

        The same as ``epirig match --survey``.

        Parameters
        ----------
        bands
            Number of bands. Without it: as many as there are blocks, see block_rows.
        overwrite
            Replaces the plan of another match.
        as_captured
            Match the frames as captured, without the calibration of ``epirig calibrate``.
        region
            Region of the picture, by two corners in px. Without it: all of it.
        mask
            Picture of the same size as the frames, whose pixels above half of full white are used.
            With region, pixels must lie in both. Without it: all of them.
        anyway
            Continue although the scan is not closed and the positions of its frames are wrong.
        quick
            First look: takes some 60 % of the time. Uses half of the frames if there are a hundred
            or more, looks for edges in small discs only, and searches occluding objects at half the
            resolution, too. Sigma includes what that costs, except for relief finer than the discs;
            objects narrower than some 20 px may be missed.
        method
            Cost function: how the samples along a line are compared.
            - "variance": Variance of the intensities along the line; needs equal illumination.
            - "normalised": Variance of locally normalised frames: for light that varies between
              frames and over the image.
            - "ncc-first": Correlation of windows with the reference frame's window.
            - "ncc-mean": Correlation of windows with their mean.
        range
            Range of disparities, in px over the whole baseline, such as 420..434 or -60..0. Without
            it: found from the data.
        reference
            The reference frame, whose pixels get a disparity: first, middle, last or an index from
            0. Most points of the middle frame are seen by most frames; the paper takes the first.
        disparity_step
            Step between disparity candidates, in px.
        window
            Side of the cost's window, odd, in px. Without it: 3 for variance and normalised, 7 for
            correlation.
        search
            How candidates are searched: by sums over groups of frames, or by every sample as in the
            paper (always so for correlation).
            - "factorised": Sums over groups of neighbouring frames serve many candidates: many
              times faster.
            - "exhaustive": The samples of all frames for each candidate, as in the paper.
        semi_global
            Aggregate costs across rows (semi-global matching): for weak texture on surfaces that
            continue from row to row. The search takes about twice as long.
        interpolation
            Interpolation of frames between pixels in the exhaustive search.
            - "linear": Straight line between the two neighbours.
            - "cubic": Cubic convolution over four neighbours (Keys 1981, a = -1/2).
            - "b-spline": Cubic B-spline through all pixels of the row (Unser 1999), the most
              accurate.
        ordering_constraint
            Whether points keep their order from the first frame to the last.
            - "on": Points keep their order: the paper's strictly increasing mapping.
            - "off": Each pixel by itself: for objects that occlude others.
            - "auto": On, unless the sampled rows show depth edges that no strictly increasing
              mapping allows.
        occlusion
            Whether points may be occluded in part of the sequence.
            - "none": Nothing is occluded: all frames that contain the candidate count.
            - "one-side": A point may be occluded before or after the reference frame.
            - "auto": One side without the ordering constraint, none with it.
        min_visible
            Share of the frames that must see a point, above 0 and at most 1.
        max_sigma
            Reject pixels whose sigma is larger, in px.
        min_confidence
            Reject pixels whose confidence is lower, 0 to 1 (only without the ordering constraint).
        wanted_sigma
            Let the discs of the sub-pixel fit grow where they leave a larger sigma than this, in
            px: up to 115 px. ``float("inf")`` keeps all at one small size.
        no_fit
            Interpolate three costs by a parabola instead of the fit over all frames (always so for
            correlation).
        block_rows
            Match this many rows in one go, at most. Without it: as many as take 768 MiB, and 256 at
            least.
        progress
            Called with what is done, how many parts of it are done, and of how many.
        """
        record: dict[str, Any] = call(
            "match",
            words(
                (None, self.folder, REQUIRED),
                ("--bands", bands, None),
                ("--overwrite", overwrite, False),
                ("--as-captured", as_captured, False),
                ("--region", region, None),
                ("--mask", mask, None),
                ("--anyway", anyway, False),
                ("--quick", quick, False),
                ("--method", method, "variance"),
                ("--range", range, None),
                ("--reference", reference, "middle"),
                ("--disparity-step", disparity_step, 0.25),
                ("--window", window, None),
                ("--search", search, "factorised"),
                ("--semi-global", semi_global, False),
                ("--interpolation", interpolation, "b-spline"),
                ("--ordering-constraint", ordering_constraint, "auto"),
                ("--occlusion", occlusion, "auto"),
                ("--min-visible", min_visible, 0.5),
                ("--max-sigma", max_sigma, 3),
                ("--min-confidence", min_confidence, 0.03),
                ("--wanted-sigma", wanted_sigma, 0.003),
                ("--no-fit", no_fit, False),
                ("--block-rows", block_rows, None),
                ("--survey", True, False),
            ),
            progress,
        )
        return record

    def match_band(
        self,
        band: int,
        *,
        progress: Progress | None = None,
    ) -> dict[str, Any]:
        """Match one band of the plan, from 0 on, with the options of the plan. What is matched
        already stays.

        The same as ``epirig match --band``.

        Parameters
        ----------
        band
            Its number.
        progress
            Called with what is done, how many parts of it are done, and of how many.
        """
        record: dict[str, Any] = call(
            "match",
            words(
                (None, self.folder, REQUIRED),
                ("--band", band, REQUIRED),
            ),
            progress,
        )
        return record

    def merge(
        self,
        *,
        out: Place | None = None,
        overwrite: bool = False,
        figure_row: int | None = None,
        progress: Progress | None = None,
    ) -> Results:
        """Join all bands of the plan to the results: the same, to the last bit, as without bands.

        The same as ``epirig match --merge``.

        Parameters
        ----------
        out
            Folder of the results. Without it: SEQ/results.
        overwrite
            Replace existing results.
        figure_row
            Row of the reference frame that the figures show. Without it: the middle one.
        progress
            Called with what is done, how many parts of it are done, and of how many.
        """
        record: dict[str, Any] = call(
            "match",
            words(
                (None, self.folder, REQUIRED),
                ("--out", out, None),
                ("--overwrite", overwrite, False),
                ("--figure-row", figure_row, None),
                ("--merge", True, False),
            ),
            progress,
        )
        return Results(self.folder / "results" if out is None else out, record)
