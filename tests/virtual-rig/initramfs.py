#!/usr/bin/env python3
"""Writes the guest's first and only file system: an archive in cpio's format "newc", without cpio, kmod or root.

initramfs.py OUT --modules DIR --load MODULE... --libraries DIR... /path/in/guest=FILE...

Programs bring the shared libraries they ask for, modules (in /mod, in the order of /mod/order) those they depend on.
"""
import argparse
import os
import re
import subprocess
import sys

DIRECTORY, PROGRAM, FILE, LINK = 0o040755, 0o100755, 0o100644, 0o120777


def read(path):
    with open(path, "rb") as file:
        return file.read()


def module_files(folder):
    """Name of each module below the folder, as the kernel writes it, and its file."""
    found = {}
    for directory, _, names in os.walk(folder):
        for name in names:
            if match := re.fullmatch(r"(.+)\.ko(\.xz)?", name):
                found[match[1].replace("-", "_")] = os.path.join(directory, name)
    return found


def module_code(path):
    if not path.endswith(".xz"):
        return read(path)
    import lzma  # Python may be built without it; Debian 12 does not compress its modules

    return lzma.decompress(read(path))


def collect_modules(files, wanted, collected):
    """Adds the modules to `collected` (name and code) behind those that they depend on."""
    for name in wanted:
        if name in collected:
            continue
        if name not in files:
            sys.exit(f"the kernel has no module {name}")
        code = module_code(files[name])
        depends = re.search(rb"\0depends=([^\0]*)", code)
        needed = depends[1].decode().replace("-", "_").split(",") if depends else []
        collect_modules(files, filter(None, needed), collected)
        collected[name] = code


def shared_libraries(program, folders):
    """What ldd says that the program loads; nothing for a static one."""
    environment = dict(os.environ, LC_ALL="C", LD_LIBRARY_PATH=":".join(map(os.path.abspath, folders)))
    said = subprocess.run(["ldd", program], env=environment, capture_output=True, text=True).stdout
    if "not found" in said:
        sys.exit(f"{program} lacks a library:\n{said}")
    return re.findall(r"(?:=>|^)\s*(/\S+)", said, re.MULTILINE)


class Archive:
    def __init__(self):
        self.entries = {}

    def add(self, path, mode, data):
        path = path.strip("/")
        if parent := os.path.dirname(path):
            if parent not in self.entries:
                self.add(parent, DIRECTORY, b"")
        self.entries[path] = (mode, data)

    def write(self, path):
        with open(path, "wb") as file:
            for number, (name, (mode, data)) in enumerate(sorted(self.entries.items()), start=1):
                file.write(self.record(number, name, mode, data))
            file.write(self.record(0, "TRAILER!!!", 0, b""))

    @staticmethod
    def record(number, name, mode, data):
        """Header of hexadecimal numbers, name, data; name and data each end at a multiple of four bytes."""
        name = name.encode() + b"\0"
        fields = (number, mode, 0, 0, 1, 0, len(data), 0, 0, 0, 0, len(name), 0)
        head = b"070701" + b"".join(b"%08X" % field for field in fields) + name
        return head + b"\0" * (-len(head) % 4) + data + b"\0" * (-len(data) % 4)


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("out")
    parser.add_argument("files", nargs="+")
    parser.add_argument("--modules", required=True)
    parser.add_argument("--load", action="append", default=[])
    parser.add_argument("--libraries", action="append", default=[])
    arguments = parser.parse_args()

    archive = Archive()
    for folder in ("dev", "proc", "sys", "tmp", "run", "root"):
        archive.add(folder, DIRECTORY, b"")
    archive.add("bin/sh", LINK, b"busybox")
    for pair in arguments.files:
        path, source = pair.split("=", 1)
        code = read(source)
        archive.add(path, PROGRAM, code)
        if code.startswith(b"\x7fELF"):
            for library in shared_libraries(source, arguments.libraries):
                folder = "lib64" if "ld-linux" in library else "lib"
                archive.add(f"{folder}/{os.path.basename(library)}", PROGRAM, read(library))

    modules = {}
    collect_modules(module_files(arguments.modules), arguments.load, modules)
    for name, code in modules.items():
        archive.add(f"mod/{name}.ko", FILE, code)
    archive.add("mod/order", FILE, "".join(f"{name}\n" for name in modules).encode())
    archive.write(arguments.out)


main()
