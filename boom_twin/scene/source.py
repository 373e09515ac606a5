"""A scene from whatever names one: a scene, a file, a mapping as in a file, or nothing for the default."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ..errors import UsageError
from .load import load_scene
from .schema import Scene

SceneSource = Scene | Mapping[str, Any] | str | Path | None
"""Forms in which functions accept a boom; a mapping has the keys of a scene file."""


def as_scene(source: SceneSource) -> Scene:
    """The scene that `source` is, names or describes; the package's default scene for None.

    Returns
    -------
    Scene
        Frozen, complete and checked; SI units.

    Raises
    ------
    SceneError
        The file or the mapping cannot be used: all faults.
    UsageError
        It is none of them.
    """
    if isinstance(source, Scene):
        return source
    if source is None or isinstance(source, str | Path | Mapping):
        return load_scene(source)
    raise UsageError(f"scene = {source!r}: give a Scene, the path of a scene file, a dict with its keys, or None.")
