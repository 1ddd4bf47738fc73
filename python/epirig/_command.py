"""The program ``epirig``."""

from __future__ import annotations

import signal
import sys

from . import _native


def main() -> int:
    """Runs the program with the arguments of this process."""
    # The program hears Ctrl-C itself.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    if sys.stdout is not None:
        sys.stdout.flush()
    return _native.run(["epirig", *sys.argv[1:]])


if __name__ == "__main__":
    raise SystemExit(main())
