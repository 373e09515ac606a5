"""Whether the folder of a session or of a result says that it is not whole."""

from __future__ import annotations

import re
from pathlib import Path

from ..plain import LARGEST
from .results import UNFINISHED, is_unfinished
from .sheet import FILE_NAME

_BEGUN, _ENDED = (re.compile(rb"^%b:" % key, re.MULTILINE) for key in (b"started", b"ended"))
"""Lines that the recorder writes at the beginning, and at the end; the texts inside ``session.yaml`` are indented."""


def incompleteness(path: Path) -> str:
    """Why a session or a result is incomplete, in words; empty if its folder does not say that it is.

    Parameters
    ----------
    path : Path
        Of the folder or of a file in it; also ``bag`` in the folder of a replay, and ``A/bag`` in that of a comparison.
    """
    folder = path if path.is_dir() else path.parent
    for place in (folder, *folder.resolve().parents[:2]):
        if is_unfinished(place):
            return f"incomplete: {place / UNFINISHED} says that its command was stopped, or is still at work. Run it again."
    sheet = folder / FILE_NAME
    if sheet.is_file():
        with sheet.open("rb") as stream:
            text = stream.read(LARGEST)
        if _BEGUN.search(text) and not _ENDED.search(text):
            return f"incomplete: the recorder was ended by force, or is still at work: {sheet} tells no end."
    return ""
