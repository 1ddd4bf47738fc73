"""The examples of README and book run as they stand."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

HERE = Path(__file__).parent


@pytest.mark.parametrize("document", ["../README.md", "../../docs/src/python.md"])
def test_examples_run(
    document: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, frames: NDArray[np.uint8]
) -> None:
    pytest.importorskip("matplotlib.pyplot").switch_backend("agg")
    text = (HERE / document).read_text()
    photos = tmp_path / "photos"
    photos.mkdir()
    for index, frame in enumerate(frames):
        (photos / f"{index:02}.pgm").write_bytes(b"P5 96 48 255\n" + frame.tobytes())
    monkeypatch.chdir(tmp_path)
    names: dict[str, Any] = {}
    blocks = re.findall(r"```python\n(.*?)```", text, flags=re.S)
    assert blocks
    for block in blocks:
        exec(compile(block, document, "exec"), names)
    assert abs(np.nanmedian(names["maps"].disparity) - 6) < 0.01
