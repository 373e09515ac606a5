"""Session metadata in ``session.yaml``, and the choice of scene, settings and mapping: given, the session's, or the package's.

An invalid given file raises UsageError (a scene: SceneError). An invalid text of the session raises BagError, with the
option that gives another.
"""

from __future__ import annotations

import hashlib
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from ruamel.yaml.scalarstring import DoubleQuotedScalarString, LiteralScalarString

from ..config.settings import Settings, checked, load_settings
from ..config.yaml_text import LARGEST_FILE, plain, read_plain, words
from ..errors import BagError, Fault, SceneError, UsageError
from ..messages.mapping import load_mapping, mapping_from
from ..messages.topic_table import Topics
from ..scene.edit import anew, differences
from ..scene.load import DEFAULT_NAME, SceneSource, as_scene, default_text, examine_text, read_text
from ..scene.schema import Scene
from ..system.files import holds_file, write_atomic
from ..system.result_folder import UNFINISHED, is_unfinished
from ..types import Stream, StrokeReading
from .metadata import dump

FILE_NAME = "session.yaml"
RIG_ORIGIN = "synthetic session of a virtual rig (Exudyn), surrogate parameters"
_HEAD = "# What this session was made with. scene_sha256 is of the text under scene (UTF-8).\n"


@dataclass(frozen=True, slots=True)
class SessionMetadata:
    """Metadata of a session: version, scene, settings and mapping. A field that is None or empty is left out of the file."""

    version: str
    # scene, parameters, mapping: text of the scene file, of the ROS parameter file, and of the file that names topics and
    # sensors
    scene: str | None = None
    parameters: str | None = None
    mapping: str | None = None
    # type by topic to be recorded; None for a type unknown at the start
    topics: Mapping[str, str | None] = field(default_factory=dict)
    note: str | None = None  # note, origin: note of the operator, and origin of the session
    origin: str | None = None
    twin: Mapping[str, object] = field(default_factory=dict)  # parameters of the running twin; empty without a twin
    started: datetime | None = None  # start of the recording; None for a synthetic session
    strokes: StrokeReading | None = None  # quantity that the stroke transducers read; None if unknown

    def write(self, directory: Path, counts: Sequence[Mapping[str, str | int | None]] | None = None) -> None:
        """Write ``session.yaml`` beside the bag, all of it or nothing.

        `counts` are given at the end: each topic with what became of its messages; None is unknown. A recording that was
        killed has none. Raise BagError if the disk is full or fails, or the file would be larger than what is read again.
        """
        end = {} if counts is None else {"ended": _time(datetime.now(UTC)), "counts": [dict(each) for each in counts]}
        document = {
            "boom_twin": self.version,
            "started": self.started and _time(self.started),
            **end,
            "origin": self.origin,
            "note": self.note,
            "strokes": self.strokes and self.strokes.value,
            "topics": dict(self.topics),
            "twin": dict(self.twin),
            "scene_sha256": sha256(self.scene) if self.scene else None,
            "scene": _block(self.scene),
            "parameters": _block(self.parameters),
            "mapping": _block(self.mapping),
        }
        text = _HEAD + dump({key: value for key, value in document.items() if value not in (None, "", {})})
        path = directory / FILE_NAME
        if (size := len(text.encode())) > LARGEST_FILE:
            raise BagError(f"{path}: {size} bytes, but at most {LARGEST_FILE} can be read. Shorten scene and mapping.")
        write_atomic(path, text)


@dataclass(frozen=True, slots=True)
class KeptText:
    """A text of a ``session.yaml``, and a description of its place."""

    text: str
    source: str


def session_yaml(session: Path) -> Path:
    """Return the path of the ``session.yaml`` of a session: in its directory, or beside its single file."""
    return (session if session.is_dir() else session.parent) / FILE_NAME


def kept(session: Path, key: str, option: str) -> KeptText | None:
    """Return the text that a session keeps under `key`; None without one. The text is untrusted input.

    `key` is one of ``session.yaml``: scene, parameters, mapping, .. The error names the `option` by which a user gives another
    text. Raise BagError if ``session.yaml`` cannot be read, or holds something else there.
    """
    path, remedy = session_yaml(session), f"Move it away, or give the {key} by {option}."
    text = _value(path, key, remedy)
    if not isinstance(text, str | None):
        raise BagError(f"{path}, {key}: not a text, as `boom_twin record` writes it. {remedy}")
    return KeptText(text, f"{path}, {key}") if text else None


def missed_messages(session: Path) -> dict[str, int]:
    """Return the number of messages that never reached the recorder, by topic, as counted at its end; only those above 0."""
    try:
        counts = _value(session_yaml(session), "counts", "")
    except BagError:
        return {}  # whoever needs its scene or mapping is told
    rows = [row for row in counts if isinstance(row, dict)] if isinstance(counts, list | tuple) else []
    found = {str(row.get("topic")): row.get("missed") for row in rows}
    return {topic: missed for topic, missed in found.items() if isinstance(missed, int) and missed > 0}


def _value(path: Path, key: str, remedy: str) -> Any:
    """Return the value of a ``session.yaml`` under `key`; None without file or key."""
    if not holds_file(path):
        return None
    document = read_plain(path, BagError, remedy, received=True)
    if not isinstance(document, dict | None):
        raise BagError(f"{path}: holds a list or a value, but names with values are needed. {remedy}")
    return (document or {}).get(key)


def kept_origin(session: Path) -> dict[str, str]:
    """Return the note ``origin`` of a ``session.yaml``, for storages without notes; empty if it cannot be read."""
    try:
        found = kept(session, "origin", "--scene")
    except BagError:
        return {}  # a note is not worth a refusal: whoever needs its scene or mapping is told
    return {"origin": found.text} if found else {}


def sha256(text: str) -> str:
    """Return the SHA-256 of a text in UTF-8, as hexadecimal digits."""
    return hashlib.sha256(text.encode()).hexdigest()


def _block(text: str | None) -> str | None:
    """Return a text as a YAML literal block if YAML reads it back unchanged, else as a quoted string."""
    if not text:
        return None
    block: str = LiteralScalarString(text)
    try:
        if plain(dump({"": block})) == {"": text}:
            return block
    except ValueError:
        pass
    quoted: str = DoubleQuotedScalarString(text)
    return quoted


def _time(moment: datetime) -> str:
    return moment.isoformat(timespec="milliseconds")


_BEGUN, _ENDED = (re.compile(rb"^%b:" % key, re.MULTILINE) for key in (b"started", b"ended"))
"""Patterns of the lines that the recorder writes at its start and at its end. Texts in ``session.yaml`` are indented."""


def incompleteness(path: Path) -> str:
    """Return the reason why a session or a result is incomplete; empty if its folder does not mark it as incomplete.

    `path` is a folder or a file in it; also ``bag`` in the folder of a replay, and ``A/bag`` in that of a comparison.
    """
    folder = path if path.is_dir() else path.parent
    for place in (folder, *folder.resolve().parents[:2]):
        if is_unfinished(place):
            return f"incomplete: {place / UNFINISHED} says that its command was stopped, or is still at work. Run it again."
    file = folder / FILE_NAME
    if file.is_file():
        with file.open("rb") as stream:
            text = stream.read(LARGEST_FILE)
        if _BEGUN.search(text) and not _ENDED.search(text):
            return f"incomplete: the recorder was ended by force, or is still at work: {file} tells no end."
    return ""


DEFAULT_MAPPING = "default mapping"
DEFAULT_PARAMETERS = "default parameters"
GIVEN = "given as a Scene"  # source of a scene that came by no file


@dataclass(frozen=True)
class SessionScene:
    """A scene, its text, and the source of the text."""

    scene: Scene
    text: str
    source: str  # path, place in a ``session.yaml``, or `DEFAULT_NAME`
    oddities: tuple[Fault, ...] = ()  # values that can be computed but are implausible

    @property
    def sha256(self) -> str:
        return sha256(self.text)


@dataclass(frozen=True, slots=True)
class Mapped:
    """Mapping of topics and sensors, and its source."""

    topics: Topics
    source: str


def scene_from(source: SceneSource | SessionScene) -> SessionScene:
    """Return a scene with its text, from a file or a program, or that of the package for None; see `boom_twin.load_scene`."""
    if isinstance(source, SessionScene):
        return source
    if source is not None and not isinstance(source, str | Path):
        scene = as_scene(source)
        return SessionScene(scene, anew(scene), GIVEN)
    name = DEFAULT_NAME if source is None else str(source)
    text = default_text() if source is None else read_text(Path(source))
    scene, oddities = examine_text(text, name)
    return SessionScene(scene, text, name, tuple(oddities))


def scene_of(session: Path, given: SceneSource | SessionScene = None) -> SessionScene:
    """Return the scene of a session: what is `given`, else from its ``session.yaml``, else from the package."""
    if given is not None:
        found = scene_from(given)
        return replace(found, oddities=(*found.oddities, *_other_values(session, found)))
    if (own := kept(session, "scene", "--scene")) is None:
        return scene_from(None)
    recorded, digest = kept(session, "scene_sha256", "--scene"), sha256(own.text)
    try:
        scene, oddities = examine_text(own.text, own.source, whole=recorded is not None and recorded.text == digest)
    except SceneError as error:
        more = f" (and {len(error.faults) - 1} more)" if len(error.faults) > 1 else ""
        raise BagError(f"{own.source}: {error.faults[0]}{more} Give the scene by --scene.") from None
    if recorded is not None and recorded.text != digest:
        bound = f"{own.source} has {digest[:12]}..: it was changed after the recording"
        oddities = [Fault("scene_sha256", recorded.text, bound, "Give the right scene by --scene."), *oddities]
    return SessionScene(scene, own.text, own.source, tuple(oddities))


def _other_values(session: Path, given: SessionScene) -> list[Fault]:
    """Return a note if a scene has other values than the scene that the session keeps, as that of another boom has."""
    try:
        own = kept(session, "scene", "--scene")
        if own is None or own.text == given.text:
            return []
        others = differences(examine_text(own.text, own.source)[0], given.scene)
    except (BagError, SceneError):
        return []  # whoever reads that scene is told
    if not others:
        return []
    (place, value), more = others[0], f", and {len(others) - 1} more" if len(others) > 1 else ""
    told = f"differs from the scene of the session ({own.source}){more}"
    return [Fault(words(place), value, told, "If it is of another boom, leave out --scene.", kind="note")]


@dataclass(frozen=True, slots=True)
class SessionSettings:
    """Settings of the twin and their source."""

    settings: Settings
    source: str

    @property
    def others(self) -> dict[str, float]:
        """Settings that differ from the defaults of the package."""
        usual = Settings().model_dump()
        return {name: value for name, value in self.settings.model_dump().items() if value != usual[name]}


def settings_of(session: Path, given: Path | None = None, namespace: str = "") -> SessionSettings:
    """Return the settings of a session's twin.

    The source is the parameter file `given` for the node in `namespace`, else the node that ran during the recording, else the
    package. Raise BagError if ``session.yaml`` cannot be read, or holds something else there.
    """
    if given is not None:
        return SessionSettings(load_settings(given, namespace), str(given))
    path, remedy = session_yaml(session), "Move it away, or give the parameters by --params."
    values, source = _value(path, "twin", remedy), f"{path}, twin"
    if not isinstance(values, dict | None):
        raise BagError(f"{source}: not a block of names and values, as `boom_twin record` writes it. {remedy}")
    own = {name: value for name, value in (values or {}).items() if name in Settings.model_fields}  # the rest is the node's
    try:
        return SessionSettings(checked(Settings, own, source), source if own else DEFAULT_PARAMETERS)
    except UsageError as error:
        raise BagError(f"{error} Give the parameters by --params.") from None


def mapping_of(session: Path, given: Path | None = None, joints: int | None = None, namespace: str = "") -> Mapped:
    """Return the mapping of a session, from the same sources as the scene in `scene_of`.

    Names without a leading slash are relative to the `namespace` of the node. Raise UsageError if the mapping, given or the
    session's, has faults.
    """
    own = kept(session, "mapping", "--mapping") if given is None else None
    if own is None:
        found = Mapped(load_mapping(given, joints), DEFAULT_MAPPING if given is None else str(given))
    else:
        try:
            found = Mapped(mapping_from(plain(own.text), own.source, joints), own.source)
        except ValueError as error:
            raise BagError(f"{own.source}: not YAML ({error}). Give the mapping by --mapping.") from None
    return Mapped(found.topics.in_namespace(namespace), found.source) if namespace.strip("/") else found


def mapping_text(session: Path, given: Path | None = None) -> str:
    """Return the text of a mapping that `mapping_of` has read; empty for the package's own."""
    if given is not None:
        return given.read_text(encoding="utf-8-sig")
    own = kept(session, "mapping", "--mapping")
    return "" if own is None else own.text


@dataclass(frozen=True, slots=True)
class SessionStrokes:
    """Quantity that drives the model in a session, and the source of this."""

    reading: StrokeReading
    source: str


def strokes_of(session: Path | None, mapped: Mapped) -> SessionStrokes:
    """Return the quantity that drives the model in a session. `session` is None for a running rig.

    It is angles if the mapping says so, else what stroke transducers read. The mapping's ``reads`` comes first, then
    ``strokes`` of ``session.yaml``. The default is lengths. It is drives for the virtual rig before version 0.2.
    """
    lengths_since = 0, 2  # first version of the virtual rig whose transducers read lengths
    if mapped.topics.drive == "angles":
        return SessionStrokes(StrokeReading.ANGLE, f"{mapped.source}, drive")
    if told := mapped.topics.inputs[Stream.STROKES].reads:
        return SessionStrokes(StrokeReading(told), f"{mapped.source}, inputs.cylinder_strokes.reads")
    if session is not None and (own := kept(session, "strokes", "--mapping")):
        try:
            return SessionStrokes(StrokeReading(own.text), own.source)
        except ValueError:
            bound = f"it must be {' or '.join(StrokeReading)}"
            raise BagError(f"{own.source}: {own.text[:60]!r}: {bound}. Give reads in a mapping by --mapping.") from None
    path = None if session is None else session_yaml(session)
    version = str(_value(path, "boom_twin", "")) if path and _value(path, "origin", "") == RIG_ORIGIN else ""
    made = re.match(r"(\d{1,9})\.(\d{1,9})", version)
    if made and (int(made[1]), int(made[2])) < lengths_since:
        return SessionStrokes(StrokeReading.DRIVE, f"made by the virtual rig of version {version}")
    return SessionStrokes(StrokeReading.LENGTH, "the default; for drives give reads: drive in a mapping")
