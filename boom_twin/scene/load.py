"""Load a scene file: `load_scene` reads, validates every value against the schema, and runs the cross-checks."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np

from ..config.yaml_text import Document, Place
from ..errors import Fault, SceneError, SceneWarning, UsageError
from .block_reader import inner_block, validated
from .checks import Draft, Findings, geometry, linkages, sizes, values, whole_boom
from .schema import Scene
from .yaml_reader import missing_end_mark, parse, read_text, text_of


def structure(document: Document) -> tuple[Scene | None, Draft, list[Fault]]:
    """Return the scene (None if a value is not good by itself), what is usable of it, and all faults of single values."""
    read = validated(document, Scene)
    deep = (("sections",), ("joints",), ("postures",))
    broken = {place[:2] if place[:1] in deep else place[:1] for place in read.broken}
    return read.block, _draft(document, read.known, broken), list(read.faults)


def _draft(document: Document, known: Any, broken: set[Place]) -> Draft:
    """Return the usable parts of `known`: everything that is neither in `broken` nor inside it."""
    if not isinstance(known, dict):
        return Draft(document)
    usable = {key: value for key, value in known.items() if (key,) not in broken}
    blocks: dict[str, Any] = {}
    for key, value in usable.items():
        model = inner_block(Scene, key)
        if key in ("sections", "joints") and model is not None:
            items = enumerate(value)
            blocks[key] = tuple(None if (key, i) in broken else model.model_validate(v, strict=True) for i, v in items)
        elif key == "postures":
            blocks[key] = {name: angles for name, angles in value.items() if (key, name) not in broken}
        elif key != "description":
            blocks[key] = value if model is None else model.model_validate(value, strict=True)
    return Draft(document, **blocks)


CHECKS: tuple[Callable[[Draft], Findings], ...] = (
    values.counts,
    values.sections,
    values.modes,
    values.joints,
    geometry.placed_pins,
    geometry.thin_parts,
    geometry.centres,
    values.worn_pins,
    geometry.joints,
    sizes.suspects,
)


PLAUSIBILITY: tuple[Callable[[Draft, Scene], Findings], ...] = (
    sizes.material,
    sizes.beams,
    sizes.rigid_parts,
    sizes.moving_parts,
    linkages.clear_cylinders,
    linkages.spaced_pins,
)
"""Of a scene without faults: parts against each other."""


DEFAULT_NAME = "default scene"


def default_text() -> str:
    """Return the text of the package's default scene."""
    return _text("msg_config", "scene.yaml")


def clearance_text() -> str:
    """Return the text of the package's block `clearance`, which can follow the default scene."""
    return _text("msg_config", "clearance.yaml")


def example_names() -> tuple[str, ...]:
    """Return the names of the package's example scenes."""
    return tuple(sorted(file.name.removesuffix(".yaml") for file in (files("boom_twin") / "examples").iterdir()))


def example_text(name: str) -> str:
    """Return the text of one of the package's example scenes."""
    return _text("examples", f"{name}.yaml")


def _text(folder: str, name: str) -> str:
    return (files("boom_twin") / folder / name).read_text(encoding="utf-8")


def load_scene(source: str | Path | Mapping[str, Any] | None = None) -> Scene:
    """Load a boom as its scene file describes it.

    Parameters
    ----------
    source : str, Path or dict, optional
        A YAML file, or a dict with the keys of one; without it, the package's default scene.

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
    if isinstance(source, Mapping):
        scene, oddities = examine_text(text_of(source), "mapping")
    else:
        scene, oddities = examine(source)
    for oddity in oddities:
        warnings.warn(str(oddity), SceneWarning, stacklevel=2)
    return scene


SceneSource = Scene | Mapping[str, Any] | str | Path | None
"""Forms in which functions accept a boom; a mapping has the keys of a scene file."""


def as_scene(source: SceneSource) -> Scene:
    """Return the scene that `source` is, names or describes, see `load_scene`. UsageError if it is none of `SceneSource`."""
    if isinstance(source, Scene):
        return source
    if source is None or isinstance(source, str | Path | Mapping):
        return load_scene(source)
    raise UsageError(f"scene = {source!r}: give a Scene, the path of a scene file, a dict with its keys, or None.")


def examine(source: str | Path | None = None) -> tuple[Scene, list[Fault]]:
    """Load a scene like `load_scene`, but return the warnings instead of issuing them."""
    if source is None:
        return examine_text(default_text(), DEFAULT_NAME)
    return examine_text(read_text(Path(source)), str(source))


def examine_text(text: str, name: str, whole: bool = False) -> tuple[Scene, list[Fault]]:
    """Load a scene from its text like `examine`; `name`: its name in errors; `whole`: a checksum says it is not cut off."""
    mark = None if whole else missing_end_mark(text)
    if mark is not None and mark.kind == "fault":
        raise SceneError(name, (mark,))
    document = parse(text, name)
    scene, draft, faults = structure(document)
    with np.errstate(all="ignore"):  # what overflows fits nowhere, and the checks say so
        findings = [finding for check in CHECKS for finding in check(draft)]
        if scene is not None and not faults and all(finding.kind != "fault" for finding in findings):
            findings += _implausible(draft, scene, findings)
    findings = sorted([*faults, *document.faults, *findings, *filter(None, [mark])], key=lambda finding: finding.line or 0)
    oddities = [finding for finding in findings if finding.kind != "fault"]
    if scene is None or len(oddities) < len(findings):
        raise SceneError(name, tuple(finding for finding in findings if finding.kind == "fault"), tuple(oddities))
    return scene, oddities


def _implausible(draft: Draft, scene: Scene, findings: list[Fault]) -> list[Fault]:
    """Return warnings of values that do not fit together: one at a key, none for a block that has a finding already."""
    more: dict[str, Fault] = {}
    for check in PLAUSIBILITY:
        told = {_block(finding) for finding in (*findings, *more.values())}
        for finding in check(draft, scene):
            if _block(finding) not in told:
                more.setdefault(finding.path, finding)
    return [*more.values(), *whole_boom.whole_boom(draft, scene, [*(finding.path for finding in findings), *more])]


def _block(finding: Fault) -> str:
    """Return ``sections[1]`` of ``sections[1].root.mass``."""
    return finding.path.partition(".")[0]
