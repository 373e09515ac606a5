"""Session metadata in ``session.yaml``: notes, the scene at recording, and the state of the folder."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from ruamel.yaml.scalarstring import DoubleQuotedScalarString, LiteralScalarString

from ..config.yaml_text import LARGEST_FILE, plain, read_plain
from ..errors import BagError
from ..system.atomic_files import write_atomic
from ..system.received_files import holds_file
from ..system.result_folder import UNFINISHED, is_unfinished
from ..types import StrokeReading
from .metadata import dump

FILE_NAME = "session.yaml"
RIG_ORIGIN = "synthetic session of a virtual rig (Exudyn), surrogate parameters"
_HEAD = "# What this session was made with. scene_sha256 is of the text under scene (UTF-8).\n"


@dataclass(frozen=True, slots=True)
class SessionSheet:
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

        Parameters
        ----------
        counts : sequence of dict, optional
            At the end: each topic with what became of its messages; None is unknown. A recording that was killed has none.

        Raises
        ------
        BagError
            The disk is full or fails, or the file would be larger than what is read again.
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
            raise BagError(f"{path}: {size} bytes, of which {LARGEST_FILE} are read again. Shorten scene and mapping.")
        write_atomic(path, text)


@dataclass(frozen=True, slots=True)
class KeptText:
    """A text of a ``session.yaml``, and a description of its place."""

    text: str
    source: str


def sheet_path(session: Path) -> Path:
    """Return the path of the ``session.yaml`` of a session: in its directory, or beside its single file."""
    return (session if session.is_dir() else session.parent) / FILE_NAME


def kept(session: Path, key: str, option: str) -> KeptText | None:
    """Return the text that a session keeps under `key`; None without one. The text is untrusted input.

    Parameters
    ----------
    key : str
        Key of ``session.yaml``: scene, parameters, mapping, ..
    option : str
        Option by which a user gives another text, for the error message.

    Raises
    ------
    BagError
        ``session.yaml`` cannot be read, or holds something else there.
    """
    path, remedy = sheet_path(session), f"Move it away, or give the {key} by {option}."
    text = _value(path, key, remedy)
    if not isinstance(text, str | None):
        raise BagError(f"{path}, {key}: not a text, as `boom_twin record` writes it. {remedy}")
    return KeptText(text, f"{path}, {key}") if text else None


def kept_parameters(session: Path) -> tuple[dict[str, Any], str]:
    """Return the parameters of the twin that ran beside a recording, and a description of their place; empty without a twin.

    Raises
    ------
    BagError
        ``session.yaml`` cannot be read, or holds something else there.
    """
    path, remedy = sheet_path(session), "Move it away, or give the parameters by --params."
    values = _value(path, "twin", remedy)
    if not isinstance(values, dict | None):
        raise BagError(f"{path}, twin: not a block of names and values, as `boom_twin record` writes it. {remedy}")
    return values or {}, f"{path}, twin"


def missed_messages(session: Path) -> dict[str, int]:
    """Return the number of messages that never reached the recorder, by topic, as counted at its end; only those above 0."""
    try:
        counts = _value(sheet_path(session), "counts", "")
    except BagError:
        return {}  # whoever needs the sheet's scene or mapping is told
    rows = [row for row in counts if isinstance(row, dict)] if isinstance(counts, list | tuple) else []
    found = {str(row.get("topic")): row.get("missed") for row in rows}
    return {topic: missed for topic, missed in found.items() if isinstance(missed, int) and missed > 0}


def _value(path: Path, key: str, remedy: str) -> Any:
    """Return the value of a ``session.yaml`` under `key`; None without file or key."""
    if not holds_file(path):
        return None
    document = read_plain(path, BagError, remedy, received=True)
    if not isinstance(document, dict | None):
        raise BagError(f"{path}: a list or a value, not what `boom_twin record` writes. {remedy}")
    return (document or {}).get(key)


def kept_origin(session: Path) -> dict[str, str]:
    """Return the note ``origin`` of a ``session.yaml``, for storages without notes; empty if it cannot be read."""
    try:
        found = kept(session, "origin", "--scene")
    except BagError:
        return {}  # a note is not worth a refusal: whoever needs the sheet's scene or mapping is told
    return {"origin": found.text} if found else {}


def rig_version(session: Path) -> str:
    """Return the version of this package whose virtual rig made a session; empty for another or unknown origin."""
    path = sheet_path(session)
    return str(_value(path, "boom_twin", "")) if _value(path, "origin", "") == RIG_ORIGIN else ""


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

    Parameters
    ----------
    path : Path
        Folder or a file in it; also ``bag`` in the folder of a replay, and ``A/bag`` in that of a comparison.
    """
    folder = path if path.is_dir() else path.parent
    for place in (folder, *folder.resolve().parents[:2]):
        if is_unfinished(place):
            return f"incomplete: {place / UNFINISHED} says that its command was stopped, or is still at work. Run it again."
    sheet = folder / FILE_NAME
    if sheet.is_file():
        with sheet.open("rb") as stream:
            text = stream.read(LARGEST_FILE)
        if _BEGUN.search(text) and not _ENDED.search(text):
            return f"incomplete: the recorder was ended by force, or is still at work: {sheet} tells no end."
    return ""
