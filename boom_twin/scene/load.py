"""Load a scene file: `load_scene` reads its text, validates every value against the schema, and runs the cross-checks.

A line ``# end of scene`` shows that a file was not cut off, and a line in its head (`PROMISE`) says that it has one. Both are
comments, so that the file stays plain YAML. A file that promises the mark is refused without it; one that says nothing can be
used, with a warning.
"""

from __future__ import annotations

import re
import warnings
from collections.abc import Callable, Mapping
from importlib.resources import files
from pathlib import Path
from typing import Any, Literal, NamedTuple

import numpy as np
from ruamel.yaml.error import MarkedYAMLError, YAMLError
from ruamel.yaml.nodes import ScalarNode

from ..config.yaml_text import Document, Place, YamlReader, whole_text
from ..errors import Fault, SceneError, SceneWarning, UsageError
from .block_reader import NUMBER, validated
from .checks import Draft, Findings, geometry, sizes, values, whole_boom
from .schema import Scene

MAX_BYTES = 4_000_000
SURROGATE = re.compile("[\ud800-\udfff]")


class Kind(NamedTuple):
    """Expected kind of a file, and the command that prints one to start from."""

    name: str
    example: str


SCENE = Kind("scene", "boom_twin scene")


def read_text(path: Path, kind: Kind = SCENE) -> str:
    """Return the text of a scene file, or of another `kind`; SceneError unless it is UTF-8 text of at most `MAX_BYTES`."""
    try:
        with path.open("rb") as stream:
            data = stream.read(MAX_BYTES + 1)
        if len(data) > MAX_BYTES:
            bound = f"more than {MAX_BYTES // 1_000_000} MB"
            raise _refusal(kind, str(path), bound, f"A {kind.name} has a few kB: is this the right file?")
        return data.decode("utf-8-sig")
    except (OSError, ValueError) as error:
        if isinstance(error, UnicodeDecodeError):
            line = data[: error.start].count(b"\n") + 1
            bound = f"line {line} has bytes that are no text in UTF-8"
            raise _refusal(kind, str(path), bound, "Give a text file in YAML, saved with the encoding UTF-8.") from None
        reason = getattr(error, "strerror", None) or str(error)
        remedy = f"Give the path of a {kind.name} file; `{kind.example}` prints one to start from."
        raise _refusal(kind, str(path), reason, remedy) from None


def parse(text: str, source: str, kind: Kind = SCENE) -> Document:
    """Return the plain values of a YAML text, sequences as tuples, with the line of each; SceneError if it is not YAML.

    ``Document.faults`` has the parts that are YAML but not allowed here.
    """
    try:
        reader = _SceneReader(text, tuple)
    except (YAMLError, RecursionError, ValueError) as error:
        raise SceneError(source, (_syntax_fault(text, error),)) from None
    if reader.is_empty:
        raise _refusal(kind, source, "the file is empty", f"Start from the one that `{kind.example}` prints.")
    return reader.document


def _refusal(kind: Kind, source: str, bound: str, remedy: str) -> SceneError:
    return SceneError(source, (Fault(f"{kind.name} file", source, bound, remedy),))


def _syntax_fault(text: str, error: Exception) -> Fault:
    """Return the syntax error of the YAML parser as a fault, with the line that it names."""
    line, what, rows = None, "brackets nested too deeply", text.splitlines()
    if isinstance(error, MarkedYAMLError):
        mark = error.problem_mark or error.context_mark
        what = str(error.problem or error.context)
        line = None if mark is None else min(mark.line + 1, len(rows))
    elif isinstance(error, YAMLError):
        what = str(error)
    what = " ".join(what.split())
    shown = rows[line - 1].strip() if line else text[:40].strip()
    remedy = "Mend the text on this line or just above it: brackets, commas, colons, indentation."
    remedy = "Indent with spaces, not with tabs." if "\\t" in what else remedy
    return Fault("text", shown, f"this is not valid YAML, {what}", remedy, line)


class _SceneReader(YamlReader):
    """Reader that takes more spellings of numbers, and refuses half characters."""

    def text(self, node: ScalarNode, place: Place) -> Any:
        if SURROGATE.search(node.value):
            self.fault(place, node.value, "it holds half a character", "Write the text without \\uD800 to \\uDFFF.")
            return ""
        if node.style is None and NUMBER.fullmatch(node.value):  # +.5e3, which YAML takes for text
            return float(node.value)
        return node.value


PROMISE = '# This file ends with the line "# end of scene"; without it, it was cut off.'
MARK = "# end of scene"


def with_end_mark(text: str) -> str:
    """Return text with the mark in its last line, and in its first the promise of it, if that does not stand there already."""
    kept = [line for line in text.splitlines() if line != MARK]
    head = [] if PROMISE in kept else [PROMISE]
    return "\n".join([*head, *kept]).rstrip() + f"\n\n{MARK}\n"


def text_of(document: Mapping[str, Any]) -> str:
    """Return a scene file with these keys; UsageError if a value is none that YAML has."""
    try:
        return with_end_mark(whole_text(_plain(document)))
    except YAMLError as error:
        raise UsageError(f"scene: {str(error).splitlines()[0]}. Give texts, numbers, lists and dicts only.") from None


def _plain(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {key: _plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    return _plain(value.tolist()) if hasattr(value, "tolist") else value


def missing_end_mark(text: str) -> Fault | None:
    """Return a fault if the end of a scene file is cut off, a warning or a note if it may be; None if it is whole.

    Many files that were written by hand have no mark. That is a note, and a warning where not even the last line ends.
    """
    lines = text.splitlines()
    number = max((i for i, line in enumerate(lines, 1) if line.strip()), default=0)
    last = lines[number - 1].strip() if number else ""
    if last == MARK:
        return None
    if PROMISE in lines and MARK not in lines:
        bound = f"the first lines say that the file ends with `{MARK}`, and it does not: it was cut off"
        remedy = "Fetch the whole file; or, if nothing is missing, add that line."
        return Fault("end of the file", last, bound, remedy, number)
    kind: Literal["warning", "note"] = "note"
    bound = f"no line `{MARK}`, so one cannot tell whether the rest of the file was cut off"
    if not text.endswith("\n"):
        bound, kind = f"no line `{MARK}`, and not even an end of line: it may have been cut off", "warning"
    return Fault("end of the file", last, bound, "If nothing is missing, add that line at the end.", number, kind)


# -- values and checks ---------------------------------------------------------------------------------------------------


Check = Callable[[Draft], Findings]
CONSISTENCY: tuple[Check, ...] = (values.counts, values.base, values.sections, values.joints)
"""Keys that need or exclude each other. A scene with such a fault has no geometry to check."""
CHECKS: tuple[Check, ...] = (
    values.worn_pins,
    geometry.placed_pins,
    geometry.joints,
    sizes.suspects,
)
PLAUSIBILITY: tuple[Check, ...] = (
    sizes.material,
    sizes.beams,
    sizes.rigid_parts,
    sizes.moving_parts,
)
"""Checks of parts against each other, for a scene without faults."""


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
        With every fault of the first stage that has any (values, keys that need each other, geometry): place, value, bound,
        remedy.
    UsageError
        The source is none of these.

    Warns
    -----
    SceneWarning
        One for each thing that can be computed but looks odd.
    """
    if isinstance(source, Mapping):
        scene, oddities = examine_text(text_of(source), "mapping")
    elif source is None or isinstance(source, str | Path):
        scene, oddities = examine(source)
    else:
        raise UsageError(f"scene = {source!r}: give a Scene, the path of a scene file, a dict with its keys, or None.")
    for oddity in oddities:
        warnings.warn(str(oddity), SceneWarning, stacklevel=2)
    return scene


SceneSource = Scene | Mapping[str, Any] | str | Path | None
"""Forms in which functions accept a boom; a mapping has the keys of a scene file."""


def as_scene(source: SceneSource) -> Scene:
    """Return the scene that `source` is, names or describes, see `load_scene`. UsageError if it is none of `SceneSource`."""
    return source if isinstance(source, Scene) else load_scene(source)


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
    scene, findings = validated(document, Scene)
    findings += [*document.faults, *filter(None, [mark])]
    if scene is not None:
        with np.errstate(all="ignore"):  # what overflows fits nowhere, and the checks say so
            findings += _checked(Draft(document, scene))
    findings.sort(key=lambda finding: finding.line or 0)
    oddities = [finding for finding in findings if finding.kind != "fault"]
    if scene is None or len(oddities) < len(findings):
        raise SceneError(name, tuple(finding for finding in findings if finding.kind == "fault"), tuple(oddities))
    return scene, oddities


def _checked(draft: Draft) -> list[Fault]:
    """Return what the checks find; of values that do not fit together one at a key, none for a block with a finding."""
    found = [finding for check in CONSISTENCY for finding in check(draft)]
    if _is_faulty(found):
        return found
    found += [finding for check in CHECKS for finding in check(draft)]
    if _is_faulty(found):
        return found
    more: dict[str, Fault] = {}
    for check in PLAUSIBILITY:
        told = {_block(finding) for finding in (*found, *more.values())}
        for finding in check(draft):
            if _block(finding) not in told:
                more.setdefault(finding.path, finding)
    return [*found, *more.values(), *whole_boom.whole_boom(draft, [*(finding.path for finding in found), *more])]


def _is_faulty(findings: list[Fault]) -> bool:
    return any(finding.kind == "fault" for finding in findings)


def _block(finding: Fault) -> str:
    return finding.path.partition(".")[0]
