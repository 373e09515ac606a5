"""Twins and sessions of a boom whose strokes are drives: tests of the models of drives are fed with them."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from recordings import SessionMetadata

from boom_twin import Twin, __version__
from boom_twin.types import Array, StrokeReading

if TYPE_CHECKING:
    from boom_twin.validation.rig import RigSession

_FOLDER = Path(__file__).parent / "data" / "drives"
ARCH_DRIVES, PUMP_DRIVES = _FOLDER / "arch_session", _FOLDER / "pump_session"
"""Sessions that the virtual rig made before its transducers read lengths."""


def drive_twin(*arguments: Any, **options: Any) -> Twin:
    return Twin(*arguments, reads=StrokeReading.DRIVE, **options)


def note_drives(folder: Path) -> None:
    """Write the ``session.yaml`` of a session whose strokes are drives."""
    SessionMetadata(__version__, strokes=StrokeReading.DRIVE).write(folder)


def drive_readings(session: RigSession) -> Array:
    """Return the true drives of a session of the virtual rig with the noise of its transducers, m."""
    return np.asarray(session.strokes - session.truth["strokes"] + session.truth["drives"])
