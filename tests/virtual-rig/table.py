#!/usr/bin/env python3
"""Compares the table of faults in TESTING.md with the one that the latest run of the virtual rig sent out.

table.py           ends with code 1 and the differences, if there are any
table.py --write   puts the table of the run into TESTING.md
"""
import difflib
import pathlib
import sys

root = pathlib.Path(__file__).resolve().parent.parent.parent
page = root / "TESTING.md"
run = (root / "target/virtual-rig/out/camera-faults.md").read_text().strip()
begin, end = "<!-- camera-faults.md -->", "<!-- end -->"
text = page.read_text()
before, rest = text.split(begin)
written, after = rest.split(end)
if sys.argv[1:] == ["--write"]:
    page.write_text(f"{before}{begin}\n{run}\n{end}{after}")
elif sys.argv[1:]:
    sys.exit(__doc__)
elif written.strip() != run:
    print("TESTING.md does not say what the virtual rig found; `tests/virtual-rig/table.py --write` mends that")
    print("\n".join(difflib.unified_diff(written.strip().split("\n"), run.split("\n"), "TESTING.md", "run", lineterm="")))
    sys.exit(1)
else:
    print("the table of faults in TESTING.md is what the virtual rig found")
