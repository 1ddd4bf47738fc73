"""Four scenes with their truth in closed form, rendered without any of epirig's code: what is easy, fine, ambiguous and narrow.

Conventions are those of scene.py: a point at (x, y) of the first frame lies at x + tau d(x, y) in a frame at tau in [0, 1].
A scene is a background and, in front of it, upright bars. Each surface carries a texture, painted on the coordinates of the first
frame. Textures are band-limited and evaluated at points; pixels that an outline crosses are mixed by area.
"""

from dataclasses import dataclass

import numba
import numpy as np

from scene import painted, texture

ROWS, COLUMNS, FRAMES = 192, 384, 60
GRADIENT_RMS = 10.0
"""RMS of the slope of the texture along x, in DN/px."""
NOISE_DN = 1.0
BAR_ROWS = (16, 176)
BARS = ((40, 2), (80, 3), (122, 5), (166, 8), (214, 12), (264, 20))
"""(first column, width) of each bar in the first frame, in px."""
BAR_PX = 40.0
"""Disparity of the bars; the background's is 28 to 32 px."""


@dataclass(frozen=True)
class Scene:
    """Frames as an 8-bit camera gives them, and the truth of the first one."""

    name: str
    title: str
    range_px: tuple
    """(least, largest) disparity to search."""
    frames: np.ndarray
    """uint8, frames x rows x columns."""
    disparity: np.ndarray
    """float64, rows x columns, px."""
    slant: np.ndarray
    """Derivative of the disparity along x, px/px: the truth at places beside the centre of a pixel."""
    visible: np.ndarray
    """bool: the whole pixel is seen in the last frame, too."""


def edge_px(x, y):
    """The edge of a cube, towards the camera: two planes, that is, two affine disparities. The edge leans by 0.1 px/px."""
    from_edge = x - (190 + 0.1 * (y - ROWS / 2))
    return 42.0 + np.where(from_edge < 0, 0.08, -0.05) * from_edge + 0.01 * (y - ROWS / 2)


HOLLOW_PX = 0.1
"""Depth of the hollows of the tile, in px of disparity."""


def hollow_share(x):
    """0 on the ridges of the tile, 1 in its hollows, smooth between: hollows are 24 px of 48 wide, with flanks of 4 px."""
    phase = np.abs((x + 12) % 48 - 24)
    share = np.clip((14 - phase) / 4, 0, 1)
    return share**2 * (3 - 2 * share)


def tile_px(x, y):
    """The paper's tile: a plane with upright hollows."""
    return 40.0 + 1.5 * x / COLUMNS + 0.8 * y / ROWS - HOLLOW_PX * hollow_share(x)


def curved_px(x, y):
    """A smooth, curved surface, slanted by up to 0.07 px/px."""
    u, v = x / COLUMNS, y / ROWS
    return 36.0 + 8 * np.sin(3 * u + 0.8 * v) + 3 * v * (1 - v)


def behind_px(x, y):
    """The background of the bars: a plane."""
    return 28.0 + 3 * x / COLUMNS + y / ROWS


def random_texture(rng):
    """White noise after lens and pixel, as in scene.py; its period along x is longer than the frame."""
    return texture(COLUMNS, GRADIENT_RMS, rng)[:ROWS]


def repeated_texture(rng):
    """A cell of 10 x 8 px that repeats exactly, as a print or a weave does."""
    cell = texture(8, GRADIENT_RMS, rng)
    return np.tile(cell, (ROWS // cell.shape[0], 1))


@numba.njit
def sample(rows, x):
    """The texture at x px of each row."""
    value = np.empty(x.shape)
    for v in range(x.shape[0]):
        for u in range(x.shape[1]):
            value[v, u] = painted(rows[v], x[v, u])
    return value


def frame_at(tau, surface, textures, bars):
    """The frame at tau without noise, in DN."""
    y, x_t = np.mgrid[0:ROWS, 0:COLUMNS].astype(float)
    x = x_t
    for _ in range(20):
        # The map contracts at least by a twelfth: less than 1e-10 px are left.
        x = x_t - tau * surface(x, y)
    image = sample(textures[0], x)
    top, bottom = BAR_ROWS
    for left, width in bars:
        begin = left - 0.5 + tau * BAR_PX
        share = np.clip(np.minimum(x_t + 0.5, begin + width) - np.maximum(x_t - 0.5, begin), 0, 1)
        share[:top] = share[bottom:] = 0
        image += share * (sample(textures[1], x_t - tau * BAR_PX) - image)
    return 128 + image


def truth(surface, bars):
    """Disparity, its slant, and visibility in the last frame, of every pixel of the first frame."""
    y, x = np.mgrid[0:ROWS, 0:COLUMNS].astype(float)
    disparity = surface(x, y)
    slant = surface(x + 0.5, y) - surface(x - 0.5, y)
    at_end = x + disparity
    inside = np.zeros((ROWS, COLUMNS), bool)
    covered = inside.copy()
    rows = slice(*BAR_ROWS)
    for left, width in bars:
        inside[rows, left : left + width] = True
        begin = left - 0.5 + BAR_PX
        covered[rows] |= (at_end[rows] + 0.5 > begin) & (at_end[rows] - 0.5 < begin + width)
    disparity = np.where(inside, BAR_PX, disparity)
    slant = np.where(inside, 0, slant)
    return disparity, slant, (inside | ~covered) & (x + disparity <= COLUMNS - 1)


SCENES = {
    "edge": ("The edge of a cube", (20.0, 50.0), edge_px, random_texture, ()),
    "tile": ("The tile: hollows of 0.1 px", (30.0, 50.0), tile_px, random_texture, ()),
    "repetition": ("A texture that repeats every 10 px", (20.0, 55.0), curved_px, repeated_texture, ()),
    "bars": ("Bars of 2 to 20 px, 8 to 12 px in front of a background", (20.0, 50.0), behind_px, random_texture, BARS),
}


def render(name, seed=1):
    """Renders all frames of a scene; noise is Gaussian, then rounded to 8 bit."""
    title, range_px, surface, paint, bars = SCENES[name]
    rng = np.random.default_rng(seed)
    textures = [paint(rng), random_texture(rng)]
    frames = np.empty((FRAMES, ROWS, COLUMNS), np.uint8)
    for t in range(FRAMES):
        light = frame_at(t / (FRAMES - 1), surface, textures, bars)
        frames[t] = np.clip(np.rint(light + NOISE_DN * rng.standard_normal(light.shape)), 0, 255)
    return Scene(name, title, range_px, frames, *truth(surface, bars))
