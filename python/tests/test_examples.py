"""The examples, and what other programs see of the package."""

from __future__ import annotations

import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import epirig
from epirig.testing import simulated_rig

EXAMPLES = Path(__file__).parent.parent / "examples"


def example(name: str, needs: str, *arguments: str | Path) -> str:
    """What an example prints."""
    pytest.importorskip(needs)
    ended = subprocess.run([sys.executable, EXAMPLES / name, *arguments], capture_output=True, text=True, check=False)
    assert ended.returncode == 0, ended.stderr
    return ended.stdout


def test_a_plan_of_bluesky_takes_a_scan() -> None:
    told = example("bluesky_scan.py", "bluesky")
    # f / Z = 711 px / 900 mm, over 40 mm of travel.
    assert told.startswith("21 frames from 65.0 to 105.0 mm\nmedian disparity 31.6"), told


def test_a_surface_is_a_mesh() -> None:
    told = example("surface_as_mesh.py", "trimesh")
    assert "hollows 0.2" in told or "hollows 0.19" in told
    # A tile of 150 mm, less the margins of the match.
    assert "144 x 14" in told, told


def test_two_processes_of_dask_match_bands(epirig_scan: Callable[..., epirig.Sequence], tmp_path: Path) -> None:
    scan = epirig_scan(step_mm=7.5)
    told = example("dask_bands.py", "distributed", scan.folder, "--block-rows", "48").splitlines()
    assert sorted(told[:4])[3] == "band 3 of 4: rows 144 .. 191" and told[4].startswith("median disparity 118."), told
    one, several = scan.match(block_rows=48, out=tmp_path / "one"), scan.results()
    for name in one.maps:
        assert np.array_equal(one.map(name), several.map(name), equal_nan=True), name


def test_the_notebook_measures_photographs() -> None:
    client = pytest.importorskip("nbclient").NotebookClient
    pytest.importorskip("ipykernel")
    pytest.importorskip("matplotlib")
    notebook = pytest.importorskip("nbformat").read(EXAMPLES / "photographs_to_heights.ipynb", 4)
    # Its last cell compares the depth with the truth.
    client(notebook, timeout=300).execute()
    pictures = [output for cell in notebook.cells for output in cell.get("outputs", []) if "image/png" in output.get("data", {})]
    assert len(pictures) == 3


def test_napari_opens_sequences_and_results(sequence: epirig.Sequence, written: Path) -> None:
    components = pytest.importorskip("napari.components")
    pytest.importorskip("npe2").PluginManager.instance().discover()
    viewer: Any = components.ViewerModel()
    viewer.open(sequence.folder, plugin="epirig")
    assert np.array_equal(viewer.layers[0].data, sequence.frames())
    # Other files are left to others.
    viewer.open(next((sequence.folder / "frames").iterdir()))
    results = sequence.match(out=written / "napari")
    viewer.layers.clear()
    viewer.open(results.folder, plugin="epirig")
    layers = {layer.name: layer for layer in viewer.layers}
    assert np.array_equal(layers["Disparity (px)"].data, results.disparity, equal_nan=True)
    assert type(layers["Answers of the matcher"]).__name__ == "Labels"
    assert layers["Disparity (px)"].metadata["epirig"]["reference"] == results.record["reference"]


def test_devices_are_what_bluesky_takes_them_for() -> None:
    protocols = pytest.importorskip("bluesky.protocols")
    from epirig.bluesky import devices

    slow = ["stage.velocity=20 mm/s", "stage.acceleration=1000 mm/s2"]
    rig = simulated_rig(frames=5, columns=64, rows=48, real_time=True, settings=slow)
    stage, camera = devices(rig, camera="eye")
    for device, roles in [
        (stage, ("Movable", "Readable", "Stoppable", "Locatable", "Stageable", "HasHints", "HasParent")),
        (camera, ("Triggerable", "Readable", "Stageable", "HasHints", "HasParent")),
    ]:
        assert all(isinstance(device, getattr(protocols, role)) for role in roles)
    for staged in (stage.stage(), camera.stage()):
        staged.wait()
    near = stage.set(1)
    near.wait()
    assert isinstance(near, protocols.Status) and camera.name == "eye" and stage.read()["stage"]["value"] == 1
    far = stage.set(150)
    with pytest.raises(TimeoutError):
        far.exception(0.2)
    with pytest.raises(epirig.OptionError, match="is moving"):
        stage.set(0)
    # Nobody waits for a stage that moves.
    begun = time.monotonic()
    assert stage.read()["stage"]["value"] == 1 and time.monotonic() - begun < 1
    stage.stop(success=False)
    failed = far.exception(None)
    assert "move to 150.0 mm of stage: stopped" in repr(far)
    assert isinstance(failed, epirig.EpirigError) and far.done and not far.success
    told: list[bool] = []
    far.add_callback(lambda status: told.append(status.success))
    assert told == [False]
    with pytest.raises(epirig.EpirigError):
        far.wait()
    camera.trigger().wait()
    frame = camera.read()["eye"]["value"]
    assert frame.shape == tuple(camera.describe()["eye"]["shape"]) == (48, 64)
    assert stage.locate()["setpoint"] == 150 and stage.locate()["readback"] < 150
    stage.unstage()
    assert rig.connected
    camera.trigger().wait()
    camera.unstage()
    assert not rig.connected
    stage.stop()


def test_a_plan_connects_homes_and_lets_go(caplog: pytest.LogCaptureFixture) -> None:
    plans = pytest.importorskip("bluesky.plans")
    from epirig.bluesky import devices

    rig = simulated_rig(frames=5, columns=64, rows=48, faults=["camera-no-signal@3"])
    stage, camera = devices(rig)
    engine: Any = pytest.importorskip("bluesky").RunEngine()
    documents: list[Any] = []
    engine(plans.scan([camera], stage, 10, 14, 3), lambda name, document: documents.append((name, document)))
    with rig:
        rig.home()
        rig.move_to(12)
        engine(plans.rel_scan([camera], stage, -1, 1, 3))
        moved = stage.set(150)
        stage.stop()
        assert moved.exception(None) is None and stage.locate()["setpoint"] == 150
    places = [document["data"]["stage"] for name, document in documents if name == "event"]
    assert places == [10, 12, 14] and not rig.connected
    with pytest.raises(epirig.DeviceError, match="no signal"):
        try:
            engine(plans.scan([camera], stage, 16, 18, 2))
        except Exception as error:
            # What the engine raises names the status; the cause is the exception of the device.
            raise error.__cause__ or error
    assert not rig.connected and "Failed to stop" not in caplog.text
