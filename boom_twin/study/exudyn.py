"""Loads the virtual rig for a study, with the fastest build of Exudyn."""

from __future__ import annotations

import contextlib
import io
import sys
from importlib import import_module
from types import ModuleType

from ..errors import BoomTwinError


def load_rig() -> tuple[ModuleType | None, str]:
    """`boom_twin.rig`, or None and the reason. Exudyn's build without range checks is taken if none is loaded yet."""
    if "exudyn" not in sys.modules:
        sys.exudynFast = True  # type: ignore[attr-defined]  # where Exudyn looks
    try:
        with contextlib.redirect_stdout(io.StringIO()):
            return import_module("boom_twin.rig"), ""
    except BoomTwinError as missing:
        return None, str(missing)


def build() -> str:
    """Which build of Exudyn is loaded."""
    return "without range checks" if "exudyn.exudynCPPfast" in sys.modules else "with range checks"
