"""
The native part of epirig.
"""

from _typeshed import Incomplete, SupportsGetItem
from os import PathLike
from typing import Any, SupportsFloat, SupportsIndex, final

__all__ = ["Connection", "Scan", "call", "end_all_calls", "map_names", "match_array", "read_frames", "result_map", "run", "sequence_facts", "sequence_tau", "sequence_truth", "validity_classes", "verbs"]

@final
class Connection:
    """
    The connected stage and camera of a rig.
    """
    def __new__(cls, /, words: SupportsGetItem[int, str]) -> Connection:
        """
        Connects to the rig that these options of `epirig capture` describe.
        """
    def close(self, /) -> None:
        """
        Lets go of stage and camera; a stage that moves is stopped.
        """
    def facts(self, /) -> tuple[float, str, str]:
        """
        Travel in mm, and the names of stage and camera.
        """
    def grab(self, /) -> Any:
        """
        A frame whose exposure begins after this call: (rows, columns).
        """
    def home(self, /) -> None:
        """
        Homes the stage.
        """
    def move_to(self, /, position_mm: SupportsFloat | SupportsIndex) -> None:
        """
        Moves to a position in mm from home, and returns when the stage is at rest there.
        """
    def state(self, /) -> tuple[float | None, bool]:
        """
        Position in mm, and whether the stage moves. While another thread moves it: the position before.
        """
    def stop(self, /) -> None:
        """
        Stops the stage, also while another thread moves it.
        """

@final
class Scan:
    """
    A scan whose frames are taken one after the other. When it is dropped, it ends after the frame in hand.
    """
    def __new__(cls, /, words: SupportsGetItem[int, str]) -> Scan:
        """
        Begins `capture` or `resume` with these words.
        """
    def close(self, /) -> None:
        """
        Ends the scan after the frame in hand.
        """
    def interrupt(self, /) -> None:
        """
        Does what Ctrl-C does: the first time the scan ends after the frame in hand, then the stage is stopped.
        """
    def next(self, /) -> tuple[int, Any, str] | None:
        """
        The next good frame: its index, the array of (rows, columns), and its facts as text (JSON). `None` at the end.
        """

def call(words: SupportsGetItem[int, str], progress: Any | None = None) -> str:
    """
    Runs a verb with its options; gives the record that `--json` prints, as text.
    """

def end_all_calls() -> None:
    """
    Ends all calls of other threads, and waits for their end: for the end of the interpreter.
    """

def map_names(verb: str) -> list[tuple[str, str, str]]:
    """
    The maps of the results of `match`, `surface` or `compare`, each with its title and unit.
    """

def match_array(frames: Any, words: SupportsGetItem[int, str], tau: SupportsGetItem[int, SupportsFloat | SupportsIndex] | None = None, mask: Incomplete | None = None, progress: Any | None = None) -> tuple[Incomplete, Incomplete, Incomplete, Incomplete, Incomplete, str]:
    """
    The maps of `frames`, with the options `words` of `epirig match`; `mask` is not 0 where pixels are asked for.
    """

def read_frames(folder: str | PathLike[str], rectified: bool, progress: Any | None = None) -> Any:
    """
    The frames of the sequence in `folder`, (frames, rows, columns).

    Without `rectified` as they were captured, of uint8 or uint16; with it corrected and rectified by the calibration of
    the sequence, of float32 in DN.
    """

def result_map(folder: str | PathLike[str], name: str) -> Incomplete | None:
    """
    The map `name` of the results in `folder`; `None` if they do not have it. What `epirig export` calls it.
    """

def run(arguments: SupportsGetItem[int, str]) -> int:
    """
    The program `epirig`, with these arguments; gives its exit code.
    """

def sequence_facts(folder: str | PathLike[str]) -> str:
    """
    Record, number of frames, positions and end of the sequence in `folder`, as text (JSON).
    """

def sequence_tau(folder: str | PathLike[str], rectified: bool) -> list[float]:
    """
    Position of each frame on the baseline, from 0 to 1; if `rectified`, that of the calibration.
    """

def sequence_truth(folder: str | PathLike[str], reference: SupportsIndex | None) -> tuple[Incomplete, Incomplete, int, list[float], list[float]]:
    """
    The truth of the simulated scan in `folder` for the pixels of frame `reference`, or of the middle one.
    """

def validity_classes() -> list[tuple[int, str]]:
    """
    The values of `validity`, with their names.
    """

def verbs() -> str:
    """
    All verbs with their options, as text (JSON).
    """
