"""Makes the images of this folder, with Pillow: what another program writes about the time."""

import pathlib

from PIL import Image, TiffImagePlugin

HERE = pathlib.Path(__file__).parent
MAKE, EXIF_IFD, TIME, FRACTION = 0x010F, 0x8769, 0x9003, 0x9291


def image():
    values = bytes((31 * x * x + 7 * y * x) % 251 for y in range(24) for x in range(32))
    return Image.frombytes("L", (32, 24), values)


def save(name, tags):
    exif = Image.Exif()
    exif[MAKE] = "camera"
    exif.get_ifd(EXIF_IFD).update(tags)
    image().save(HERE / name, exif=exif)


save("fraction.jpg", {TIME: "2024:05:17 09:30:21", FRACTION: "25"})
save("whole.png", {TIME: "2024:05:17 09:30:21"})
tags = TiffImagePlugin.ImageFileDirectory_v2()
tags[EXIF_IFD] = {TIME: "2024:05:17 09:30:21"}
image().save(HERE / "whole.tif", tiffinfo=tags)
save("unset.jpg", {TIME: "    :  :     :  :  "})
save("impossible.jpg", {TIME: "2024:02:30 09:30:21"})
image().save(HERE / "none.jpg")
