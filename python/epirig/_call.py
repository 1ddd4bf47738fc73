"""From Python's arguments to the words of the command line, and back."""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from typing import Any

from . import _native
from ._errors import OptionError

Given = tuple[str | None, Any, Any]

REQUIRED: Any = object()
"""Stands for the default of an argument that has none."""
Progress = Callable[[str, int, int], object]


def words(*given: Given) -> list[str]:
    """Words of the options that differ from their defaults; each is (name, value, default)."""
    options: list[str] = []
    places: list[str] = []
    for name, value, default in given:
        if value is None and default is REQUIRED:
            raise OptionError(f"{name} is None; give a value", 2, "usage")
        if value is None or (type(value) is type(default) and value == default):
            continue
        if isinstance(default, bool):
            if value:
                options.append(str(name))
            continue
        several = isinstance(default, tuple) and not isinstance(value, (str, bytes, os.PathLike))
        for one in value if several else (value,):
            if name is None:
                places.append(_word(one))
            else:
                options.append(f"{name}={_word(one, '..' if name == '--range' else ',')}")
    return [*options, "--", *places] if places else options


def _word(value: Any, between: str = ",") -> str:
    # Numbers and arrays of NumPy, too.
    plain = value.tolist() if hasattr(value, "tolist") else value
    if isinstance(plain, (tuple, list)):
        return between.join(_word(one) for one in plain)
    return os.fsdecode(plain) if isinstance(plain, (str, bytes, os.PathLike)) else str(plain)


def call(verb: str, options: list[str], progress: Progress | None) -> Any:
    """The record of a verb."""
    return json.loads(_native.call([verb, *options], progress))
