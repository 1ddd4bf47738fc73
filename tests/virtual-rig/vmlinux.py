#!/usr/bin/env python3
"""Takes the uncompressed kernel out of a compressed one (xz), as QEMU can start it directly.

vmlinux.py VMLINUZ VMLINUX        ends with code 1, and writes nothing, where that cannot be done
"""
import os
import sys

source, target = sys.argv[1:]
try:
    import lzma

    with open(source, "rb") as file:
        image = file.read()
    start = image.find(b"\xfd7zXZ\0")
    kernel = lzma.LZMADecompressor().decompress(image[start:]) if start >= 0 else b""
except (ImportError, lzma.LZMAError) as error:
    sys.exit(f"{source} cannot be unpacked: {error}")
if not kernel.startswith(b"\x7fELF"):
    sys.exit(f"{source} holds no kernel packed with xz")
with open(target + ".partial", "wb") as file:
    file.write(kernel)
os.rename(target + ".partial", target)
