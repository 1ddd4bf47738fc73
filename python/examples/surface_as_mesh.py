"""A measured surface as a mesh in trimesh."""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory

import trimesh

import epirig
from epirig.testing import simulated_rig

with TemporaryDirectory() as folder:
    scan = Path(folder) / "scan"
    for _ in simulated_rig(frames=21, step_mm=7.5, columns=768, rows=768, noise_dn=1).capture(scan):
        pass
    sequence = epirig.Sequence(scan)
    sequence.match()
    print(sequence.surface().conclusion)

    # Vertices x, y, z in mm, and triangles between pixels that were measured.
    sequence.export(map="height-without-form", out=Path(folder) / "surface.ply")
    mesh = trimesh.load_mesh(Path(folder) / "surface.ply")

width_mm, height_mm, depth_mm = mesh.extents
print(f"{len(mesh.vertices)} vertices, {len(mesh.faces)} triangles, {width_mm:.0f} x {height_mm:.0f} x {depth_mm:.2f} mm")
print(f"area {mesh.area:.0f} mm2")
