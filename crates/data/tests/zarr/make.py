"""Writes small Zarr arrays of frames, as other software does: run it with zarr-python 3 in this folder.

Sample (t, y, x) is 40 t + 7 y + x, times 100 where it has 16 bit.
"""

import shutil
from pathlib import Path

import numpy
import zarr
from zarr.codecs import BytesCodec, Crc32cCodec, GzipCodec

FRAMES, ROWS, COLUMNS = 3, 5, 7
t, y, x = numpy.meshgrid(range(FRAMES), range(ROWS), range(COLUMNS), indexing="ij")
narrow = (40 * t + 7 * y + x).astype(numpy.uint8)
wide = (100 * (40 * t + 7 * y + x)).astype(numpy.uint16)

for name in ["wide.zarr", "plain.zarr", "shards.zarr", "image.zarr", "second.zarr", "several.zarr", "real.zarr"]:
    shutil.rmtree(name, ignore_errors=True)

# As zarr-python writes by default: chunks packed by Zstandard.
zarr.create_array("plain.zarr", data=narrow, chunks=(2, 3, 4))
# Shards of chunks, big-endian, gzip, with a checksum.
array = zarr.create_array(
    "shards.zarr",
    shape=wide.shape,
    dtype=wide.dtype,
    chunks=(1, 2, 7),
    shards=(1, 6, 7),
    serializer=BytesCodec(endian="big"),
    compressors=[GzipCodec(level=3), Crc32cCodec()],
)
array[:] = wide
# An OME-NGFF image of five dimensions, with a smaller copy.
image = zarr.create_group("image.zarr")
image.create_array("0", data=wide[:, None, None], chunks=(1, 1, 1, 5, 7), dimension_names=["t", "c", "z", "y", "x"])
image.create_array("1", data=wide[:, None, None, ::2, ::2], chunks=(1, 1, 1, 3, 4))
# Version 2, packed by gzip.
second = zarr.create_array(
    "second.zarr", shape=wide.shape, dtype=wide.dtype, chunks=(1, 5, 7), zarr_format=2, compressors=None
)
second[:] = wide
# Chunks that are larger than the array, in another order of dimensions, with a channel behind the columns.
extended = zarr.create_array(
    "wide.zarr",
    shape=(*wide.shape, 1),
    dtype=wide.dtype,
    chunks=(2, 8, 4, 3),
    filters=[zarr.codecs.TransposeCodec(order=(2, 0, 3, 1))],
    fill_value=7,
)
extended[:2] = wide[:2, :, :, None]
# A group of arrays of which none is the frames.
several = zarr.create_group("several.zarr")
several.create_array("left", data=narrow, chunks=(3, 5, 7))
several.create_array("right", data=narrow, chunks=(3, 5, 7))
zarr.create_array("real.zarr", data=narrow.astype(numpy.float32), chunks=(3, 5, 7))
print(sum(1 for path in Path().rglob("*") if path.is_file()), "files")
