"""What the command line says on stderr goes to the logger ``epirig``."""

from __future__ import annotations

import logging

logger = logging.getLogger("epirig")
logger.addHandler(logging.NullHandler())


def note(words: str) -> None:
    """A remark of the work: hints and warnings as warnings, the others as information."""
    kind = words.partition(":")[0]
    logger.log(logging.WARNING if kind in ("hint", "warning") else logging.INFO, "%s", words)
