"""From Python's arguments to the words of the command line, and back."""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from typing import Any

from . import _native

Given = tuple[str | None, Any, Any]
Progress = Callable[[str, int, int], object]


def words(*given: Given) -> list[str]:
    """Words of the options that differ from their defaults; each is (name, value, default)."""
    options: list[str] = []
    places: list[str] = []
    for name, value, default in given:
        if value is None or (type(value) is type(default) and value == default):
            continue
        several = default == () and not isinstance(value, (str, os.PathLike))
        for one in value if several else (value,):
            if name is None:
                places.append(_word(one))
            elif one is True:
                options.append(name)
            elif one is not False:
                options.append(f"{name}={_word(one, '..' if name == '--range' else ',')}")
    return [*options, "--", *places] if places else options


def _word(value: Any, between: str = ",") -> str:
    if isinstance(value, (tuple, list)):
        return between.join(_word(one) for one in value)
    if isinstance(value, (str, os.PathLike)):
        return os.fspath(value)
    # Numbers of NumPy, too.
    return repr(value.item() if hasattr(value, "item") else value)


def call(verb: str, options: list[str], progress: Progress | None) -> Any:
    """The record of a verb."""
    return json.loads(_native.call([verb, *options], progress))
