"""Read a recorded session: its files, its content, and its decoded messages in the order of log times.

A session is a rosbag2 directory, a directory of its files without ``metadata.yaml``, or one file with a suffix of `SUMMARISE`.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from functools import lru_cache
from hashlib import sha256
from importlib import import_module
from itertools import pairwise
from pathlib import Path
from typing import Any

from mcap.records import Schema
from rosbags.interfaces.typing import Typesdict
from rosbags.typesys import TypesysError, get_types_from_idl, get_types_from_msg

from ..errors import BagError
from ..messages.type_store import other_than_jazzy
from ..system.files import holds_file, sha256_of
from ..types import NANO
from .metadata import FILE_NAME, STORAGES, BagMetadata, read_metadata, refuse_packed
from .session_file import CDR, WHOLE, SessionBlocks, SessionFile, TimeWindow, compare_counts
from .session_model import incompleteness, kept_origin

SUMMARISE = {
    ".mcap": ("mcap_file", "summarise"),
    ".db3": ("other_storages", "summarise_sqlite"),
    ".bag": ("other_storages", "summarise_ros1"),
    ".csv": ("import_session", "summarise_csv"),
}
"""Module and function for each suffix; only the module that is needed is imported.

Files of rosbag2 may lie in a folder, see `STORAGES`; any other file is a session by itself.
"""


def summarise(path: Path) -> SessionFile:
    """Return the content of one file. A file with an unknown suffix is read as .mcap.

    Raise BagError if the file is missing, of another kind, cut off or damaged.
    """
    refuse_packed(path)
    module, function = SUMMARISE.get(path.suffix.lower(), SUMMARISE[".mcap"])
    found: SessionFile = getattr(import_module(f".{module}", __package__), function)(path)
    return found


def is_session(path: Path) -> bool:
    """Return True if the names of the files at `path` are those of a session."""
    if path.is_dir():
        return any(file.suffix in STORAGES for file in path.iterdir())
    return path.suffix.lower() in SUMMARISE


def refuse_absent(path: Path) -> None:
    """Raise BagError if there is no file or folder at `path`."""
    try:
        path.stat()
    except OSError as error:
        reason = "there is no such file or directory" if isinstance(error, FileNotFoundError) else error.strerror
        raise BagError(f"{path}: {reason}. Give a rosbag2 directory or a file of a session.") from None


def stored_files(path: Path, storage: str = "") -> list[Path]:
    """Return the files of a session without metadata, or only those of one storage. Raise BagError if there are none."""
    if path.is_file():
        return [path.resolve() if path.is_symlink() else path]  # the user's own word, unlike a link in a folder
    refuse_absent(path)
    kinds = {suffix for suffix, kind in STORAGES.items() if kind.startswith(storage)}
    files = sorted((file for file in path.iterdir() if file.suffix in kinds), key=_by_number)
    if not files:
        for file in sorted(path.iterdir()):
            refuse_packed(file)
        there = ", ".join(sorted(entry.name for entry in path.iterdir())[:8]) or "nothing"
        wanted = " or ".join(sorted(kinds, reverse=True))
        raise BagError(f"{path}: no {wanted} file and no {FILE_NAME} in it (there is: {there}). Give a rosbag2 directory.")
    return files


def sources(path: Path) -> tuple[list[Path], BagMetadata | None]:
    """Return the .mcap files of a session (first those that its metadata names, then others by number) and the metadata."""
    metadata: BagMetadata | None = None
    is_described = holds_file(path / FILE_NAME)
    try:
        metadata = read_metadata(path / FILE_NAME) if is_described else None
    except BagError:
        if path.is_file():
            raise
    named = [path / name for name in metadata.file_names] if metadata else []
    there = [file for file in named if holds_file(file)]
    others = [] if there and not any(path.glob("*.mcap")) else stored_files(path, "mcap")
    return there + sorted(set(others) - set(there), key=_by_number), metadata


def _by_number(path: Path) -> list[tuple[int, str]]:
    """Return a sort key that places ``session_10`` after ``session_9``."""
    return [(int(part), "") if part.isdigit() else (-1, part) for part in re.split(r"(\d+)", path.name)]


def readable(file: SessionFile, asked: Mapping[str, str]) -> set[int]:
    """Return the channels that hold CDR of the types `asked` for by topic; others of such a topic are passed over.

    Raise BagError if no channel of a topic is encoded as CDR, or a message is defined otherwise than in Jazzy.
    """
    found: set[int] = set()
    for topic, kind in asked.items():
        typed = [each for each in file.channels.values() if each.topic == topic and file.type_of(each) == kind]
        fitting = [each for each in typed if each.message_encoding == CDR]
        place = f"{file.path}: topic {topic}"
        if typed and not fitting:
            raise BagError(f"{place}: message encoding {typed[0].message_encoding!r}: only cdr is read. Use ROS 2.")
        for channel in fitting:
            for name in other_than_jazzy(_parsed(place, file.schemas[channel.schema_id], kind)):
                raise BagError(f"{place}: {name} is defined otherwise than in Jazzy. Convert the bag's messages.")
        found.update(each.id for each in fitting)
    return found


_PARSERS: dict[str, Callable[[str, str], Typesdict]] = {
    "ros2msg": get_types_from_msg,
    "ros2idl": lambda text, _: get_types_from_idl(text),
}
_SEPARATOR = re.compile(r"^={3,}[ \t]*$", re.MULTILINE)  # line between definitions, for which rosbags requires 80 characters


def _parsed(place: str, schema: Schema, kind: str) -> Typesdict:
    """Return the types in a schema; none where the recorder did not know the definition and left it empty."""
    if not schema.data:
        return {}
    if schema.encoding not in _PARSERS:
        encodings = " and ".join(_PARSERS)
        raise BagError(f"{place}: schema encoding {schema.encoding!r}: only {encodings} are read. Record with ROS 2.")
    try:
        return _types_in(schema.encoding, schema.data, kind)
    except TypesysError as error:
        raise BagError(f"{place}: its definition cannot be parsed ({error}). Record the session again.") from error


@lru_cache(100)  # each reader of a session asks for the same few
def _types_in(encoding: str, data: bytes, kind: str) -> Typesdict:
    text = re.sub(r"\r\n?", "\n", data.decode("utf-8-sig", "replace"))
    return _PARSERS[encoding](_SEPARATOR.sub("=" * 80, text), kind)


RECOVERED = "recovered from"  # key of the note on a session that was recovered from a damaged one


@dataclass(frozen=True, slots=True)
class TopicInfo:
    """One topic of a session: name, type (``package/msg/Name``, several joined by " and ") and number of messages."""

    name: str
    type: str
    count: int


@dataclass(frozen=True, slots=True)
class Session:
    """Content of a session."""

    path: Path
    files: tuple[SessionFile, ...]
    topics: tuple[TopicInfo, ...]  # topics, sorted by name
    start: int  # start, end: first and last log time in nanoseconds; 0 without messages
    end: int
    # True if all its messages are under a checksum. Without (the default of ``ros2 bag record``), a flipped bit in a value
    # cannot be detected
    checked: bool
    notes: dict[str, str]  # notes of the writer, for instance that the session is synthetic
    metadata: BagMetadata | None  # content of ``metadata.yaml``; None without one
    incomplete: str  # reason why the session is not whole, if its folder says so; else empty

    def find(self, name: str) -> TopicInfo | None:
        """Return a topic by its name, with or without its leading slash; None if it is missing."""
        return next((topic for topic in self.topics if topic.name.lstrip("/") == name.lstrip("/")), None)

    def count(self, name: str) -> int:
        """Return the number of messages of a topic; 0 if it is missing."""
        return sum(topic.count for topic in self.topics if topic.name.lstrip("/") == name.lstrip("/"))


def files_sha256(session: Session) -> str:
    """Return the SHA-256 over the SHA-256 digests of the files of a session, in their order."""
    return sha256(b"".join(bytes.fromhex(sha256_of(file.path)) for file in session.files)).hexdigest()


def scan(path: Path) -> Session:
    """Return the content of the session at `path`. Messages of a file with a summary are not read.

    Raise BagError if there is no session, a file is damaged or cut off, or its counts differ from ``metadata.yaml``.
    """
    told = incompleteness(path)
    try:
        return _scan(path, told)
    except BagError as error:
        if not told:
            raise
        raise BagError(f"{error} It is {told}") from None


def _scan(path: Path, incomplete: str) -> Session:
    metadata = read_metadata(path / FILE_NAME) if holds_file(path / FILE_NAME) else None
    named = [path / name for name in metadata.file_names] if metadata else stored_files(path)
    files = tuple(summarise(file) for file in named)
    there = path.iterdir() if metadata else ()
    if unlisted := sorted(file.name for file in there if file.suffix in STORAGES and file not in named):
        raise BagError(
            f"{path}: {FILE_NAME} does not name {', '.join(unlisted)}: the recorder was ended by force. "
            "`boom_twin recover BAG --out DIR` saves all of it; or move the file away."
        )
    topics = _topics(files)
    notes = {key: value for file in files for key, value in file.notes.items()}
    if metadata is not None:
        compare_counts(path, FILE_NAME, metadata.counts, "files", {topic.name: topic.count for topic in topics})
        notes |= metadata.notes
    if "origin" not in notes:
        notes |= kept_origin(path)
    filled = [file for file in files if any(file.counts.values())]
    return Session(
        path=path,
        files=files,
        topics=topics,
        start=min((file.start for file in filled), default=0),
        end=max((file.end for file in filled), default=0),
        checked=all(file.checked for file in filled),
        notes=notes,
        metadata=metadata,
        incomplete="" if RECOVERED in notes else incomplete or ("" if metadata else _overlap(filled)),
    )


def _overlap(files: Sequence[SessionFile]) -> str:
    """Return a warning if two files overlap in time, as those of one recorder do only if its clock is set back."""
    queue = 10**9  # ns, longest time that a message waits in a recorder
    for one, other in pairwise(sorted(files, key=lambda file: file.start)):
        if (shared := min(one.end, other.end) - max(one.start, other.start)) > queue:
            names = f"{one.path.name} and {other.path.name}"
            return f"{names} overlap by {shared * NANO:.1f} s. If they are two recordings, give each a folder of its own."
    return ""


def read(session: Session, wanted: Mapping[str, str], window: TimeWindow = WHOLE) -> Iterator[tuple[str, int, Any]]:
    """Return an iterator over topic (as in `wanted`), log time (ns) and decoded message, in the order of log times.

    `wanted` has the message type by topic, with or without the leading slash. Messages outside the `window` are left out.

    Raise BagError at once if a topic is missing, empty, or of another type, encoding or definition. Raise it while iterating if
    a checksum does not fit, a message cannot be decoded, or none is in the window; at the end if the files did not hold what
    their statistics say.
    """
    return ((name, time, message) for name, time, _, message in read_both(session, wanted, window))


def read_both(session: Session, wanted: Mapping[str, str], window: TimeWindow = WHOLE) -> Iterator[tuple[str, int, bytes, Any]]:
    """Return an iterator as `read` does, with the encoded message before the decoded one (None for a type unknown to Jazzy)."""
    blocks = read_blocks(session, wanted, window)
    return (
        (blocks.sources[source].name, time, block.data(row), blocks.decoded(block, row))
        for block in blocks
        for row, (source, time) in enumerate(zip(block.sources.tolist(), block.log_times.tolist(), strict=True))
    )


def read_blocks(session: Session, wanted: Mapping[str, str], window: TimeWindow = WHOLE) -> SessionBlocks:
    """Return the messages that `read` gives as blocks of messages, not decoded yet."""
    asked: dict[str, str] = {}
    types: dict[str, str] = {}
    for name, type_name in wanted.items():
        topic = check_topic(session, name, type_name).name
        asked[topic], types[topic] = name, type_name
    return SessionBlocks([(file, readable(file, types)) for file in session.files], asked, window)


_AND = " and "  # separator between the types of a topic that has several


def _topics(files: tuple[SessionFile, ...]) -> tuple[TopicInfo, ...]:
    """Return the topics of all files together, sorted by name."""
    counts: Counter[str] = Counter()
    types: dict[str, dict[str, None]] = {}
    for file in files:
        for channel in file.channels.values():
            types.setdefault(channel.topic, {})[file.type_of(channel)] = None
            counts[channel.topic] += file.counts.get(channel.id, 0)
    return tuple(TopicInfo(name, _AND.join(types[name]), counts[name]) for name in sorted(types))


def check_topic(session: Session, name: str, type_name: str) -> TopicInfo:
    """Return the topic with this name. Raise BagError if it is missing, of another type or empty."""
    topic = session.find(name)
    if topic is None:
        names = [known.name for known in session.topics]
        near = get_close_matches("/" + name.lstrip("/"), names, n=1, cutoff=0.5)
        remedy = "Record it, or give its name in a mapping."
        if near and near[0].endswith(own := "/" + name.lstrip("/")):
            namespace = near[0].removesuffix(own).lstrip("/")
            remedy = f"Give {near[0]} as its name in a mapping, or `boom_twin replay --namespace {namespace}`."
        elif near:
            remedy = f"If {near[0]} is that topic, give its name in a mapping. Else record it."
        if (below := f"rt/{name.lstrip('/')}") in names:
            remedy = f"Its names are those of DDS, not of ROS: give {below} as the topic's name in a mapping."
        raise BagError(f"{session.path}: no topic {name}; the session has {', '.join(names) or 'none'}. {remedy}")
    if type_name not in topic.type.split(_AND):
        raise BagError(f"{session.path}: topic {topic.name} has type {topic.type!r}, not {type_name}. Remap the topic.")
    if topic.count == 0:
        raise BagError(f"{session.path}: topic {topic.name} has no messages. Check that its publisher was running.")
    return topic
