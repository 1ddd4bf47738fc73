"""A scene with its truth in closed form, rendered without any of epirig's code.

A point at (x, y) of the first frame lies at x + tau d(x, y) in a frame at tau in [0, 1]: d is the disparity in px over the whole
baseline. The background is a smooth, curved, slanted surface; two patches stand before it, nearer by a step. Each surface carries a
random texture, painted on the coordinates of the first frame.
"""

from dataclasses import dataclass

import numba
import numpy as np

OVERSAMPLING = 8
"""Samples of the stored texture per pixel."""
STEPS_PX = (4.0, 0.5)
"""How much more disparity each patch has than the background behind it, in px."""


@dataclass(frozen=True)
class Size:
    """Extent of a scene."""

    side_px: int
    frames: int

    @property
    def range_px(self):
        """(least, largest) disparity to search; the scene's lie well inside."""
        return 10.0, 10.0 + 60.0 * self.side_px / 1024


FULL = Size(1024, 100)
SMALL = Size(256, 40)


@dataclass(frozen=True)
class Scene:
    """Frames as an 8-bit camera gives them, and the truth of the first one."""

    size: Size
    frames: np.ndarray
    """uint8, frames x rows x columns."""
    disparity: np.ndarray
    """float64, rows x columns, px."""
    visible: np.ndarray
    """bool: the whole pixel is seen in the last frame, too."""
    near_step: np.ndarray
    """bool: within 15 px of a patch's outline."""
    gradient_rms: float
    """RMS of the texture's slope along x, in DN/px."""


def texture(side_px, gradient_rms, rng):
    """Band-limited random texture, periodic along x, with `OVERSAMPLING` samples per px: rows x samples, in DN.

    White noise through a Gaussian point spread of 0.8 px, nothing beyond 0.4 cycles/px: what lens and pixel leave. Cubic interpolation
    between the stored samples is off by less than 2e-4 of a component's amplitude (3/128 w^4, w <= 2 pi 0.4 / 8), some 0.002 DN.
    """
    columns = side_px + side_px // 4
    spectrum = np.fft.rfft2(rng.standard_normal((side_px, columns)))
    fy = np.fft.fftfreq(side_px)[:, None]
    fx = np.fft.rfftfreq(columns)[None, :]
    square = fx**2 + fy**2
    spectrum *= np.exp(-2 * (np.pi * 0.8) ** 2 * square) * (square < 0.4**2)
    spectrum[0, 0] = 0
    slope = np.fft.irfft2(spectrum * 2j * np.pi * fx, s=(side_px, columns))
    spectrum *= gradient_rms / np.sqrt(np.mean(slope**2))
    rows = np.fft.ifft(spectrum, axis=0)
    return np.fft.irfft(rows, n=columns * OVERSAMPLING, axis=1) * OVERSAMPLING


@numba.njit(inline="always")
def background_px(x, y, side):
    """Disparity of the background at (x, y) of the first frame: a cubic surface over the unit square."""
    u, v = x / side, y / side
    range_px = 60.0 * side / 1024
    return 10.0 + range_px * (0.12 + 0.35 * u + 0.12 * v + 1.2 * u * (u - 0.5) * (u - 0.9) + 0.3 * u * v * (1 - v))


@numba.njit(inline="always")
def surface_x(x_t, y, tau, step, side):
    """Where in the first frame the surface lies that a frame shows at x_t. The map contracts by a tenth: 12 rounds leave 1e-11 px."""
    x = x_t
    for _ in range(12):
        x = x_t - tau * (background_px(x, y, side) + step)
    return x


@numba.njit(inline="always")
def painted(row, x):
    """The texture of a row at x px, by the cubic through four stored samples."""
    place = x * OVERSAMPLING
    whole = int(np.floor(place))
    f = place - whole
    n = row.shape[0]
    a, b, c, d = row[(whole - 1) % n], row[whole % n], row[(whole + 1) % n], row[(whole + 2) % n]
    return (
        -f * (f - 1) * (f - 2) / 6 * a
        + (f + 1) * (f - 1) * (f - 2) / 2 * b
        - (f + 1) * f * (f - 2) / 2 * c
        + (f + 1) * f * (f - 1) / 6 * d
    )


@numba.njit(parallel=True)
def irradiance(tau, side, textures, patches, steps):
    """The frame at tau without noise, in DN. A pixel that an outline crosses is a mixture by area."""
    image = np.empty((side, side))
    for y in numba.prange(side):
        for x_t in range(side):
            value = 128.0 + painted(textures[0, y], surface_x(x_t, y, tau, 0.0, side))
            for p in range(steps.shape[0]):
                top, bottom, left, right = patches[p]
                if not top <= y < bottom:
                    continue
                begin = left - 0.5 + tau * (background_px(left - 0.5, y, side) + steps[p])
                end = right - 0.5 + tau * (background_px(right - 0.5, y, side) + steps[p])
                share = min(x_t + 0.5, end) - max(x_t - 0.5, begin)
                if share > 0:
                    front = 128.0 + painted(textures[p + 1, y], surface_x(x_t, y, tau, steps[p], side))
                    value += share * (front - value)
            image[y, x_t] = value
    return image


def truth(size, patches):
    """Disparity, visibility in the last frame, and nearness to an outline, of every pixel of the first frame."""
    side = size.side_px
    y, x = np.mgrid[0:side, 0:side].astype(float)
    behind = background_px(x, y, float(side))
    disparity = behind.copy()
    visible = np.ones((side, side), bool)
    near_step = np.zeros((side, side), bool)
    for (top, bottom, left, right), step in zip(patches, STEPS_PX):
        inside = np.zeros((side, side), bool)
        inside[top:bottom, left:right] = True
        disparity[inside] = behind[inside] + step
        begin = left - 0.5 + background_px(left - 0.5, y, float(side)) + step
        end = right - 0.5 + background_px(right - 0.5, y, float(side)) + step
        rows = np.zeros((side, side), bool)
        rows[top:bottom] = True
        visible &= ~(rows & ~inside & (x + behind + 0.5 > begin) & (x + behind - 0.5 < end))
        around = np.zeros((side, side), bool)
        around[max(top - 15, 0) : bottom + 15, max(left - 15, 0) : right + 15] = True
        around[top + 15 : bottom - 15, left + 15 : right - 15] = False
        near_step |= around
    visible &= x + disparity <= side - 1
    return disparity, visible, near_step


def render(size, gradient_rms=10.0, noise_dn=1.0, seed=1):
    """Renders all frames; noise is Gaussian, then rounded to 8 bit."""
    rng = np.random.default_rng(seed)
    side = size.side_px
    shares = ((0.15, 0.45, 0.12, 0.38), (0.55, 0.85, 0.50, 0.80))
    patches = [tuple(int(share * side) for share in patch) for patch in shares]
    textures = np.stack([texture(side, gradient_rms, rng) for _ in range(len(STEPS_PX) + 1)])
    frames = np.empty((size.frames, side, side), np.uint8)
    for t in range(size.frames):
        light = irradiance(t / (size.frames - 1), side, textures, np.array(patches), np.array(STEPS_PX))
        noisy = light + noise_dn * rng.standard_normal(light.shape)
        frames[t] = np.clip(np.rint(noisy), 0, 255)
    disparity, visible, near_step = truth(size, patches)
    return Scene(size, frames, disparity, visible, near_step, gradient_rms)
