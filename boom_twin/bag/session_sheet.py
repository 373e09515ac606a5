"""``session.yaml`` of a session: its notes, the scene it was recorded with, and whether the folder is whole."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from ruamel.yaml.scalarstring import DoubleQuotedScalarString, LiteralScalarString

from ..config.yaml_text import LARGEST, plain, read_plain
from ..errors import BagError
from ..system.atomic_files import write_atomic
from ..system.received_files import holds_file
from ..system.result_folder import UNFINISHED, is_unfinished
from ..types import StrokeReading
from .block_yaml import dump

FILE_NAME = "session.yaml"
RIG_ORIGIN = "synthetic session of a virtual rig (Exudyn), surrogate parameters"
_HEAD = "# What this session was made with. scene_sha256 is of the text under scene (UTF-8).\n"


@dataclass(frozen=True, slots=True)
class SessionSheet:
    """What a session was made with. What is None or empty is left out of the file.

    Attributes
    ----------
    version : str
        Of this package.
    scene, baseline, parameters, mapping : str or None
        Text of the scene file, of what is known of the rig while all is well, of the ROS parameter file, and of the file that
        names topics and sensors.
    topics : dict of str to str or None
        Type by topic that is to be recorded; None where it was not known at the start.
    note, origin : str or None
        Of the operator.
    strokes : StrokeReading or None
        What the stroke transducers read, where whoever makes the session knows it.
    twin : dict of str to object
        The parameters of the running twin; empty as long as there is none.
    started : datetime or None
        None where nothing was recorded: a synthetic session.
    """

    version: str
    scene: str | None = None
    parameters: str | None = None
    mapping: str | None = None
    topics: Mapping[str, str | None] = field(default_factory=dict)
    note: str | None = None
    origin: str | None = None
    twin: Mapping[str, object] = field(default_factory=dict)
    started: datetime | None = None
    baseline: str | None = None
    strokes: StrokeReading | None = None

    def write(self, directory: Path, counts: Sequence[Mapping[str, str | int | None]] | None = None) -> None:
        """Write ``session.yaml`` beside the bag, all of it or nothing.

        Parameters
        ----------
        directory : Path
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
            "baseline": _block(self.baseline),
            "parameters": _block(self.parameters),
            "mapping": _block(self.mapping),
        }
        text = _HEAD + dump({key: value for key, value in document.items() if value not in (None, "", {})})
        path = directory / FILE_NAME
        if len(text.encode()) > LARGEST:
            raise BagError(f"{path}: {len(text.encode())} bytes, of which {LARGEST} are read again. Shorten scene and mapping.")
        write_atomic(path, text)


@dataclass(frozen=True, slots=True)
class KeptText:
    """A text of a ``session.yaml``, and its place in words."""

    text: str
    source: str


def sheet_path(session: Path) -> Path:
    """Where the ``session.yaml`` of a session is, if it has one: in its directory, or beside its single file."""
    return (session if session.is_dir() else session.parent) / FILE_NAME


def kept(session: Path, key: str, option: str) -> KeptText | None:
    """The text that a session keeps under `key`; None if it keeps none. Whoever made the session chose it: trust nothing in it.

    Parameters
    ----------
    session : Path
    key : str
        Of ``session.yaml``: scene, baseline, parameters, mapping.
    option : str
        By which a user gives something else.

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
    """The parameters of the twin that ran beside a recording, and their place in words; none where none ran.

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
    """By topic, how many messages never reached the recorder of a session, as it counted at its end; those above 0."""
    try:
        counts = _value(sheet_path(session), "counts", "")
    except BagError:
        return {}  # whoever needs the sheet's scene or mapping is told
    rows = [row for row in counts if isinstance(row, dict)] if isinstance(counts, list | tuple) else []
    found = {str(row.get("topic")): row.get("missed") for row in rows}
    return {topic: missed for topic, missed in found.items() if isinstance(missed, int) and missed > 0}


def _value(path: Path, key: str, remedy: str) -> Any:
    """What a ``session.yaml`` has under `key`; None where there is none."""
    if not holds_file(path):
        return None
    document = read_plain(path, BagError, remedy, received=True)
    if not isinstance(document, dict | None):
        raise BagError(f"{path}: a list or a value, not what `boom_twin record` writes. {remedy}")
    return (document or {}).get(key)


def kept_origin(session: Path) -> dict[str, str]:
    """The note ``origin`` of a ``session.yaml``, for storages that keep no notes; empty where none can be read."""
    try:
        found = kept(session, "origin", "--scene")
    except BagError:
        return {}  # a note is not worth a refusal: whoever needs the sheet's scene or mapping is told
    return {"origin": found.text} if found else {}


def rig_version(session: Path) -> str:
    """Return the version of this package whose virtual rig made a session; empty if another made it, or that is not known."""
    path = sheet_path(session)
    return str(_value(path, "boom_twin", "")) if _value(path, "origin", "") == RIG_ORIGIN else ""


def sha256(text: str) -> str:
    """Digest of a text in UTF-8."""
    return hashlib.sha256(text.encode()).hexdigest()


def _block(text: str | None) -> str | None:
    """A text to be written line by line, if YAML gives it again so; quoted if not."""
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
