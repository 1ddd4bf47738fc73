#!/usr/bin/env python3
"""Writes epirig/_verbs.py: the verbs of the command line, and `match_array`, as functions.

Their options, defaults and help are those of the command line itself, as the native part tells them.

    python generate.py           writes the file
    python generate.py --check   says whether it is up to date
"""

from __future__ import annotations

import json
import re
import sys
import textwrap
from pathlib import Path
from typing import Any

from epirig import _native

TARGET = Path(__file__).parent / "epirig" / "_verbs.py"
Json = dict[str, Any]
# Values of options that are no parameters.
Known = dict[str, str]

# Verbs as functions: what each gives, by the value of its option `out`. `submit` is not among them: the options that it
# hands on to `match` are words of the command line, after `--`. The program that the package has runs it.
FUNCTIONS = {
    "import": ("import_images", "Sequence", "Sequence(out)"),
    "capture": ("capture", "Sequence", "Sequence(out)"),
    "resume": ("resume", "Sequence", "Sequence(sequence)"),
    "demo": ("demo", "Sequence", "Sequence(out)"),
    "measure": ("measure", "Sequence", "Sequence(out)"),
    "compare": ("compare", "dict[str, Any]", "record"),
    "doctor": ("doctor", "dict[str, Any]", "record"),
    "plan": ("plan", "dict[str, Any]", "record"),
    "list": ("list_sequences", "dict[str, Any]", "record"),
    "trend": ("trend", "dict[str, Any]", "record"),
    "repeat": ("repeat", "dict[str, Any]", "record"),
    "characterise": ("characterise", "dict[str, Any]", "record"),
}
# Verbs as methods of a sequence.
METHODS = {
    "verify": ("dict[str, Any]", "record"),
    "calibrate": ("dict[str, Any]", "record"),
    "rectify": ("Sequence", "Sequence(out)"),
    "pack": ("dict[str, Any]", "record"),
    "match": ("Results", 'Results(self.folder / "results" if out is None else out, record)'),
    "surface": ("Surface", "Surface.of(self.folder, results, out, record)"),
    "evaluate": ("dict[str, Any]", "record"),
    "export": ("dict[str, Any]", "record"),
}

# Steps of a match in bands, as methods: options of `match`, each with those of its own that go only with it.
STEPS: dict[str, tuple[list[str], str, str, str]] = {
    "survey": (["bands"], "survey", "dict[str, Any]", "record"),
    "band": ([], "match_band", "dict[str, Any]", "record"),
    "merge": ([], "merge", *METHODS["match"]),
}

# Options that only change what is printed or how the program ends.
LEFT_OUT = ("dry_run", "csv", "no_verdict")

HEAD = '''"""The verbs of the command line, and the match of frames in memory. Written by generate.py."""

from __future__ import annotations

from collections.abc import Sequence as Several
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, Union

from numpy.typing import ArrayLike

from ._call import REQUIRED, Progress, call, words
from ._maps import Maps, matched
from ._results import Results, Surface

if TYPE_CHECKING:
    from ._sequence import Sequence

Place = Union[str, "PathLike[str]"]
'''

MATCH_ARRAY = '''def match_array(
    frames: ArrayLike,
    *,
    tau: ArrayLike | None = None,
    mask: ArrayLike | None = None,
{signature}    progress: Progress | None = None,
) -> Maps:
    """Disparity of every pixel of the reference frame, with its standard uncertainty.

    The disparity is that over the whole baseline, from the first to the last of these frames, in px: positive
    if a point moves to the right. A point moves along its row from frame to frame; frames whose points also move across rows are to be
    rectified before. The options are those of ``epirig match``, with its defaults.

    >>> import epirig
    >>> import numpy as np
    >>> t, y, x = np.ogrid[0:15, 0:48, 0:96]
    >>> place = x - 6.0 * t / 14  # moves by 6 px along the rows
    >>> frames = 120 + 60 * np.sin(0.9 * place + y) + 50 * np.sin(0.37 * place - 2 * y)
    >>> maps = epirig.match_array(frames.astype(np.uint8))
    >>> print(f"{{np.nanmedian(maps.disparity):.2f}} px")
    6.00 px

    Parameters
    ----------
    frames
        Array of (frames, rows, columns), or a sequence of arrays of (rows, columns), of uint8, uint16 or
        floating point. Any layout in memory and order of bytes will do; memory-mapped files are read once
        (twice if they are floating point). The frames are copied before the match begins. Floating point
        may have any unit: the largest sample becomes 65535 DN, and zero (or the smallest, if that is
        negative) 0 DN. So subtract a large offset, and clip single samples that outshine all others.
    tau
        Position of each frame on the baseline, increasing, in any unit. Without it: equal steps.
    mask
        Array of (rows, columns); only pixels that are true are matched. Without it: all of them.
{listed}
    progress
        Called with what is done, how many parts of it are done, and of how many.

    Raises
    ------
    epirig.DataError
        If the frames make no stack, or show no disparity.
    epirig.OptionError
        If an option cannot be used.
    epirig.Interrupted
        After Ctrl-C, a subclass of KeyboardInterrupt.
    """
    options = words(
{given}    )
    return matched(frames, options, tau, mask, progress)
'''

RIG = '''class RigOptions:
    """A rig, as its profile and these options describe it; nothing is connected yet.

    The options are those of ``epirig capture``.

    Parameters
    ----------
{listed}
    """

    def __init__(
        self,
        *,
{signature}    ) -> None:
        self._words = words(
{given}        )
'''

# May hold the name of a section in brackets.
DEFAULT = r"\s*\[default: ((?:[^\[\]]|\[[^\]]*\])*)\]"
PROGRESS = "progress: Progress | None = None"
TYPES = {"number": "float", "whole": "int", "path": "Place", "range": "Several[float] | str", "text": "str | float"}


def name_of(option: Json) -> str:
    return str(option["long"] or option["name"]).replace("-", "_")


def type_of(option: Json) -> str:
    if option["kind"] == "flag":
        return "bool"
    if option["choices"]:
        names = ", ".join(json.dumps(choice["name"]) for choice in option["choices"])
        digits = all(choice["name"].isdigit() for choice in option["choices"])
        return f"Literal[{names}]" + (" | int" if digits else "")
    kind = TYPES[option["kind"]]
    if option["many"] and kind == "str | float":
        kind = "str"
    if option["name"] == "reference":
        kind = 'Literal["first", "middle", "last"] | int'
    elif option["long"] == "memory":
        kind = "str"
    elif option["kind"] == "text" and "," in (option["value"] or ""):
        kind = "Several[float] | str"
    if not option["many"]:
        return kind
    return "Place | Several[Place]" if kind == "Place" else f"Several[{kind}]"


def default_of(option: Json) -> str:
    text = option["default"]
    if option["many"]:
        return "()"
    if option["kind"] == "flag":
        return "False"
    if option["required"]:
        return "REQUIRED"
    if text is None:
        return "None"
    if option["kind"] in ("number", "whole"):
        return f'float("{text}")' if text in ("inf", "NaN") else str(text)
    return json.dumps(text)


def parameter(option: Json) -> str:
    if option["required"]:
        return f"{name_of(option)}: {type_of(option)}"
    default = default_of(option)
    optional = " | None" if default == "None" else ""
    return f"{name_of(option)}: {type_of(option)}{optional} = {default}"


def in_python(text: str) -> str:
    """Help of the command line in the words of Python."""
    text = " ".join(text.split())
    text = text.replace("`inf`", '``float("inf")``')
    text = re.sub(r"`epirig ([^`]+)`", r"``epirig \1``", text)
    return re.sub(r"--([a-z][a-z-]*)", lambda match: match.group(1).replace("-", "_"), text)


def documented(option: Json, indent: int) -> str:
    help_text = option["help"] or ""
    default = re.search(DEFAULT, help_text, flags=re.S)
    text = in_python(re.sub(DEFAULT, "", help_text, flags=re.S)).rstrip(".")
    text = f"{text}." if text else ""
    if default and option["default"] is None and not option["required"]:
        text += f" Without it: {in_python(default.group(1))}."

    def fill(words: str, first: str) -> str:
        before = " " * (indent + 4) + first
        return textwrap.fill(words, 100, initial_indent=before, subsequent_indent=" " * len(before))

    lines = [" " * indent + name_of(option), fill(text, "")]
    lines += [
        fill(f'"{choice["name"]}": {in_python(choice["help"])}.', "- ") for choice in option["choices"] if choice["help"]
    ]
    return "\n".join(lines)


def words_of(options: list[Json], indent: int, known: Known | None = None) -> str:
    lines = []
    for option in options:
        long = f'"--{option["long"]}"' if option["long"] else "None"
        value = (known or {}).get(option["name"]) or name_of(option)
        lines.append(f"{' ' * indent}({long}, {value}, {default_of(option)}),\n")
    return "".join(lines)


def without_steps(match: Json) -> Json:
    """The match in one go."""
    of_steps = {name for step, (own, *_) in STEPS.items() for name in (step, *own)}
    return {**match, "options": [option for option in match["options"] if option["name"] not in of_steps]}


def step_of(match: Json, name: str) -> Json:
    """A step of a match in bands as a verb. The options that conflict with it on the command line are not its options."""
    step = next(option for option in match["options"] if option["name"] == name)
    # A sentence about another option, as at the end of the help of --survey, belongs there.
    told, _, about = " ".join(step["help"].split()).partition(". --")
    other, _, does = about.partition(" ")
    own = [option for option in match["options"] if option["name"] in STEPS[name][0]]
    options = [
        option
        for option in without_steps(match)["options"]
        if option["name"] not in step["conflicts"] and name not in option["conflicts"]
        # What follows the survey takes the options of the match from the plan.
        and (name == "survey" or option["heading"] != "Matching")
    ]
    helps = {option["name"]: option["help"].removeprefix(f"With --{name}: ") for option in own + options}
    if other:
        helps[other] = does
    options = [{**option, "help": text[:1].upper() + text[1:]} for option in own + options for text in [helps[option["name"]]]]
    said = {**match, "help": told, "said": f"match --{step['long']}"}
    if step["kind"] == "flag":
        return {**said, "options": [*options, step], "known": {name: "True"}}
    return {**said, "options": [{**step, "required": True, "help": "Its number"}, *options]}


def function(verb: Json, name: str, gives: str, made: str, method: bool) -> str:
    options = [option for option in verb["options"] if not option["hidden"] and option["name"] not in LEFT_OUT]
    if "(out)" in made:
        # A sequence is told where it is.
        options = [{**option, "required": option["required"] or option["name"] == "out"} for option in options]
    places = [option for option in options if option["long"] is None]
    known: Known = {**verb.get("known", {}), **({places[0]["name"]: "self.folder"} if method else {})}
    named = [option for option in options if option["long"] is not None]
    own = [option for option in places + named if option["name"] not in known]
    first = [parameter(option) for option in own if (option["long"] is None or option["name"] in STEPS) and option["required"]]
    rest = sorted((parameter(option) for option in own if parameter(option) not in first), key=lambda text: "=" in text)
    indent = 4 if method else 0
    inner = " " * (indent + 4)
    lines = [*(["self"] if method else []), *first, "*", *rest, PROGRESS]
    signature = "".join(f"{inner}{line},\n" for line in lines)
    help_text = in_python(verb["help"]).rstrip(".")
    if "said" in verb:
        # Options have longer help than verbs.
        help_text = textwrap.fill(f'{inner}"""{help_text}', 100, subsequent_indent=inner)[len(inner) + 3 :]
    listed = "".join(documented(option, indent + 4) + "\n" for option in own)
    local = [] if method or gives.startswith("dict") else [f"{inner}from ._sequence import Sequence\n\n"]
    local = local or ([f"{inner}from ._sequence import Sequence\n\n"] if gives == "Sequence" else [])
    record = "record: dict[str, Any] = " if "record" in made else ""
    return (
        f"{' ' * indent}def {name}(\n{signature}{' ' * indent}) -> {gives}:\n"
        f'{inner}"""{help_text}.\n\n'
        f"{inner}The same as ``epirig {verb.get('said', verb['verb'])}``.\n\n"
        f"{inner}Parameters\n{inner}----------\n{listed}"
        f"{inner}progress\n{inner}    Called with what is done, how many parts of it are done, and of how many.\n"
        f'{inner}"""\n' + "".join(local) + f"{inner}{record}call(\n{inner}    \"{verb['verb']}\",\n{inner}    words(\n"
        + words_of(places + named, indent + 12, known)
        + f"{inner}    ),\n{inner}    progress,\n{inner})\n{inner}return {made}\n"
    )


def match_array(match: Json) -> str:
    options = [option for option in match["options"] if option["heading"] == "Matching"]
    return MATCH_ARRAY.format(
        signature="".join(f"    {parameter(option)},\n" for option in options),
        given=words_of(options, 8),
        listed="\n".join(documented(option, 4) for option in options),
    )


def rig_options(capture: Json) -> str:
    own = {"out", "dry_run", "anyway"}
    options = [option for option in capture["options"] if option["name"] not in own and not option["hidden"]]
    return RIG.format(
        signature="".join(f"        {parameter(option)},\n" for option in options),
        given=words_of(options, 12),
        listed="\n".join(documented(option, 4) for option in options),
    )


def written() -> str:
    verbs = {verb["verb"]: verb for verb in json.loads(_native.verbs())}
    match = verbs["match"]
    verbs["match"] = without_steps(match)
    functions = [function(verbs[verb], *facts, method=False) for verb, facts in FUNCTIONS.items()]
    methods = [function(verbs[verb], verb, *facts, method=True) for verb, facts in METHODS.items()]
    steps = STEPS.items()
    methods += [function(step_of(match, step), name, gives, made, method=True) for step, (_, name, gives, made) in steps]
    mixin = 'class SequenceVerbs:\n    """The verbs that work on a sequence."""\n\n    folder: Path\n'
    return "\n\n".join([HEAD, match_array(verbs["match"]), *functions, rig_options(verbs["capture"]), "\n".join([mixin, *methods])])


def main() -> int:
    text = written()
    if sys.argv[1:] != ["--check"]:
        TARGET.write_text(text)
        return 0
    if TARGET.read_text() == text:
        return 0
    print("epirig/_verbs.py is not what the command line says; run generate.py, and commit it", file=sys.stderr)
    return 1


if __name__ == "__main__":
    raise SystemExit(main())
