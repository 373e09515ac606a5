"""Target ``messages``: random and mutated CDR through the node's intake and its twin, and outputs through the monitor's tables.

A case is a text with one message a line, in JSON: a topic's role and its bytes in hexadecimal, or a sample's stamp and values.
True samples come between the hostile ones. Silent is a number that is not finite, and a message that is read otherwise than a
full decoder reads it.
"""

from __future__ import annotations

import json
import math
import struct
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from default_boom import posture_angles, strokes_of_posture
from drive_twin import drive_twin
from numpy.random import Generator
from recordings import sensor_message
from ros_messages import PADDING, TYPES, Output, ReportEncoder, SampleDecoder, decode, encoded, load_topics

from boom_twin import Sample, Settings, Stream, load_scene
from boom_twin.bag.session_file import PARSE_ERRORS
from boom_twin.messages.cdr_decoder import CdrDecoder
from boom_twin.monitor.data.feed import Feed
from boom_twin.monitor.data.store import Store
from boom_twin.monitor.protocol import alarms, dump, layout, state
from boom_twin.types import SENSORS, USUAL_STREAMS

from .mutate import damaged, pick
from .verdict import Kind, Verdict

SUFFIX = ".jsonl"
LINES = 600
HOSTILE = 0.4
"""Share of the messages that are hostile."""
START, PERIOD = 1_700_000_000_000_000_000, 5_000_000
STRANGE = (
    *(math.nan, math.inf, -math.inf, 0.0, -0.0, 1e300, -1e300, 1e-300, 5e-324, 1e6, -1e6, 1e7, 0.5, -0.5, 10.0, 1e9),
    *(1.7976931348623157e308, -1.7976931348623157e308),
)
STAMPS = (0, 1, -1, 2**31 * 10**9, 2**31 * 10**9 - 1, -(2**31) * 10**9, 2**63 - 1, -(2**63), 999_999_999, START // 10**9)
COUNTS = (0, 1, 5, 2**31, 2**32 - 1)
NEAR = (1, 1000, 10**6, 10**8, 2 * 10**8, 5 * 10**8, 9 * 10**8, 10**9, 2 * 10**9, 10**10, 10**12, 10**15)
"""Nanoseconds by which a stamp may be off, both ways."""


@cache
def _arch() -> tuple[np.ndarray, np.ndarray]:
    return strokes_of_posture(load_scene(), "arch"), posture_angles(load_scene(), "arch")


def _true(random: Generator, number: int, stream: Stream) -> Sample:
    """What the rig says of a gentle move."""
    strokes, angles = _arch()
    move = 0.02 * (1.0 - math.cos(0.02 * number))
    stamp = START + number * PERIOD
    if stream is Stream.STROKES:
        return Sample(stream, stamp, strokes + move + random.normal(0.0, 2e-5, 4))
    if stream is Stream.ANGLES:
        return Sample(stream, stamp, angles + random.normal(0.0, 2e-4, 4))
    if stream is Stream.FORCES:
        return Sample(stream, stamp, random.normal((-6e4, 9e4, 2e4, 2e3), 100.0, 4))
    return Sample(stream, stamp, random.normal((0.0, 9.81), 0.05, 2))


def _encoded(sample: Sample, little_endian: bool = True) -> bytes:
    return encoded(sensor_message(sample), little_endian)


@cache
def _outputs() -> dict[str, list[bytes]]:
    """What a twin publishes, by role."""
    random, scene = np.random.default_rng(3), load_scene()
    twin, encoder = drive_twin(scene, health=True), ReportEncoder(scene, Settings())
    found: dict[str, list[bytes]] = {}
    for number in range(400):
        for stream in USUAL_STREAMS:
            for key, data in encoder.fill(twin.update(_true(random, number, stream))):
                found.setdefault(key.name, []).append(bytes(data))
    return found


@cache
def begin() -> None:
    """Compile, and make the messages that are mutated."""
    _outputs()


# -- making ---------------------------------------------------------------------------------------------------------------


def make(random: Generator, path: Path) -> Path:
    """Write true and hostile messages in turn."""
    lines, number = [], 0
    for _ in range(LINES):
        stream = USUAL_STREAMS[int(random.choice(4, p=(0.55, 0.2, 0.1, 0.15)))]
        if stream is Stream.STROKES:
            number += 1
        if random.random() > HOSTILE:
            lines.append([stream.name, _encoded(_true(random, number, stream)).hex()])
        else:
            lines.append(_hostile(random, number, stream))
    path = path.with_suffix(SUFFIX)
    path.write_text("".join(json.dumps(line) + "\n" for line in lines))
    return path


def _hostile(random: Generator, number: int, stream: Stream) -> list[Any]:
    how = random.random()
    if how < 0.25:
        name = str(pick(random, list(_outputs())))
        return [name, _mangled(random, pick(random, _outputs()[name])).hex()]
    true = _true(random, number, stream)
    if how < 0.35:
        return [stream.name, random.bytes(int(random.integers(200))).hex()]
    if how < 0.55:
        return [stream.name, _mangled(random, _encoded(true)).hex()]
    if how < 0.6:  # of either byte order, with as much behind its end as may stand there, or more
        return [
            stream.name,
            (_encoded(true, bool(random.integers(2))) + random.bytes(int(random.integers(1, 2 * PADDING)))).hex(),
        ]
    stamp = _stamp(random, true.stamp)
    values = true.values.copy()
    if random.random() < 0.6:
        values[int(random.integers(len(values)))] = pick(random, STRANGE)
    if random.random() < 0.1:
        values[:] = pick(random, STRANGE)
    if how < 0.8 and -(2**31) <= stamp // 10**9 < 2**31:
        return [stream.name, _encoded(Sample(stream, stamp, values)).hex()]
    return [stream.name, stamp, values.tolist()]


def _stamp(random: Generator, true: int) -> int:
    """As it should be, off by a usual error of clocks, or at an edge of what a message can hold."""
    how = random.random()
    if how < 0.5:
        return true
    return int(pick(random, STAMPS)) if how < 0.65 else true + int(pick(random, (-1, 1))) * int(pick(random, NEAR))


def _mangled(random: Generator, data: bytes) -> bytes:
    """Damaged anywhere, or a number of it is strange."""
    if random.random() < 0.5:
        return damaged(random, data)
    size = int(pick(random, (4, 8)))
    at = 4 + size * int(random.integers(max(1, (len(data) - 4) // size)))
    number = struct.pack("<d", pick(random, STRANGE)) if size == 8 else struct.pack("<I", pick(random, COUNTS))
    return data[:at] + number + data[at + size :]


# -- judging --------------------------------------------------------------------------------------------------------------


def judge(path: Path) -> Verdict:
    """Take all messages as node and monitor do."""
    listener = _Listener()
    for line in path.read_text().splitlines():
        fault = listener.take(*json.loads(line))
        if fault:
            return Verdict(Kind.SILENT, f"{fault}: {line[:300]}")
    return Verdict(Kind.TOLD, listener.told()) if listener.odd else Verdict(Kind.EQUAL)


class _Listener:
    """A node and a monitor without a middleware."""

    def __init__(self) -> None:
        self.odd = 0
        scene, topics = load_scene(), load_topics()
        self._twin, self._decoder = drive_twin(scene, health=True), SampleDecoder(4, topics)
        self._wires = {stream: CdrDecoder(TYPES[stream], field=kind.field) for stream, kind in SENSORS.items()}
        self._feed, self._topics = Feed("fuzz", Store(2000), topics, scene), topics

    def told(self) -> str:
        """What was odd, in the words of intake and twin."""
        return f"{self.odd} refused or with events; {dict(self._decoder.oddities)}, {dict(self._twin.counts)}"

    def take(self, role: str, *content: Any) -> str:
        """Take one message; gives what is wrong, or nothing."""
        if role in Output.__members__:
            return self._show(Output[role], bytes.fromhex(content[0]))
        stream = Stream[role]
        sample = self._sample(stream, *content)
        if isinstance(sample, str):
            return sample
        if sample is None:
            self.odd += 1
            return ""
        report = self._twin.update(sample)
        self.odd += bool(report.events) or not report.accepted
        return _wrong(report)

    def _sample(self, stream: Stream, *content: Any) -> Sample | str | None:
        if len(content) == 2:
            return Sample(stream, content[0], np.array(content[1]))
        data = bytes.fromhex(content[0])
        try:
            stamp, message = self._wires[stream].read(data)
        except PARSE_ERRORS:
            return None
        if stream is not Stream.IMU:
            try:
                whole = decode(data, TYPES[stream])
            except PARSE_ERRORS:
                return "read, and a full decoder refuses it"
            found, expected = (getattr(each, SENSORS[stream].field) for each in (message, whole))
            if list(whole.name) != list(message.name) or not np.array_equal(expected, found, equal_nan=True):
                return "read otherwise than a full decoder reads it"
        return self._decoder.sample_of(stream, stamp, message)

    def _show(self, key: Output, data: bytes) -> str:
        name, topic_rows, store = self._topics.outputs[key].absolute, self._feed.topic_rows, self._feed.store
        if name in topic_rows.names:
            topic_rows.take_encoded(name, data, 0.0)
        for words in (dump(layout(store)), dump(state(store, 0.0, store.newest)), dump(alarms(store.alarms.all))):
            json.loads(words, parse_constant=_refuse_constant)
        return ""


def _refuse_constant(name: str) -> None:
    raise AssertionError(f"{name} in JSON for the page")


def _wrong(report: Any) -> str:
    """What of a report is not a number that should be one."""
    found = report.prediction
    if found is not None:
        numbers = (found.tip_position, found.tip_displacement, found.tip_velocity, found.tip_acceleration, found.joints)
        if not all(np.isfinite(each).all() for each in (*numbers, found.strokes, found.cylinder_forces)):
            return "a prediction that is not finite"
    for residuals in report.residuals:
        if np.isinf(residuals.values).any() or not (np.isfinite(residuals.sigmas) & (residuals.sigmas > 0.0)).all():
            return "a residual that is infinite, or a deviation that is none"
    if report.health is not None and np.isinf(report.health.tip_sigmas).any():
        return "a deviation of the tip that is infinite"
    return ""
