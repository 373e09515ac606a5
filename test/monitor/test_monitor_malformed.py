"""Malformed messages among good ones: dropped, counted with a reason, and the good ones are shown; in bounded memory."""

from __future__ import annotations

import asyncio
import random
import tracemalloc
from collections.abc import Callable
from functools import partial
from math import inf, nan
from operator import attrgetter
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from ros_messages import TYPES, Output, Topic, encode_health, jazzy, load_topics, new_message

from boom_twin import Stream
from boom_twin.monitor.data.analyst import Analyst
from boom_twin.monitor.data.feed import Feed
from boom_twin.monitor.data.status import MAX_NODES
from boom_twin.monitor.data.store import LONGEST_REASON, Store
from boom_twin.monitor.protocol import dump, layout, state
from boom_twin.types import Alarm, Health, Ranked

TOPICS = load_topics()
EPOCH, STEP = 1_700_000_000 * 10**9, 5_000_000
CAPACITY = 2000
JOINTS, CYLINDERS = [f"joint_{i}" for i in (1, 2, 3, 4)], [f"cylinder_{i}" for i in (1, 2, 3, 4)]
ALARM = Alarm("joint_3", "residual", EPOCH, None, "joint_3.sensor", "jumped", (Ranked("joint_3.sensor", 1.0, ()),))
Role = Output | Stream


def topic(role: Role) -> Topic:
    return TOPICS.outputs[role] if isinstance(role, Output) else TOPICS.inputs[role]


def joint_state(names: list[str], lengths: tuple[int, int, int] | None = None, value: float = 0.1) -> Any:
    """Three arrays, of as many values as there are names, or as given."""
    message = new_message("sensor_msgs/msg/JointState")
    message.name = names
    for field, length in zip(("position", "velocity", "effort"), lengths or (len(names),) * 3, strict=True):
        setattr(message, field, np.full(length, value))
    return message


def shape(points: int = 5, cylinders: int = 4, x: float = 1.0) -> Any:
    message = new_message(TYPES[Output.SHAPE])
    lines = [("boom", 0, points), ("boom_undeflected", 0, points), *(("cylinders", i + 1, 2) for i in range(cylinders))]
    for space, number, count in lines:
        marker = new_message("visualization_msgs/msg/Marker")
        marker.ns, marker.id, marker.points = space, number, [new_message("geometry_msgs/msg/Point") for _ in range(count)]
        marker.points[0].x = x
        message.markers.append(marker)
    return message


VECTORS: dict[Role, str] = {
    Output.TIP_DISPLACEMENT: "vector", Output.TIP_POSITION: "point", Output.TIP_ACCELERATION: "accel.linear",
    Output.TIP_UNCERTAINTY: "vector", Output.ESTIMATE_POSE: "pose.pose.position", Output.ESTIMATE_LOAD: "wrench.force",
    Output.ESTIMATE_ACCELERATION: "accel.accel.linear", Stream.IMU: "linear_acceleration",
}  # fmt: skip
UNCERTAIN: dict[Role, float] = {Output.ESTIMATE_POSE: 1e-6, Output.ESTIMATE_ACCELERATION: 0.01}


def vector(role: Role, x: float = 0.5) -> Any:
    message = new_message(TYPES[role])
    attrgetter(VECTORS[role])(message).x = x
    return message


def uncertain(role: Role, variance: float) -> Any:
    message = vector(role)
    holder = message.pose if role is Output.ESTIMATE_POSE else message.accel
    holder.covariance[0] = variance
    return message


def statuses(*names: str, role: Output = Output.DIAGNOSTICS, text: str = "well", **values: str) -> Any:
    message = new_message(TYPES[role])
    for name in names:
        status = new_message("diagnostic_msgs/msg/DiagnosticStatus")
        status.name, status.message = name, text
        for key, value in values.items():
            pair = new_message("diagnostic_msgs/msg/KeyValue")
            pair.key, pair.value = key, value
            status.values.append(pair)
        message.status.append(status)
    return message


def health(**changes: str) -> Any:
    encoded = encode_health(Health(EPOCH, (ALARM,), np.zeros(2)))
    message = jazzy().deserialize_cdr(encoded, TYPES[Output.HEALTH])
    for pair in message.status[0].values:
        pair.value = changes.get(pair.key, pair.value)
    return message


def event(text: str = "mark") -> Any:
    message = new_message("rcl_interfaces/msg/Log")
    message.msg = text
    return message


GOOD: dict[Role, Callable[[], Any]] = {
    **{role: partial(vector, role) for role in VECTORS if role not in UNCERTAIN},
    **{role: partial(uncertain, role, variance) for role, variance in UNCERTAIN.items()},
    Output.JOINT_STATES: lambda: joint_state(JOINTS + CYLINDERS),
    Output.RESIDUALS: lambda: joint_state(JOINTS),
    Output.SHAPE: shape,
    Output.HEALTH: health,
    Output.DIAGNOSTICS: lambda: statuses("boom_twin: model"),
}
TABLES = {"displacement", "position", "acceleration", "uncertainty", "estimate", "joints", "shape"}


class Bench:
    """A live feed, and what is sent to it, as bytes."""

    def __init__(self) -> None:
        self.feed, self.now = Feed("made", Store(CAPACITY), TOPICS), 0.0
        self.topic_rows, self.store = self.feed.topic_rows, self.feed.store

    def send(self, role: Role | None, message: Any, stamp: int | None = None) -> None:
        """To the topic of a role, or of events; with a stamp (ns) unless its own is to stay."""
        name, kind = (TOPICS.events.absolute, TOPICS.events.type) if role is None else (topic(role).absolute, topic(role).type)
        if stamp is not None:
            for part in message.markers if role is Output.SHAPE else [message]:
                header = getattr(part, "header", part)
                header.stamp.sec, header.stamp.nanosec = divmod(stamp, 10**9)
        self.topic_rows.take_encoded(name, bytes(jazzy().serialize_cdr(message, kind)), self.now)

    def go_on(self, first: int, count: int = 3) -> None:
        """Good messages of all topics from row `first` on."""
        for row in range(first, first + count):
            for role, make in GOOD.items():
                self.send(role, make(), EPOCH + row * STEP)

    def lost(self, role: Role | None = None) -> tuple[int, str]:
        loss = self.topic_rows.dropped.by_topic.get(TOPICS.events.absolute if role is None else topic(role).absolute)
        return (0, "") if loss is None else (loss["count"], loss["reason"])


MALFORMED: dict[str, tuple[Role | None, Callable[[], Any], str]] = {
    "no effort": (Output.JOINT_STATES, lambda: joint_state(CYLINDERS, (4, 4, 0)), "4 names, but 4 of position, 0 of effort"),
    "infinite force": (Output.JOINT_STATES, lambda: joint_state(CYLINDERS, value=inf), "a number is inf"),
    "a million names": (Output.JOINT_STATES, lambda: joint_state(["n"] * 1_000_000), "bytes, at most 1000000"),
    "thousands of names": (Output.RESIDUALS, lambda: joint_state(["n"] * 5000), "5000 names, at most 1000"),
    "no names": (Output.RESIDUALS, lambda: joint_state([]), "not []"),
    "one axis": (Output.RESIDUALS, lambda: joint_state(["tip_imu_x"]), "not 'tip_imu_x'"),
    "another count": (Output.RESIDUALS, lambda: joint_state(JOINTS[:3]), "6 numbers, but 8 at first (joint_4_rad is"),
    "another order": (Output.RESIDUALS, lambda: joint_state(JOINTS[::-1]), "in another order"),
    "twice": (Output.RESIDUALS, lambda: joint_state(JOINTS[:3] * 2), "each once"),
    "control": (Output.RESIDUALS, lambda: joint_state(["joint_1\n\x1b[2J"]), r"not 'joint_1\n\x1b[2J'"),
    "huge residual": (Output.RESIDUALS, lambda: joint_state(JOINTS, value=-1e300), "a number is -1e+300"),
    "empty shape": (Output.SHAPE, lambda: new_message(TYPES[Output.SHAPE]), "no lines of the boom"),
    "shape of no points": (Output.SHAPE, lambda: shape(1), "no lines of the boom"),
    "shape of other points": (Output.SHAPE, lambda: shape(6), "numbers, but"),
    "shape of many points": (Output.SHAPE, lambda: shape(5000), "numbers of a shape, at most 1000"),
    "shape of one cylinder": (Output.SHAPE, lambda: shape(cylinders=1), "2 ends of cylinders, but 4 forces"),
    "shape at NaN": (Output.SHAPE, lambda: shape(x=nan), "a number is nan"),
    "displacement of NaN": (Output.TIP_DISPLACEMENT, lambda: vector(Output.TIP_DISPLACEMENT, nan), "a number is nan"),
    "estimate of NaN": (Output.ESTIMATE_POSE, lambda: vector(Output.ESTIMATE_POSE, nan), "a number is nan"),
    "negative variance": (Output.ESTIMATE_POSE, lambda: uncertain(Output.ESTIMATE_POSE, -1.0), "a variance is -1"),
    "many statuses": (Output.DIAGNOSTICS, lambda: statuses(*["n: m"] * 501), "501 statuses, at most 500"),
    "many nodes": (Output.DIAGNOSTICS, lambda: statuses(*(f"n{i}: m" for i in range(400))), "nodes on one topic"),
    "alarm of no time": (Output.HEALTH, lambda: health(from_s="-5"), "impossible stamp -5 s"),
    "alarm without end": (Output.HEALTH, lambda: health(to_s="1e200"), "impossible stamp"),
}


@pytest.mark.parametrize("name", MALFORMED)
def test_a_malformed_message_is_dropped_counted_and_told_and_all_others_are_shown(name: str) -> None:
    role, make, reason = MALFORMED[name]
    bench = Bench()
    bench.go_on(0)
    bench.send(role, make(), EPOCH + 3 * STEP)
    bench.send(role, make(), EPOCH + 3 * STEP)
    bench.go_on(4)
    count, told = bench.lost(role)
    assert count == 2 and reason in told and told.isprintable() and len(told) <= 2 * LONGEST_REASON
    assert set(bench.store.tables) == TABLES and {table.count for table in bench.store.tables.values()} == {6}
    assert bench.store.generation == 0 and sum(loss["count"] for loss in bench.topic_rows.dropped.losses()) == 2
    dump(state(bench.store, 0.0, 0.0) | layout(bench.store))


def test_a_stamp_that_is_none_is_told() -> None:
    bench = Bench()
    bench.go_on(0, 1)
    for role in (*(role for role in GOOD if role not in (Output.DIAGNOSTICS, Output.JOINT_STATES)), None):
        for count, (stamp, reason) in enumerate(((0, "no stamp"), (-5 * 10**9, "impossible stamp")), 1):
            bench.send(role, event() if role is None else GOOD[role](), stamp)
            assert bench.lost(role)[0] == count and reason in bench.lost(role)[1], role


def test_bytes_that_are_no_message_are_dropped() -> None:
    bench, chance = Bench(), random.Random(5)
    bench.go_on(0)
    names = sorted(bench.topic_rows.names)
    good = {role: bytes(jazzy().serialize_cdr(make(), topic(role).type)) for role, make in GOOD.items()}
    tracemalloc.start()
    for _ in range(3000):
        role = chance.choice(list(GOOD))
        data = bytearray(good[role])
        for _ in range(chance.randint(1, 8)):
            data[chance.randrange(len(data))] = chance.choice((0, 0xFF, chance.randrange(256)))
        bench.topic_rows.take_encoded(chance.choice([topic(role).absolute, chance.choice(names)]), bytes(data), 0.0)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 50e6 and sum(loss["count"] for loss in bench.topic_rows.dropped.losses()) > 1000
    dump(state(bench.store, 0.0, 0.0) | layout(bench.store))
    bench.go_on(10**6, 5)
    last = EPOCH + (10**6 + 4) * STEP - bench.store.epoch
    assert {name for name, table in bench.store.tables.items() if table.newest == pytest.approx(last * 1e-9)} >= TABLES


def test_a_stray_stamp_leaves_the_rows_in_order_and_a_clock_set_back_begins_anew() -> None:
    bench, hour = Bench(), 3600 * 10**9
    bench.go_on(0)
    for stamp in (EPOCH + hour, EPOCH - hour, EPOCH + STEP, EPOCH + 2 * STEP):
        bench.send(Output.TIP_POSITION, vector(Output.TIP_POSITION), stamp)
    bench.go_on(3)
    times = bench.store.tables["position"].rows(0, 9)[0]
    assert bench.lost(Output.TIP_POSITION)[0] == 4 and bench.store.generation == 0
    assert times == pytest.approx(np.arange(6) * STEP * 1e-9)
    for row in (0, 1):
        bench.send(Output.TIP_DISPLACEMENT, vector(Output.TIP_DISPLACEMENT), EPOCH - hour + row * STEP)
    assert bench.store.generation == 1 and bench.lost(Output.TIP_DISPLACEMENT)[0] == 0
    assert bench.store.tables["displacement"].rows(0, 9)[0] == pytest.approx([0.0, STEP * 1e-9])
    bench = Bench()
    for first in (0, 10**5):  # a pause costs no message
        bench.go_on(first)
    assert not bench.topic_rows.dropped.losses() and bench.store.tables["displacement"].count == 6
    assert [alarm.name for alarm in bench.store.alarms.all if not alarm.causes] == ["cylinder_strokes"]


BURSTS: dict[str, Callable[[int], int]] = {
    "equal": lambda row: 0,
    "1 ns": lambda row: row,
    "1 us": lambda row: 1000 * row,
    "1 ns, then a pause, again and again": lambda row: row + 4_000_000_000 * (row // 300),
    "back and forth": lambda row: (row * 7919) % 5000 * 1_000_000,
    "far future and back": lambda row: row * STEP + (row % 2) * 10**17,
    "pairs far apart": lambda row: row * STEP + (row // 2 % 2) * 10**17,
}


@pytest.mark.parametrize("name", BURSTS)
def test_a_burst_of_stamps_costs_no_memory(name: str) -> None:
    bench = Bench()

    async def look() -> None:
        analyst = Analyst(bench.feed)
        for row in range(3000):
            bench.send(Output.TIP_ACCELERATION, vector(Output.TIP_ACCELERATION, row % 7), EPOCH + BURSTS[name](row))
            if row % 500 == 499:
                await analyst.spectrum_at(bench.store.newest)

    tracemalloc.start()
    asyncio.run(look())
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 60e6
    times = bench.store.tables["acceleration"].rows(0, 10**6)[0]
    assert len(times) <= CAPACITY and np.all(np.diff(times) >= 0.0)


def test_nodes_without_end_do_not_fill_the_board_and_the_twin_stays() -> None:
    bench = Bench()
    bench.go_on(0, 1)
    for number in range(2000):
        bench.now = 0.01 * number
        bench.send(Output.DIAGNOSTICS, statuses(f"node{number}: x", text="long " * 1000))
        if number % 100 == 0:
            bench.send(Output.DIAGNOSTICS, GOOD[Output.DIAGNOSTICS]())
    table = bench.store.statuses(bench.now)
    assert len(table.nodes) <= MAX_NODES and "boom_twin" in table.nodes
    assert all(len(lamp.reason) <= 500 for _, lamps in table.nodes.values() for lamp in lamps)


def test_no_scene_is_opened_that_a_message_names(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pipe = tmp_path / "scene.yaml"
    pipe.write_text("no scene")
    opened: list[Any] = []
    monkeypatch.setattr(Path, "is_file", lambda self: opened.append(self) or True)
    monkeypatch.setattr(Path, "read_bytes", lambda self: opened.append(self) or b"")
    bench = Bench()
    bench.send(Output.DIAGNOSTICS, statuses("boom_twin: model", scene=str(pipe)))
    assert bench.feed.scene() is None and not opened
    monkeypatch.undo()
    bench.send(Output.DIAGNOSTICS, statuses("boom_twin: model", scene="default scene"))
    assert bench.feed.scene() is not None
