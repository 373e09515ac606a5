"""Recover a damaged session: write a new, sound one with all that can be saved, and a truthful count."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from mcap.opcode import Opcode
from mcap.records import Channel, DataEnd, Header, Metadata, Schema, Statistics

from ..config.yaml_text import LARGEST_FILE
from ..errors import BagError
from ..system.atomic_files import write_atomic
from ..system.received_files import holds_file, open_received
from ..system.result_folder import RECOVER, result_folder
from .mcap_file import NOTES, PROFILE
from .mcap_records import LARGEST_SUMMARY, MESSAGE_HEAD, checksum_of, parts, record_of, summary_start
from .metadata import BagMetadata, Recorded, offered_qos, profiles
from .reader import RECOVERED, SUMMARISE, scan, sources
from .scanner import DamagedBytes, SoundRecords, scan_damaged
from .session_file import as_bag_error, by_topic
from .session_model import session_yaml
from .writer import BagWriter


@dataclass(slots=True)
class FileDefinitions:
    """Definitions, notes and counts of one damaged file."""

    # channels, schemas: by number; one with a valid checksum replaces one without
    channels: dict[int, Channel] = field(default_factory=dict)
    schemas: dict[int, Schema] = field(default_factory=dict)
    notes: dict[str, str] = field(default_factory=dict)
    told: Counter[str] | None = None  # number of messages by topic from a sound summary
    is_summed: bool = False  # True if the checksum of the data section is valid

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


def definitions_of(path: Path) -> FileDefinitions:
    """Return the definitions, notes and counts of a file from one walk through it.

    A definition is used if the checksum of its chunk or of the summary fits or is missing. Raise BagError if the profile is
    ros1 or px4, or definitions exceed `LARGEST_SUMMARY`.
    """
    found, sure = FileDefinitions(), set[tuple[int, int]]()
    statistics: Statistics | None = None
    summary = summary_start(path)
    budget, is_data = LARGEST_SUMMARY, True
    for piece in scan_damaged(path):
        if not isinstance(piece, SoundRecords):
            continue
        is_in_summary = summary is not None and piece.offset >= summary
        is_sure = piece.vouched or is_in_summary
        for opcode, body in parts(piece.content):
            if opcode in (Opcode.CHANNEL, Opcode.SCHEMA) and (is_sure or is_data):
                budget -= len(body)
                if budget < 0:
                    raise BagError(
                        f"{path}: more than {LARGEST_SUMMARY} bytes of definitions. It is not the work of a recorder."
                    )
                definition = record_of(opcode, body)
                assert isinstance(definition, Channel | Schema)
                table: dict[int, Any] = found.channels if opcode == Opcode.CHANNEL else found.schemas
                if definition.id not in table or (is_sure and (opcode, definition.id) not in sure):
                    table[definition.id] = definition
                if is_sure:
                    sure.add((opcode, definition.id))
            elif opcode in (Opcode.HEADER, Opcode.METADATA, Opcode.DATA_END) or (opcode == Opcode.STATISTICS and is_in_summary):
                match record_of(opcode, body):
                    case Header(profile=("ros1" | "px4") as profile):
                        raise BagError(f"{path}: profile = {profile!r}: only {PROFILE!r} is saved. Use a tool of that system.")
                    case Metadata(name=name, metadata=notes) if name == NOTES:
                        found.notes |= notes
                    case DataEnd(data_section_crc=checksum):
                        is_data, summary = False, summary or summary_start(path, piece.offset + len(piece.content))
                        with open_received(path) as file:
                            found.is_summed = checksum != 0 and checksum == checksum_of(file, 0, piece.offset)
                    case Statistics() as counts:
                        statistics = counts
    if statistics is not None and statistics.channel_message_counts.keys() <= found.channels.keys():
        found.told = by_topic(statistics.channel_message_counts, found.channels)
    return found


MOST_FAULTS = 1000  # limit for the number of faults that are reported one by one


@dataclass(slots=True)
class Recovery:
    """Result of a recovery: counts of saved and lost messages, and faults."""

    # number of messages by topic, counted in the new session after it was written
    saved: Counter[str] = field(default_factory=Counter)
    unvouched: Counter[str] = field(default_factory=Counter)  # number of saved messages by topic without a checksum
    lost: dict[str, int] | None = None  # number of lost messages by topic; None if the source has no sound count
    nameless: int = 0  # number of sound messages left out because the definition of their topic is lost
    faults: list[tuple[Path, DamagedBytes]] = field(default_factory=list)  # the first `MOST_FAULTS` faults
    fault_count: int = 0  # number of all faults

    def note(self, path: Path, fault: DamagedBytes) -> None:
        """Count a fault, and keep it if it is among the first `MOST_FAULTS`."""
        self.fault_count += 1
        if len(self.faults) < MOST_FAULTS:
            self.faults.append((path, fault))


def recover(path: Path, out: Path) -> Recovery:
    """Write all recoverable messages of the session at `path` into the new directory `out`, or nothing. `path` is only read.

    Raise BagError if there is no session, nothing of it can be saved, or `out` cannot be written or lies in the source.
    """
    with result_folder(out, RECOVER, [path]) as building:
        return _recover(path, building)


def _recover(path: Path, out: Path) -> Recovery:
    files, metadata = sources(path)
    for file in files:
        if file.suffix.lower() in SUMMARISE.keys() - {".mcap"}:
            remedy = "Try `sqlite3 FILE .recover` on a copy of a .db3, `rosbag reindex` of ROS 1 on that of a .bag."
            raise BagError(f"{file}: only .mcap files are recovered. {remedy}")
    all_definitions = []
    for file in files:
        with as_bag_error(file):
            all_definitions.append(definitions_of(file))
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
                _copy(file, definitions, bag, keys, outcome, metadata)
        bag.close()
    except BaseException:
        bag.abandon()
        raise
    if not bag.counts.total():
        raise BagError(f"{path}: nothing can be saved: {_first(outcome)}.")
    _copy_session_yaml(path, out)
    outcome.saved = Counter({topic.name: topic.count for topic in scan(out).topics})
    outcome.lost = _lost(outcome.saved, all_definitions, metadata, files)
    return outcome


def _copy(
    file: Path,
    definitions: FileDefinitions,
    bag: BagWriter,
    keys: dict[tuple[str, str, bytes], int],
    outcome: Recovery,
    metadata: BagMetadata | None,
) -> None:
    own: dict[int, int] = {}
    for piece in scan_damaged(file, definitions.channels):
        if isinstance(piece, DamagedBytes):
            outcome.note(file, piece)
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


def _copy_session_yaml(path: Path, out: Path) -> None:
    source = session_yaml(path)
    if holds_file(source) and source.stat().st_size <= LARGEST_FILE:
        with open_received(source) as file:
            write_atomic(out / source.name, file.read(LARGEST_FILE))


def _lost(
    saved: Mapping[str, int], all_definitions: list[FileDefinitions], metadata: BagMetadata | None, files: list[Path]
) -> dict[str, int] | None:
    """Return the lost messages by topic against the first count of the source that is no smaller than the saved messages.

    A count is that of the files' summaries, if all have one, or of the metadata, if it names all files.
    """
    told = [each.told for each in all_definitions if each.told is not None]
    counts = [sum(told, Counter[str]())] if len(told) == len(files) else []
    if metadata is not None and {file.name for file in files} <= set(metadata.file_names):
        counts.append(metadata.counts)
    for count in counts:
        if all(count.get(topic, 0) >= found for topic, found in saved.items()):
            return {topic: count[topic] - saved.get(topic, 0) for topic in count}
    return None


def _first(outcome: Recovery) -> str:
    if outcome.faults:
        path, fault = outcome.faults[0]
        return f"{path.name}, byte {fault.offset}: {fault.reason}"
    return f"{outcome.nameless} messages of unknown topics" if outcome.nameless else "it holds no messages"
