"""Recover a damaged session: write a new, sound one with all that can be saved, and a truthful count."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from hashlib import sha256
from pathlib import Path

from mcap.opcode import Opcode

from ...config.yaml_text import LARGEST_FILE
from ...errors import BagError
from ...system.atomic_files import write_atomic
from ...system.received_files import holds_file, open_received
from ...system.result_folder import RECOVER, result_folder
from ..mcap_records import MESSAGE_HEAD, parts
from ..metadata import BagMetadata
from ..reader import RECOVERED, scan, sources
from ..session_file import as_bag_error
from ..session_sheet import sheet_path
from ..storages import SUMMARISE
from ..writer import BagWriter
from .definitions import FileDefinitions, definitions_of
from .scanner import DamagedBytes, SoundRecords, scan_damaged

MOST_FAULTS = 1000
"""Limit for the number of faults that are reported one by one."""


@dataclass(slots=True)
class Recovery:
    """Result of a recovery: counts of saved and lost messages, and faults.

    Attributes
    ----------
    saved : Counter
        Number of messages by topic, counted in the new session after it was written.
    unvouched : Counter
        Number of saved messages by topic that were under no checksum.
    lost : dict of str to int, or None
        Number of lost messages by topic; None if the source has no sound count.
    nameless : int
        Number of sound messages left out because the definition of their topic is lost.
    copies : int
        Number of messages left out because their chunk is a copy of an earlier one.
    faults : list of (Path, Fault)
        The first `MOST_FAULTS` faults.
    fault_count : int
        Number of all faults.
    """

    saved: Counter[str] = field(default_factory=Counter)
    unvouched: Counter[str] = field(default_factory=Counter)
    lost: dict[str, int] | None = None
    nameless: int = 0
    copies: int = 0
    faults: list[tuple[Path, DamagedBytes]] = field(default_factory=list)
    fault_count: int = 0

    def note(self, path: Path, fault: DamagedBytes) -> None:
        """Count a fault, and keep it if it is among the first `MOST_FAULTS`."""
        self.fault_count += 1
        if len(self.faults) < MOST_FAULTS:
            self.faults.append((path, fault))


def recover(path: Path, out: Path, unverified: bool = False) -> Recovery:
    """Write all recoverable messages of the session at `path` into the new directory `out`, or nothing. `path` is only read.

    Parameters
    ----------
    path, out : Path
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
