#!/usr/bin/env python3
"""Makes the images in this folder by other programs (NumPy, Pillow, tifffile), and expected.csv with their grey values.

    python3 crates/data/tests/images/make.py
"""

import csv
from pathlib import Path

import numpy as np
import tifffile
from PIL import Image

HERE = Path(__file__).parent
ROWS, COLUMNS = 5, 7
random = np.random.default_rng(1)
grey8 = random.integers(0, 256, (ROWS, COLUMNS), dtype=np.uint8)
grey16 = random.integers(0, 65536, (ROWS, COLUMNS), dtype=np.uint16)
rgb8 = random.integers(0, 256, (ROWS, COLUMNS, 3), dtype=np.uint8)
rgb16 = random.integers(0, 65536, (ROWS, COLUMNS, 3), dtype=np.uint16)
alpha8 = random.integers(0, 256, (ROWS, COLUMNS, 1), dtype=np.uint8)
alpha16 = random.integers(0, 65536, (ROWS, COLUMNS, 1), dtype=np.uint16)
ink8 = random.integers(0, 256, (ROWS, COLUMNS, 4), dtype=np.uint8)
table = []


def luma(rgb):
    return np.rint(rgb[..., :3].astype(float) @ [0.2126, 0.7152, 0.0722])


def expect(name, bits, values):
    table.append([name, bits, COLUMNS, *np.asarray(values).astype(int).ravel()])


def refuse(name, word):
    table.append([name, "refused", word])


def tif(name, data, **options):
    tifffile.imwrite(HERE / name, data, metadata=None, software=None, **options)


def pil(name, image, **options):
    image.save(HERE / name, **options)


tif("grey16-big-endian.tif", grey16, byteorder=">")
expect("grey16-big-endian.tif", 16, grey16)
tif("rgb16-planar.tif", np.moveaxis(rgb16, 2, 0), photometric="rgb", planarconfig="separate")
expect("rgb16-planar.tif", 16, luma(rgb16))
tif("rgb8-planar-deflate.tif", np.moveaxis(rgb8, 2, 0), photometric="rgb", planarconfig="separate", compression="zlib")
expect("rgb8-planar-deflate.tif", 8, luma(rgb8))
tif("rgba16.tif", np.concatenate([rgb16, alpha16], 2), photometric="rgb", extrasamples=["unassalpha"])
expect("rgba16.tif", 16, luma(rgb16))
tif("cmyk8.tif", ink8, photometric="separated")
paper = (255 - ink8[..., :3].astype(float)) * (255 - ink8[..., 3:].astype(float)) / 255
expect("cmyk8.tif", 8, luma(paper))
tif("cmyk8-planar.tif", np.moveaxis(ink8, 2, 0), photometric="separated", planarconfig="separate")
refuse("cmyk8-planar.tif", "grey PNG")
tif("float32.tif", grey16.astype(np.float32) / 65535)
refuse("float32.tif", "floating-point")
tif("rgb-float32.tif", rgb16.astype(np.float32), photometric="rgb")
refuse("rgb-float32.tif", "floating-point")
tif("stack.tif", np.stack([grey8, grey8]), photometric="minisblack")
refuse("stack.tif", "several images")

colours = Image.fromarray(rgb8).quantize(16)
shown = np.asarray(colours.convert("RGB"))
for name, options in [
    ("palette.tif", {}),
    ("palette-lzw.tif", {"compression": "tiff_lzw"}),
    ("palette.png", {}),
    ("palette.bmp", {}),
]:
    pil(name, colours, **options)
    expect(name, 8, luma(shown))
colour_map = np.stack([random.integers(0, 256, 256) for _ in range(3)]).astype(np.uint16) * 257
tif("palette-big-endian.tif", grey8, photometric="palette", colormap=colour_map, byteorder=">")
expect("palette-big-endian.tif", 8, luma(np.moveaxis(colour_map[:, grey8] // 257, 0, 2)))

pil("rgba8.png", Image.fromarray(np.concatenate([rgb8, alpha8], 2)))
expect("rgba8.png", 8, luma(rgb8))
pil("grey-alpha8.png", Image.fromarray(np.concatenate([grey8[..., None], alpha8], 2), mode="LA"))
expect("grey-alpha8.png", 8, grey8)
pil("grey16.png", Image.fromarray(grey16))
expect("grey16.png", 16, grey16)
pil("grey8.bmp", Image.fromarray(grey8))
expect("grey8.bmp", 8, grey8)
pil("rgb8.bmp", Image.fromarray(rgb8))
expect("rgb8.bmp", 8, luma(rgb8))
pil("grey8.pgm", Image.fromarray(grey8))
expect("grey8.pgm", 8, grey8)
pil("rgb8.ppm", Image.fromarray(rgb8))
expect("rgb8.ppm", 8, luma(rgb8))
(HERE / "grey16.pgm").write_bytes(b"P5\n%d %d\n65535\n" % (COLUMNS, ROWS) + grey16.astype(">u2").tobytes())
expect("grey16.pgm", 16, grey16)
(HERE / "rgb16.ppm").write_bytes(b"P6\n%d %d\n65535\n" % (COLUMNS, ROWS) + rgb16.astype(">u2").tobytes())
expect("rgb16.ppm", 16, luma(rgb16))

with open(HERE / "expected.csv", "w", newline="") as file:
    csv.writer(file, lineterminator="\n").writerows(table)
