"""The virtual rig's boom in Exudyn, which is imported here alone."""

from __future__ import annotations

from importlib import import_module
from typing import Any

from ....errors import BoomTwinError

try:
    exudyn: Any = import_module("exudyn")
    items: Any = import_module("exudyn.itemInterface")
except ImportError as missing:
    raise BoomTwinError(
        "boom_twin.validation.rig needs the package exudyn, which is not installed (the twin itself does without it). "
        'Remedy: pip install "boom_twin[peers]"'
    ) from missing
