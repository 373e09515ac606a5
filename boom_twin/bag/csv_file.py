"""Read a session from a CSV file in SI units, as the messages that an import of the file would write.

``t_s,stroke_1_m,..[,joint_1_rad,..][,imu_x_m_s2,imu_z_m_s2][,cylinder_force_1_N,..]``, an empty cell where there is no value.
Strokes may be missing where there are angles: for a mapping with ``drive: angles``.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..errors import BagError
from ..loggers.assignment import Assignment, ColumnFile, assign
from ..loggers.log_table import CsvLogTable
from ..messages.topic_table import load_topics
from ..system.received_files import open_received
from ..types import SECOND, SENSORS, Stream, stream_of
from .import_session import Readings, encoded_blocks, read_tables, readings_of
from .session_file import SessionFile, as_bag_error, channel_of, schema_of

_REMEDY = "`boom_twin import` reads files with other columns, units and times."


@dataclass(frozen=True, slots=True, kw_only=True)
class CsvFile(SessionFile):
    """Content of one CSV file."""

    readings: list[Readings]
    joints: int

    def messages(self) -> Iterator[tuple[int, int, bytes]]:
        numbers = {channel.topic: channel.id for channel in self.channels.values()}
        for block in encoded_blocks(self.readings, load_topics(), self.joints):
            found = [(place, numbers[rows.key], data) for rows in block.rows for place, data in zip(*rows[1:], strict=True)]
            for place, number, data in sorted(found, key=lambda each: int(each[0])):
                yield number, int(block.log_times[place]), data.tobytes()


def summarise(path: Path) -> CsvFile:
    """Return the content of one file. A BagError names a column or value that cannot be used, and its line."""
    rows_to_judge, slowest_step = 20, 1.0  # rows; s from row to row, by which times in another unit are known
    with as_bag_error(path):
        open_received(path).close()
    table, given, topics = CsvLogTable(path), ColumnFile(), load_topics()
    assignment = assign([table], given, None)
    _refuse_others(path, assignment)
    read = read_tables(assignment, given, None)
    if read[0].rows.remark:
        raise BagError(f"{path}: {read[0].rows.remark} by an import. {_REMEDY}")
    stamps = read[0].times.stamps
    step = float(np.median(np.diff(stamps))) / SECOND if len(stamps) > 1 else 0.0
    if read[0].times.is_local or (len(stamps) >= rows_to_judge and step >= slowest_step):
        told = f"{read[0].times.words}, by {step:g} s from row to row"
        raise BagError(f"{path}: {told}: t_s in seconds is needed, several rows a second. {_REMEDY}")
    readings = readings_of(assignment, read, topics, assignment.joints)
    counts = Counter[Stream]()
    for each in readings:
        counts[each.stream] += len(each.logs)
    numbers = {stream: number for number, stream in enumerate(Stream, 1) if counts[stream]}
    logs = np.concatenate([each.logs for each in readings])
    return CsvFile(
        path=path,
        storage="csv",
        library="CSV",
        compression="none",
        channels={number: channel_of(number, topics.inputs[stream].absolute) for stream, number in numbers.items()},
        schemas={number: schema_of(number, SENSORS[stream].message) for stream, number in numbers.items()},
        counts={number: counts[stream] for stream, number in numbers.items()},
        start=int(logs.min()),
        end=int(logs.max()),
        notes={"file": read[0].rows.skipped_text} if read[0].rows.skipped else {},
        readings=readings,
        joints=assignment.joints,
    )


def _refuse_others(path: Path, assignment: Assignment) -> None:
    """Raise BagError for a column that is not used, and for a cylinder (without any: a joint) that has no column."""
    if assignment.unused:
        told = "; ".join(f"{assignment.header(use)}: {use.reason}" for use in assignment.unused)
        raise BagError(f"{told}. Take it out. {_REMEDY}")
    has_strokes = any(stream_of(use.channel) is Stream.STROKES for use in assignment.used)
    try:
        assignment.check(assignment.joints, Stream.STROKES if has_strokes else Stream.ANGLES)
    except BagError as error:
        raise BagError(f"{path}: {error} These are options of `boom_twin import`.") from None
    if not assignment.used:
        raise BagError(f"{path}: no column of a channel. {_REMEDY}")
