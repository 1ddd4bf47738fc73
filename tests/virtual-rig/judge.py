#!/usr/bin/env python3
"""Judges a run of the virtual rig by what the guest wrote, and takes its files out of it.

judge.py CONSOLE EXPECTED OUT     CONSOLE: what the guest wrote; EXPECTED: names of tests, one a line; OUT: a folder for files

Each test ends with a line `PASSED name`; it may stand behind `test name ... `, which the test harness leaves open. The guest
ends with `EXIT 0`. Ends with code 0 if every expected test passed and every file came whole, with 1 otherwise.
"""
import os
import re
import shutil
import sys

console, expected, out = sys.argv[1:]
with open(console, "rb") as file:
    lines = [line.rstrip(b"\r") for line in file.read().split(b"\n")]
with open(expected, "rb") as file:
    names = file.read().split()

passed, faults, files = set(), [], {}
name = None
for line in lines:
    if name is not None:
        if line == b"END FILE " + name:
            name = None
        else:
            files[name] += line + b"\n"
    elif begin := re.search(rb"(?:^| )BEGIN FILE (.*)$", line):
        name = begin[1]
        files[name] = bytearray()
    elif test := re.search(rb"(?:^| )PASSED (\S+)$", line):
        passed.add(test[1])

if name is not None:
    faults.append(f"the file {name.decode(errors='replace')} has no end; its last lines, or what came instead:")
    faults += [line.decode(errors="replace") for line in files.pop(name).splitlines()[-20:]]
shutil.rmtree(out, ignore_errors=True)
os.makedirs(out)
for name, content in files.items():
    if not re.fullmatch(rb"[A-Za-z0-9_-][A-Za-z0-9._-]*", name):
        faults.append(f"{name.decode(errors='replace')} is no plain name of a file; it is not written")
        continue
    with open(os.path.join(out, name.decode()), "wb") as file:
        file.write(content)

faults += [f"{name.decode()} did not pass" for name in names if name not in passed]
if b"EXIT 0" not in lines:
    faults.append("the guest did not end with EXIT 0")
for fault in faults:
    print(f"virtual rig: {fault}")
print(f"virtual rig: {sum(name in passed for name in names)} of {len(names)} tests passed")
sys.exit(bool(faults))
