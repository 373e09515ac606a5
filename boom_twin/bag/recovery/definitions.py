"""Definitions found in a damaged file: topics, schemas, notes, counts."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path

from mcap.opcode import Opcode
from mcap.records import Channel, ChunkIndex, DataEnd, Header, Metadata, Schema, Statistics

from ...errors import BagError
from ...system.received_files import open_received
from ..mcap_file import NOTES, PROFILE
from ..mcap_records import LARGEST_SUMMARY, checksum_of, parts, record_of, summary_start
from ..metadata import BagMetadata, Recorded, offered_qos, profiles
from ..session_file import by_topic
from .scanner import SoundRecords, scan_damaged

_DEFINITIONS = {Opcode.CHANNEL, Opcode.SCHEMA}
_NOTES = {Opcode.HEADER, Opcode.METADATA, Opcode.DATA_END}
_INDEXES = {Opcode.STATISTICS, Opcode.CHUNK_INDEX}


@dataclass(slots=True)
class FileDefinitions:
    """Definitions, notes and counts of one damaged file.

    Attributes
    ----------
    channels, schemas : dict
        Channels and schemas by number; a definition under a checksum replaces one without.
    notes : dict of str to str
    told : Counter or None
        Number of messages by topic from a sound summary.
    is_summed : bool
        True if the checksum of all bytes up to the end of the data fits.
    listed : Counter of (int, int, int)
        Chunks in a sound summary's index, by first and last log time (ns) and content size.
    """

    channels: dict[int, Channel] = field(default_factory=dict)
    schemas: dict[int, Schema] = field(default_factory=dict)
    notes: dict[str, str] = field(default_factory=dict)
    told: Counter[str] | None = None
    is_summed: bool = False
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
