"""`load_scene`: from a file to a validated `Scene`."""

from __future__ import annotations

import warnings
from collections.abc import Iterable
from importlib.resources import files
from pathlib import Path

import numpy as np

from ..errors import Fault, SceneError, SceneWarning
from .checks import CHECKS
from .end_mark import missing_end_mark
from .parts import Scene
from .read import parse, read_text
from .structure import structure

DEFAULT_NAME = "default scene"


def default_text() -> str:
    """Text of the package's default scene."""
    return _text("scene.yaml")


def clearance_text() -> str:
    """Text of the package's block `clearance`, which can follow the default scene."""
    return _text("clearance.yaml")


def _text(name: str) -> str:
    return (files("boom_twin") / "msg_config" / name).read_text(encoding="utf-8")


def load_scene(source: str | Path | None = None) -> Scene:
    """A boom as its scene file describes it.

    Parameters
    ----------
    source : str or Path, optional
        A YAML file; without it, the package's default scene.

    Returns
    -------
    Scene
        Frozen, complete and checked; SI units.

    Raises
    ------
    SceneError
        With every fault that was found: place, value, bound, remedy.

    Warns
    -----
    SceneWarning
        One for each thing that can be computed but looks odd.
    """
    scene, oddities = examine(source)
    for oddity in oddities:
        warnings.warn(str(oddity), SceneWarning, stacklevel=2)
    return scene


def examine(source: str | Path | None = None) -> tuple[Scene, list[Fault]]:
    """Like `load_scene`, with the oddities returned instead of issued as warnings."""
    if source is None:
        return examine_text(default_text(), DEFAULT_NAME)
    return examine_text(read_text(Path(source)), str(source))


def examine_text(text: str, name: str, whole: bool = False) -> tuple[Scene, list[Fault]]:
    """Like `examine`, of a scene's text; `name` is what it is called in errors; `whole`: a checksum says it is not cut off."""
    cut, unmarked = (None, None) if whole else missing_end_mark(text)
    if cut is not None:
        raise SceneError(name, (cut,))
    document = parse(text, name)
    scene, draft, faults = structure(document)
    with np.errstate(all="ignore"):  # what overflows fits nowhere, and the checks say so
        findings = [finding for check in CHECKS for finding in check(draft)]
    faults += document.faults + [finding.fault for finding in findings if not finding.odd]
    odd = [finding.fault for finding in findings if finding.odd]
    oddities = _in_order(odd if unmarked is None else [*odd, unmarked])
    if faults or scene is None:
        raise SceneError(name, tuple(_in_order(faults)), tuple(oddities))
    return scene, oddities


def _in_order(faults: Iterable[Fault]) -> list[Fault]:
    """Sorted by their lines in the file."""
    return sorted(faults, key=lambda fault: fault.line or 0)
