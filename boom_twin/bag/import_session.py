"""Conversion of logger tables into messages that the rig would have published: an import, or one CSV file as a session.

Readings are in the units of the mapping, SI by default. Signs, zeros and mounts are only in the mapping. The session
keeps it.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from datetime import tzinfo
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..config.yaml_text import plain
from ..errors import BagError
from ..loggers.assignment import Assignment, ColumnFile, assign
from ..loggers.log_table import CsvLogTable, LogRows, LogTable
from ..loggers.times import Stamps, TableTimes, read_times, zone_of
from ..messages.cdr_encoder import STAMP, EncodedBlock, EncodedRows, NumberFields, Template
from ..messages.mapping import load_mapping, mapping_from
from ..messages.topic_table import Topics, load_topics
from ..system.files import open_received
from ..types import NANO, SECOND, SENSORS, Array, Sample, Stream, channels_of, sensor_kind, stream_of
from .metadata import dump
from .session_file import LogClock, SessionFile, as_bag_error, channel_of, schema_of
from .session_model import SessionMetadata
from .session_writer import LogTimes, named_message
from .writer import MessageWriter

TOGETHER = 4096  # messages encoded at once


class ReadTable(NamedTuple):
    """Rows of a table and their times."""

    rows: LogRows
    times: TableTimes

    @property
    def span(self) -> tuple[int, int]:
        """First and last stamp, ns."""
        return int(self.times.stamps.min()), int(self.times.stamps.max())

    @property
    def span_text(self) -> str:
        start, end = self.span
        if not self.times.is_absolute:
            return f"{start * NANO:g} to {end * NANO:g} s"
        return " to ".join(f"{np.datetime64(stamp, 'ns').astype('datetime64[ms]')}" for stamp in (start, end)) + " UTC"


@dataclass(frozen=True)
class ImportedSession:
    """Result of an import."""

    assignment: Assignment
    read: dict[int, ReadTable]  # rows and times by table index, for tables with channels
    counts: dict[str, int]  # messages by topic


class Readings(NamedTuple):
    """Readings of one stream in one table: log times and stamps (ns), values (rows, channels).

    `own` is True for channels of the table. `is_apart` is True if most rows lack a channel (signals of a bus).
    """

    stream: Stream
    logs: Stamps
    stamps: Stamps
    values: Array
    own: NDArray[np.bool_]
    is_apart: bool


def import_session(
    tables: Sequence[LogTable],
    out: Path,
    given: ColumnFile,
    metadata: SessionMetadata,
    joints: int | None = None,
    mapping: Path | None = None,
) -> ImportedSession:
    """Write tables as a session into the new or empty folder `out`.

    `given` are columns, times and time zone that headers do not give. `joints` is that number of the scene, if there is one.
    The session keeps the `mapping` (names, units, signs and zeros of the rig's sensors).

    Raise BagError if a table cannot be read, a cylinder has no column, a column has no unit, or the tables have no time in
    common; UsageError if the mapping or the time zone cannot be used.
    """
    assignment = assign(tables, given, joints)
    joints = joints or assignment.joints
    topics = load_mapping(mapping, joints)
    drive = topics.stroke_reading.stream
    assignment.check(joints, drive)
    text, topics = _mapping(mapping, topics, assignment, joints)
    zone = zone_of(given.timezone) if given.timezone else None
    read = read_tables(assignment, given, zone)
    _check_spans(assignment, read, drive)
    readings = readings_of(assignment, read, topics, joints)
    origin = f"imported from {', '.join(dict.fromkeys(Path(table.source).name for table in tables))}"
    counts = _write(out, readings, topics, joints, origin)
    replace(metadata, mapping=text or None, origin=origin).write(out)
    return ImportedSession(assignment, read, counts)


def _mapping(path: Path | None, topics: Topics, assignment: Assignment, joints: int) -> tuple[str, Topics]:
    """Return the session's mapping, `topics` of `path`, with ``none`` as sensor of channels without a column."""
    text = "" if path is None else path.read_text(encoding="utf-8-sig")
    there = {use.channel for use in assignment.used}
    streams = {stream_of(channel) for channel in there}
    lacking = [
        channel
        for stream, channels in channels_of(joints).items()
        for channel in channels
        if stream in streams and channel not in there
    ]
    if not set(lacking) - topics.absent:
        return text, topics
    document: dict[str, Any] = plain(text) or {}
    document = {**document, "sensors": {**(document.get("sensors") or {}), **dict.fromkeys(lacking, "none")}}
    return dump(document), mapping_from(document, str(path or "mapping of channels without a column"), joints)


def read_tables(assignment: Assignment, given: ColumnFile, zone: tzinfo | None) -> dict[int, ReadTable]:
    """Return rows and times of all tables that have columns of channels, by their numbers."""
    found: dict[int, ReadTable] = {}
    for number in sorted({use.table for use in assignment.used}):
        table, places = assignment.tables[number], assignment.times[number]
        rows = table.read([use.place for use in assignment.used if use.table == number], places)
        found[number] = ReadTable(rows, read_times(table, rows, places, given.time_of(table), zone))
    return found


def _check_spans(assignment: Assignment, read: dict[int, ReadTable], drive: Stream) -> None:
    """Raise BagError if columns of a channel overlap in time, or a table has no time in common with `drive`."""
    spans = {number: each.span for number, each in read.items()}
    told = {number: f"{assignment.tables[number].source}: {each.span_text}" for number, each in read.items()}
    if len({each.times.is_absolute for each in read.values()}) > 1:
        remedy = "Choose the columns of dates: time in --columns FILE."
        raise BagError(f"some tables have dates, others times since a start: {'; '.join(told.values())}. {remedy}")
    by_channel: dict[str, list[tuple[int, int, int]]] = {}
    for use in assignment.used:
        by_channel.setdefault(use.channel, []).append((*spans[use.table], use.table))
    for channel, parts in by_channel.items():
        for (_, end, first), (start, _, second) in zip(sorted(parts), sorted(parts)[1:], strict=False):
            if start <= end:
                raise BagError(
                    f"{channel}: {told[first]} and {told[second]} overlap. Leave one out, or give column and file of "
                    f"{channel} in --columns FILE."
                )
    word = "strokes" if drive is Stream.STROKES else "angles that drive the model"
    driving = {use.table for use in assignment.used if stream_of(use.channel) is drive}
    for number, (start, end) in spans.items():
        if not any(start <= spans[other][1] and spans[other][0] <= end for other in driving):
            raise BagError(
                f"{told[number]}: no time in common with the {word} ({'; '.join(told[other] for other in driving)}). "
                "Check dates and time zones."
            )


def readings_of(assignment: Assignment, read: dict[int, ReadTable], topics: Topics, joints: int) -> list[Readings]:
    """Return the readings of all tables in the units of the mapping; times without a date begin at 1 s."""
    shift = max(0, SECOND - min(each.span[0] for each in read.values()))
    return [
        found
        for number, own in read.items()
        for found in _readings(assignment, number, own.rows, own.times.stamps + shift, topics, joints)
    ]


def _readings(
    assignment: Assignment, number: int, rows: LogRows, stamps: Stamps, topics: Topics, joints: int
) -> list[Readings]:
    """Return the readings of one table in the units of the mapping."""
    whole_share = 0.5  # share of complete rows of a stream below which each message has only the channels of its row
    uses = {use.channel: use for use in assignment.used if use.table == number}
    found, clock = list[Readings](), LogTimes()
    logs = np.array([clock.at(stamp) for stamp in stamps.tolist()])
    for stream in Stream:
        sensors = topics.sensors_of(stream, joints)
        if not (there := [channel for channel in sensors if channel in uses]):
            continue
        if stream not in topics.inputs:
            told = "IMUs, moments and points need a place in --mapping; a gyro cannot be imported"
            raise BagError(f"{there[0]}: has no topic. {told}. Leave the column out: --column {there[0]}=none.")
        values = np.full((len(stamps), len(sensors)), np.nan)
        own = np.array([channel in uses for channel in sensors])
        for column, (channel, sensor) in enumerate(sensors.items()):
            if channel in uses:
                units, unit = sensor_kind(channel).units, uses[channel].unit
                readings = rows.numbers[uses[channel].place]
                values[:, column] = readings if unit == sensor.unit else readings * (units[unit] / units[sensor.unit])
        known = np.isfinite(values[:, own])
        filled = known.any(axis=1)
        is_apart = bool(known.all(axis=1).sum() < whole_share * filled.sum())
        found.append(Readings(stream, logs[filled], stamps[filled], values[filled], own, is_apart))
    return found


def _write(out: Path, readings: list[Readings], topics: Topics, joints: int, origin: str) -> dict[str, int]:
    counts: Counter[str] = Counter()
    inputs = {topics.inputs[each.stream].absolute: topics.inputs[each.stream] for each in readings}
    with MessageWriter(out, inputs, {"origin": origin}) as bag:
        for block in encoded_blocks(readings, topics, joints):
            bag.write_block(block)
            for rows in block.rows:
                counts[rows.key] += len(rows.places)
    return dict(counts)


def encoded_blocks(readings: list[Readings], topics: Topics, joints: int) -> Iterator[EncodedBlock]:
    """Yield all messages by log time, strokes first, up to `TOGETHER` at once, with their topics as keys."""
    kinds = [kind for each in readings for kind in _kinds(each, topics, joints)]
    logs, stamps = (np.concatenate([getattr(kind, name) for kind in kinds]) for name in ("logs", "stamps"))
    numbers = np.repeat(np.arange(len(kinds)), [len(kind.logs) for kind in kinds])
    rows = np.concatenate([np.arange(len(kind.logs)) for kind in kinds])
    ranks = np.array([kind.rank for kind in kinds])[numbers]
    order = np.lexsort((np.concatenate([kind.places for kind in kinds]), ranks, logs))
    for first in range(0, len(order), TOGETHER):
        part = order[first : first + TOGETHER]
        encoded = []
        for number in np.unique(numbers[part]).tolist():
            places, kind = np.flatnonzero(numbers[part] == number), kinds[number]
            own = part[places]
            (data,) = kind.template.fill(stamps[own], kind.values[rows[own]])
            encoded.append(EncodedRows(kind.topic, places, data))
        yield EncodedBlock(logs[part], encoded)


class _Kind(NamedTuple):
    """Messages with the same sensor names: indices of their rows, log times and stamps (ns), values."""

    topic: str
    rank: int
    places: NDArray[np.int64]
    logs: Stamps
    stamps: Stamps
    values: Array
    template: Template


def _kinds(readings: Readings, topics: Topics, joints: int) -> list[_Kind]:
    """Return the readings of a stream grouped by their sensor names."""
    stream, sensors = readings.stream, topics.sensors_of(readings.stream, joints)
    named = np.array([channel not in topics.absent for channel in sensors]) & readings.own
    masks = np.broadcast_to(named, readings.values.shape)
    if readings.is_apart and SENSORS[stream].is_named:
        masks = masks & np.isfinite(readings.values)
    patterns, kinds = np.unique(masks, axis=0, return_inverse=True)
    found = []
    for number, pattern in enumerate(patterns):
        fields, places = NumberFields(), np.flatnonzero(kinds.ravel() == number)
        blanks = np.array([fields.double() if is_there else 0.0 for is_there in pattern])
        names = [sensor.name if is_there else "" for sensor, is_there in zip(sensors.values(), pattern, strict=True)]
        message = SENSORS[stream].message, named_message(Sample(stream, STAMP * SECOND, blanks), names)
        own = readings.logs[places], readings.stamps[places], readings.values[places][:, pattern]
        template = Template([message], fields)
        found.append(_Kind(topics.inputs[stream].absolute, [*Stream].index(stream), places, *own, template))
    return found


_REMEDY = "`boom_twin import` reads files with other columns, units and times."


@dataclass(frozen=True, slots=True, kw_only=True)
class CsvFile(SessionFile):
    """Content of one CSV file: the messages that an import of it would write.

    ``t_s,stroke_1_m,..[,joint_1_rad,..][,imu_x_m_s2,imu_z_m_s2][,cylinder_force_1_N,..]``, an empty cell where there is no
    value. Strokes may be missing where there are angles: for a mapping with ``drive: angles``.
    """

    readings: list[Readings]
    joints: int

    def messages(self, clock: LogClock) -> Iterator[tuple[int, int, bytes]]:
        numbers = {channel.topic: channel.id for channel in self.channels.values()}
        for block in encoded_blocks(self.readings, load_topics(), self.joints):
            found = [(place, numbers[rows.key], data) for rows in block.rows for place, data in zip(*rows[1:], strict=True)]
            for place, number, data in sorted(found, key=lambda each: int(each[0])):
                yield number, int(block.log_times[place]), data.tobytes()


def summarise_csv(path: Path) -> CsvFile:
    """Return the content of one CSV file in SI units. A BagError names a column or value that cannot be used, and its line."""
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
