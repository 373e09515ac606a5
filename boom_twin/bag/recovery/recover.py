"""Recover a damaged session: write a new, sound one with all that can be saved, and a truthful count."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from hashlib import sha256
from pathlib import Path

from mcap.opcode import Opcode
from mcap.records import Channel, ChunkIndex, DataEnd, Header, Metadata, Schema, Statistics

from ...config.yaml_text import LARGEST_FILE
from ...errors import BagError
from ...system.atomic_files import write_atomic
from ...system.received_files import holds_file, open_received
from ...system.result_folder import RECOVER, result_folder
from ..mcap_file import NOTES, PROFILE
from ..mcap_records import LARGEST_SUMMARY, MESSAGE_HEAD, checksum_of, parts, record_of, summary_start
from ..metadata import BagMetadata, Recorded, offered_qos, profiles
from ..reader import RECOVERED, scan, sources
from ..session_file import as_bag_error, by_topic
from ..session_sheet import sheet_path
from ..storages import SUMMARISE
from ..writer import BagWriter
from .scanner import DamagedBytes, SoundRecords, scan_damaged

_DEFINITIONS = {Opcode.CHANNEL, Opcode.SCHEMA}
_NOTES = {Opcode.HEADER, Opcode.METADATA, Opcode.DATA_END}
_INDEXES = {Opcode.STATISTICS, Opcode.CHUNK_INDEX}


@dataclass(slots=True)
class FileDefinitions:
    """Definitions, notes and counts of one damaged file."""

    # channels, schemas: channels and schemas by number; a definition under a checksum replaces one without
    channels: dict[int, Channel] = field(default_factory=dict)
    schemas: dict[int, Schema] = field(default_factory=dict)
    notes: dict[str, str] = field(default_factory=dict)
    told: Counter[str] | None = None  # number of messages by topic from a sound summary
    is_summed: bool = False  # True if the checksum of all bytes up to the end of the data fits
    # chunks in a sound summary's index, by first and last log time (ns) and content size
    listed: Counter[tuple[int, int, int]] = field(default_factory=Counter)

    def topic(self, channel: int, metadata: BagMetadata | None) -> Recorded | None:
        """Return the topic of a channel; None if its definition is lost."""
        found = self.channels.get(channel)
        schema = self.schemas.get(found.schema_id) if found else None
        if found is None or schema is None:
            return None
        entries = metadata.topics_with_message_count if metadata else []
        known = next((each.topic_metadata for each in entries if each.topic_metadata.name == found.topic), None)
        offered = known.offered_qos_profiles if known else found.metadata.get("offered_qos_profiles", "")
        return Recorded(
            topic=found.topic,
            type=schema.name,
            definition=schema.data,
            details=found.metadata,
            qos=[profile for qos in profiles(offered) for profile in offered_qos(qos)],
            type_hash=known.type_description_hash if known else found.metadata.get("topic_type_hash", ""),
            encoding=found.message_encoding,
            definition_encoding=schema.encoding,
        )


def definitions_of(path: Path, unverified: bool = False) -> FileDefinitions:
    """Return the definitions, notes and counts of a file from one walk through it.

    A definition is used if the checksum of its chunk or of the summary fits or is missing. With `unverified`, definitions at
    the start of a truncated or corrupt chunk are used too.

    Raises
    ------
    BagError
        The profile is ros1 or px4, or definitions exceed `LARGEST_SUMMARY`.
    """
    definitions, unvouched = FileDefinitions(), FileDefinitions()
    statistics: Statistics | None = None
    summary = summary_start(path)
    budget, is_data = LARGEST_SUMMARY, True
    for piece in scan_damaged(path, unverified):
        if not isinstance(piece, SoundRecords):
            continue
        is_in_summary = summary is not None and piece.offset >= summary
        target = definitions if piece.vouched or is_in_summary else unvouched
        others = _NOTES | _INDEXES if is_in_summary else _NOTES
        for opcode, body in parts(piece.content):
            if opcode in _DEFINITIONS and (target is definitions or is_data):
                budget -= len(body)
                if budget < 0:
                    raise BagError(
                        f"{path}: more than {LARGEST_SUMMARY} bytes of definitions. It is not the work of a recorder."
                    )
            elif opcode not in others:
                continue
            match record_of(opcode, body):
                case Channel() as channel:
                    target.channels.setdefault(channel.id, channel)
                case Schema() as schema:
                    target.schemas.setdefault(schema.id, schema)
                case Header(profile=("ros1" | "px4") as profile):
                    raise BagError(f"{path}: profile = {profile!r}: only {PROFILE!r} is saved. Use a tool of that system.")
                case Metadata(name=name, metadata=notes) if name == NOTES:
                    definitions.notes |= notes
                case DataEnd(data_section_crc=checksum):
                    is_data = False
                    with open_received(path) as file:
                        definitions.is_summed = checksum != 0 and checksum == checksum_of(file, 0, piece.offset)
                case Statistics() as found:
                    statistics = found
                case ChunkIndex() as index:
                    definitions.listed[index.message_start_time, index.message_end_time, index.uncompressed_size] += 1
    definitions.channels = {**unvouched.channels, **definitions.channels}
    definitions.schemas = {**unvouched.schemas, **definitions.schemas}
    if statistics is not None and statistics.channel_message_counts.keys() <= definitions.channels.keys():
        definitions.told = by_topic(statistics.channel_message_counts, definitions.channels)
    return definitions


MOST_FAULTS = 1000  # limit for the number of faults that are reported one by one


@dataclass(slots=True)
class Recovery:
    """Result of a recovery: counts of saved and lost messages, and faults."""

    # number of messages by topic, counted in the new session after it was written
    saved: Counter[str] = field(default_factory=Counter)
    unvouched: Counter[str] = field(default_factory=Counter)  # number of saved messages by topic that were under no checksum
    lost: dict[str, int] | None = None  # number of lost messages by topic; None if the source has no sound count
    nameless: int = 0  # number of sound messages left out because the definition of their topic is lost
    copies: int = 0  # number of messages left out because their chunk is a copy of an earlier one
    faults: list[tuple[Path, DamagedBytes]] = field(default_factory=list)  # the first `MOST_FAULTS` faults
    fault_count: int = 0  # number of all faults

    def note(self, path: Path, fault: DamagedBytes) -> None:
        """Count a fault, and keep it if it is among the first `MOST_FAULTS`."""
        self.fault_count += 1
        if len(self.faults) < MOST_FAULTS:
            self.faults.append((path, fault))


def recover(path: Path, out: Path, unverified: bool = False) -> Recovery:
    """Write all recoverable messages of the session at `path` into the new directory `out`, or nothing. `path` is only read.

    Parameters
    ----------
    unverified : bool
        Also save the whole messages at the start of chunks that are cut off or whose checksum does not fit.

    Returns
    -------
    Recovery
        Counts of the messages that were saved and lost.

    Raises
    ------
    BagError
        There is no session, nothing of it can be saved, or `out` cannot be written or lies in the source.
    """
    with result_folder(out, RECOVER, [path]) as building:
        return _recover(path, building.folder, unverified)


def _recover(path: Path, out: Path, unverified: bool) -> Recovery:
    files, metadata = sources(path)
    for file in files:
        if file.suffix.lower() in SUMMARISE.keys() - {".mcap"}:
            remedy = "Try `sqlite3 FILE .recover` on a copy of a .db3, `rosbag reindex` of ROS 1 on that of a .bag."
            raise BagError(f"{file}: only .mcap files are recovered. {remedy}")
    all_definitions = []
    for file in files:
        with as_bag_error(file):
            all_definitions.append(definitions_of(file, unverified))
    outcome = Recovery()
    notes = {key: value for definitions in all_definitions for key, value in definitions.notes.items()}
    notes |= metadata.notes if metadata else {}
    bag = BagWriter(out, {**notes, RECOVERED: path.name}, distro=metadata.ros_distro if metadata else "")
    keys: dict[tuple[str, str, bytes], int] = {}
    try:
        for number, (file, definitions) in enumerate(zip(files, all_definitions, strict=True)):
            if number and bag.first is not None:
                bag.split()
            with as_bag_error(file):
                _copy(file, definitions, bag, keys, outcome, metadata, unverified)
        bag.close()
    except BaseException:
        bag.abandon()
        raise
    if not bag.counts.total():
        raise BagError(f"{path}: nothing can be saved: {_first(outcome)}.")
    _copy_sheet(path, out)
    outcome.saved = _count(out)
    outcome.lost = _lost(outcome.saved, all_definitions, metadata, files)
    return outcome


def _copy(
    file: Path,
    definitions: FileDefinitions,
    bag: BagWriter,
    keys: dict[tuple[str, str, bytes], int],
    outcome: Recovery,
    metadata: BagMetadata | None,
    unverified: bool,
) -> None:
    """Copy the messages of one file. Chunks that are copies of earlier ones are left out."""
    own: dict[int, int] = {}
    seen: Counter[bytes] = Counter()
    for piece in scan_damaged(file, unverified, definitions.channels):
        if isinstance(piece, DamagedBytes):
            outcome.note(file, piece)
            continue
        if _is_copy(piece, definitions, seen):
            outcome.copies += sum(opcode == Opcode.MESSAGE for opcode, _ in parts(piece.content))
            continue
        for opcode, body in parts(piece.content):
            if opcode != Opcode.MESSAGE:
                continue
            channel, sequence, log_time, publish_time = MESSAGE_HEAD.unpack_from(body)
            if channel not in own:
                topic = definitions.topic(channel, metadata)
                if topic is None:
                    outcome.nameless += 1
                    continue
                identity = topic.topic, topic.type, topic.definition  # two channels of one topic become one
                if identity not in keys:
                    (keys[identity],) = bag.add(topic)
                own[channel] = keys[identity]
            key = own[channel]
            bag.write(key, log_time, body[MESSAGE_HEAD.size :], publish_time, sequence)
            if not (piece.vouched or definitions.is_summed):
                outcome.unvouched[bag.topics[key].topic] += 1


def _is_copy(piece: SoundRecords, definitions: FileDefinitions, seen: Counter[bytes]) -> bool:
    """Return True if a piece is a chunk that was `seen` more often than the recorder wrote it.

    Equal messages within one chunk are recorded ones. Equal chunks, as from a clock that stands still, are recorded
    ones if the checksum of all data fits. Otherwise a sound index gives the number of recorded ones.
    """
    chunk = piece.chunk
    if chunk is None or definitions.is_summed:
        return False
    digest = sha256(piece.content).digest()
    seen[digest] += 1
    return seen[digest] > max(1, definitions.listed[chunk.message_start_time, chunk.message_end_time, chunk.uncompressed_size])


def _copy_sheet(path: Path, out: Path) -> None:
    """Copy ``session.yaml``, whose scene and mapping a replay needs."""
    sheet = sheet_path(path)
    if holds_file(sheet) and sheet.stat().st_size <= LARGEST_FILE:
        with open_received(sheet) as file:
            write_atomic(out / sheet.name, file.read(LARGEST_FILE))


def _count(out: Path) -> Counter[str]:
    """Return the number of messages by topic, counted by reading all of the new session."""
    saved: Counter[str] = Counter()
    for file in scan(out).files:
        for channel, _, _ in file.heads():
            saved[file.channels[channel].topic] += 1
    return saved


def _lost(
    saved: Mapping[str, int], all_definitions: list[FileDefinitions], metadata: BagMetadata | None, files: list[Path]
) -> dict[str, int] | None:
    """Return the lost messages by topic against the first count of the source that is no smaller than the saved messages."""
    for told in _counts_told(all_definitions, metadata, files):
        if all(told.get(topic, 0) >= count for topic, count in saved.items()):
            return {topic: told[topic] - saved.get(topic, 0) for topic in told}
    return None


def _counts_told(
    all_definitions: list[FileDefinitions], metadata: BagMetadata | None, files: list[Path]
) -> Iterator[Counter[str]]:
    """Yield the counts of the files' summaries, if all have one, and of the metadata, if it names all files."""
    counts = [definitions.told for definitions in all_definitions]
    if None not in counts:
        yield sum((each for each in counts if each is not None), Counter[str]())
    if metadata is not None and {file.name for file in files} <= set(metadata.file_names):
        yield metadata.counts


def _first(outcome: Recovery) -> str:
    if outcome.faults:
        path, fault = outcome.faults[0]
        return f"{path.name}, byte {fault.offset}: {fault.reason}"
    return f"{outcome.nameless} messages of unknown topics" if outcome.nameless else "it holds no messages"
