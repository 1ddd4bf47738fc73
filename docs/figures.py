#!/usr/bin/env python3
"""Draws the figures of the book as SVG, with the standard library only.

figures.py           writes docs/src/images/*.svg
figures.py --check   exits with code 1 if a file differs from what would be written
"""
import math
import pathlib
import sys

IMAGES = pathlib.Path(__file__).resolve().parent / "src/images"
INK, GREY, PALE = "#222222", "#888888", "#dddddd"
BLUE, ORANGE, GREEN = "#1f5fa8", "#c65d00", "#2a7a3b"


class Picture:
    """A picture under construction, on a white ground so that dark themes show it, too."""

    def __init__(self, width, height):
        self.size = (width, height)
        self.parts = [f'<rect width="{width}" height="{height}" fill="white"/>']

    def line(self, x1, y1, x2, y2, colour=INK, width=1.5, dash=None):
        style = f' stroke-dasharray="{dash}"' if dash else ""
        self.parts.append(
            f'<line x1="{x1:.1f}" y1="{y1:.1f}" x2="{x2:.1f}" y2="{y2:.1f}" stroke="{colour}" '
            f'stroke-width="{width}"{style}/>'
        )

    def path(self, points, colour=INK, width=1.5):
        text = " ".join(f"{x:.1f},{y:.1f}" for x, y in points)
        self.parts.append(f'<polyline points="{text}" fill="none" stroke="{colour}" stroke-width="{width}"/>')

    def box(self, x, y, width, height, fill=PALE, edge="none"):
        self.parts.append(
            f'<rect x="{x:.1f}" y="{y:.1f}" width="{width:.1f}" height="{height:.1f}" fill="{fill}" stroke="{edge}"/>'
        )

    def dot(self, x, y, colour=INK, radius=3.0):
        self.parts.append(f'<circle cx="{x:.1f}" cy="{y:.1f}" r="{radius}" fill="{colour}"/>')

    def text(self, x, y, words, colour=INK, anchor="start", size=14):
        words = words.replace("&", "&amp;").replace("<", "&lt;")
        self.parts.append(
            f'<text x="{x:.1f}" y="{y:.1f}" fill="{colour}" text-anchor="{anchor}" font-size="{size}">{words}</text>'
        )

    def svg(self):
        width, height = self.size
        head = (
            f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" width="{width}" '
            f'height="{height}" font-family="sans-serif">'
        )
        return "\n".join([head, *self.parts, "</svg>", ""])


def axes(picture, left, top, right, bottom, across, down):
    picture.line(left, top, right, top)
    picture.line(left, top, left, bottom)
    picture.text(right, top - 8, across, anchor="end")
    picture.text(left - 8, bottom, down, anchor="end")


def epi():
    """An EPI: straight lines, the reference frame, and a disparity."""
    picture = Picture(640, 330)
    left, top, right, bottom = 110, 50, 610, 270
    axes(picture, left, top, right, bottom, "column x", "frame t")
    picture.text(left - 8, top + 5, "first, tau = 0", anchor="end")
    picture.text(left - 8, bottom - 18, "last, tau = 1", anchor="end")
    for start, disparity, colour, name in [(150, 60, BLUE, "far"), (280, 110, GREEN, "nearer"), (390, 190, ORANGE, "near")]:
        picture.line(start, top, start + disparity, bottom, colour, 3)
        picture.text(start - 6, top + 20, name, colour, "end")
    picture.line(390, top, 390, bottom + 14, GREY, 1, "4 4")
    picture.line(580, bottom, 580, bottom + 14, GREY, 1, "4 4")
    picture.line(390, bottom + 10, 580, bottom + 10, ORANGE, 2)
    picture.text(485, bottom + 28, "disparity d = j - i", ORANGE, "middle")
    picture.text(390, top - 8, "i", anchor="middle")
    picture.text(580, bottom - 6, "j", anchor="start")
    picture.line(left, 160, right, 160, GREY, 1, "2 5")
    picture.text(left - 8, 165, "reference r", GREY, "end")
    return picture


def groups():
    """Frames in groups, and candidates that share the sums over a group."""
    picture = Picture(640, 300)
    left, top, step, frames, size = 150, 30, 14, 18, 3
    for t in range(frames):
        y = top + t * step
        if (t // size) % 2 == 0:
            picture.box(left, y - step / 2, 450, step, "#eef3fa")
        picture.line(left, y, left + 450, y, PALE, 1)
    for g in range(frames // size):
        picture.text(left - 10, top + (size * g + 1) * step + 5, f"group {g + 1}", GREY, "end")
    end = top + (frames - 1) * step
    for disparity, colour in [(200, BLUE), (215, GREEN), (230, ORANGE)]:
        picture.line(220, top, 220 + disparity, end, colour, 2)
    for g in range(frames // size):
        middle = top + (size * g + 1) * step
        share = (middle - top) / (end - top)
        x = 220 + 215 * share
        tilt = 215 * step / (end - top)
        picture.line(x - tilt, middle - step, x + tilt, middle + step, INK, 4)
    picture.text(470, 70, "candidates", BLUE)
    picture.text(470, 90, "(thin, coloured)", BLUE, size=12)
    picture.text(470, 120, "sums over a group", INK)
    picture.text(470, 140, "(thick): one slope", INK, size=12)
    picture.text(470, 157, "serves all three", INK, size=12)
    return picture


def ordering():
    """The mapping: a path through columns and candidates whose rise and fall are limited."""
    picture = Picture(640, 300)
    left, top, cell = 110, 30, 20
    columns, candidates = 24, 11
    picture.box(left, top, columns * cell, candidates * cell, "#f7f7f7")
    for x in range(columns + 1):
        picture.line(left + x * cell, top, left + x * cell, top + candidates * cell, PALE, 1)
    for k in range(candidates + 1):
        picture.line(left, top + k * cell, left + columns * cell, top + k * cell, PALE, 1)
    path = [2, 2, 3, 3, 3, 4, 4, 4, 5, 7, 8, 8, 8, 8, 7, 7, 7, 6, 6, 6, 6, 5, 5, 5]
    for x, k in enumerate(path):
        picture.box(left + x * cell, top + k * cell, cell - 1, cell - 1, BLUE)
    picture.text(left + columns * cell, top + candidates * cell + 18, "column x of the reference frame", anchor="end")
    picture.text(left - 8, top + 14, "small d", anchor="end")
    picture.text(left - 8, top + candidates * cell - 5, "large d", anchor="end")
    picture.text(left, top + candidates * cell + 18, "one candidate for each column", BLUE)
    picture.text(left, top + candidates * cell + 38, "from column to column d changes by less than the ordering constraint allows", GREY, size=12)
    return picture


def occlusion():
    """A nearer surface covers a farther point from some frame on."""
    picture = Picture(640, 320)
    left, top, right, bottom = 110, 40, 610, 280
    axes(picture, left, top, right, bottom, "column x", "frame t")
    strip = [(200, top), (290, top), (530, bottom), (440, bottom)]
    points = " ".join(f"{x},{y}" for x, y in strip)
    picture.parts.append(f'<polygon points="{points}" fill="#f3d9c2" stroke="{ORANGE}"/>')
    start, drift = 350, 60
    meet = (start - 290) / (240 - drift)
    y = top + meet * (bottom - top)
    picture.line(start, top, start + drift * meet, y, BLUE, 3)
    picture.line(start + drift * meet, y, start + drift, bottom, BLUE, 1.5, "3 5")
    picture.dot(start + drift * meet, y, BLUE, 4)
    picture.text(start + drift * meet + 10, y + 4, "tau' = (x - x') / (d' - d)", BLUE)
    picture.text(215, top + 28, "nearer, d'", ORANGE)
    picture.text(start + 8, top + 20, "farther, d: visible", BLUE)
    picture.text(start + 66, bottom - 26, "occluded", BLUE)
    return picture


def observation():
    """Intensity along a line whose disparity is a little wrong."""
    picture = Picture(640, 260)
    left, top, right, bottom = 90, 30, 600, 220
    picture.line(left, bottom, right, bottom)
    picture.line(left, top, left, bottom)
    picture.text(right, bottom + 22, "tau' = tau - tau_r", anchor="end")
    picture.text(left - 8, top + 10, "I", anchor="end")
    noise = [3, -7, 5, 2, -4, 8, -6, 1, 4, -3, 6, -8, 2, -2, 7, -5, 3, -1, 5, -6]
    for t, jitter in enumerate(noise):
        x = left + 20 + t * 25
        picture.dot(x, 180 - 5.2 * t + jitter, GREY)
    picture.line(left + 20, 180, left + 20 + 19 * 25, 180 - 5.2 * 19, BLUE, 2.5)
    picture.text(left + 40, 70, "slope b = g (d0 - d)", BLUE)
    picture.text(left + 40, 92, "so the pixel observes d = d0 - b / g", BLUE)
    picture.text(left + 40, 114, "with the weight w = g g S", BLUE)
    return picture


def locking():
    """How far disparities are exposed to pixel locking: the factor of the first harmonic, 21 frames."""
    frames, reference = 21, 10
    tau = [t / (frames - 1) for t in range(frames)]
    mean = sum(tau) / frames
    spread = sum((value - mean) ** 2 for value in tau)

    def factor(disparity):
        slope = sum(
            (value - mean) * math.sin(2 * math.pi * disparity * (value - tau[reference])) for value in tau
        )
        return -slope / spread

    picture = Picture(640, 280)
    left, right, zero, scale = 70, 610, 140, 42
    picture.line(left, zero, right, zero)
    for value in (-2, -1, 1, 2):
        picture.line(left, zero - value * scale, right, zero - value * scale, PALE, 1)
        picture.text(left - 8, zero - value * scale + 5, f"{value:+d}", anchor="end", size=12)
    picture.text(left - 8, zero + 5, "0", anchor="end", size=12)
    low, high = 0.0, 30.0
    place = lambda disparity: left + (disparity - low) / (high - low) * (right - left)
    steps = [low + (high - low) * index / 600 for index in range(601)]
    picture.path([(place(d), zero - factor(d) * scale) for d in steps], BLUE, 2)
    for disparity in (0, 10, 20, 30):
        picture.text(place(disparity), 262, f"{disparity} px", anchor="middle", size=12)
    picture.line(place(20), 20, place(20), 248, GREY, 1, "4 4")
    picture.text(place(20) + 6, 28, "d = N - 1", GREY)
    picture.text(right, 20, "disparity d", anchor="end")
    return picture


FIGURES = [epi, groups, ordering, occlusion, observation, locking]


def main():
    differing = 0
    for figure in FIGURES:
        path = IMAGES / f"{figure.__name__}.svg"
        drawn = figure().svg()
        if sys.argv[1:] == ["--check"]:
            if not path.exists() or path.read_text() != drawn:
                print(f"{path}: not what figures.py draws; run docs/figures.py")
                differing += 1
        elif sys.argv[1:]:
            sys.exit(__doc__)
        else:
            path.write_text(drawn)
    sys.exit(1 if differing else 0)


if __name__ == "__main__":
    main()
