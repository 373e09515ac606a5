"""Recover a damaged session: write a new, sound one with all that can be saved, and a truthful count."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from mcap.opcode import Opcode

from ..config.yaml_text import LARGEST_FILE
from ..errors import BagError
from ..system.files import holds_file, open_received, write_atomic
from ..system.result_folder import RECOVER, result_folder
from .mcap_records import MESSAGE_HEAD, parts
from .metadata import BagMetadata, Recorded, offered_qos, profiles
from .reader import RECOVERED, SUMMARISE, scan, sources
from .scanner import DamagedBytes, FileDefinitions, definitions_of, scan_records
from .session_file import as_bag_error
from .session_model import session_yaml
from .writer import BagWriter


def topic_of(definitions: FileDefinitions, channel: int, metadata: BagMetadata | None) -> Recorded | None:
    """Return the topic of a channel; None if its definition is lost."""
    found = definitions.channels.get(channel)
    schema = definitions.schemas.get(found.schema_id) if found else None
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


MOST_FAULTS = 20  # limit for the number of faults that are reported one by one


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
        for file, definitions in zip(files, all_definitions, strict=True):
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
    for piece in scan_records(file, definitions.channels):
        if isinstance(piece, DamagedBytes):
            outcome.note(file, piece)
            continue
        for opcode, body in parts(piece.content):
            if opcode != Opcode.MESSAGE:
                continue
            channel, sequence, log_time, publish_time = MESSAGE_HEAD.unpack_from(body)
            if channel not in own:
                topic = topic_of(definitions, channel, metadata)
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
