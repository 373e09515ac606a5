"""Changes of a running twin as messages, and where a replay repeats them."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from default_boom import joint_angles_of_strokes, strokes_of_posture
from recordings import MessageWriter, read, scan, sensor_message
from ros_messages import TYPES, Output, decode_changes, encode_changes, jazzy, load_topics, new_message

from boom_twin import BagError, Sample, Settings, Stream, load_scene, replay
from boom_twin.offline.session_samples import Changes
from boom_twin.types import Change

TYPE = TYPES[Output.CHANGES]
SECOND = 1_000_000_000


def change(stamp: int, **live: float) -> Change:
    return Change(stamp, bool(live), Settings(**live).live, {})


def test_there_and_back() -> None:
    there = Change(12 * SECOND + 5, True, Settings(payload=40.0, gap=0.3).live, {"joint_2": 0.01, "tip_imu_x": -0.2})
    for each in (there, replace(there, is_new=True), replace(there, from_rest=False)):
        assert decode_changes(jazzy().deserialize_cdr(encode_changes(each), TYPE)) == each


@pytest.mark.parametrize(("name", "value"), [("gap", -1.0), ("payload", np.nan), ("gap", np.inf)])
def test_values_of_a_stranger_are_checked(name: str, value: float) -> None:
    msg = new_message(TYPE)
    msg.name, msg.position = [name], np.array([value])
    with pytest.raises(BagError, match=name):
        decode_changes(msg)


def begun(logged: list[tuple[float, float]], strokes: list[tuple[float, float]]) -> list[tuple[float, float]]:
    """Stamps of changes and log times of the strokes that they begin with, from log times and stamps; all in s."""
    changes = Changes([(round(log * SECOND), change(round(stamp * SECOND))) for log, stamp in logged])
    return [
        (each.stamp / SECOND, round(log, 6))
        for log, stamp in strokes
        for each in changes.due(round(log * SECOND), round(stamp * SECOND))
    ]


ROUND = [(10.0 + 0.1 * k, 0.1 * k) for k in range(100)]
LOOP = [*ROUND, *((log + 10.0, stamp) for log, stamp in ROUND)]


BEGINNINGS: dict[str, tuple[list, list, list]] = {
    "plain": ([(10.01, 0.0), (13.0, 3.0)], ROUND, [(0.0, 10.0), (3.0, 13.0)]),
    "its stroke is lost": ([(10.0, 0.25)], ROUND, [(0.25, 10.3)]),
    "recorded from later on": ([(10.3, 0.0)], ROUND[2:], [(0.0, 10.2)]),
    "latched": ([(9.9, -90.0)], ROUND, [(-90.0, 10.0)]),
    "latched, late": ([(10.3, -90.0)], ROUND, [(-90.0, 10.0)]),
    "in a pause of the recording": ([(13.02, 3.0)], [*ROUND[:20], *LOOP[100:]], [(3.0, 20.0)]),
    "second round": ([(23.0, 3.0)], LOOP, [(3.0, 23.0)]),
    "jump back": ([(20.0, 0.0)], LOOP, [(0.0, 20.0)]),
}


def test_a_setting_of_an_earlier_version_is_no_zero_of_a_sensor() -> None:
    change = Change(1, True, Settings().live, {"joint_1": 0.01})
    msg = jazzy().deserialize_cdr(encode_changes(replace(change, zeros={**change.zeros, "leap": 3600.0})), TYPE)
    assert decode_changes(msg) == change


@pytest.mark.parametrize("case", BEGINNINGS)
def test_where_a_change_begins(case: str) -> None:
    logged, strokes, expected = BEGINNINGS[case]
    assert begun(logged, strokes) == expected


def test_a_replay_repeats_the_changes_of_its_session(tmp_path: Path) -> None:
    scene, topics = load_scene(), load_topics()
    strokes = strokes_of_posture(scene, "arch")
    joints = joint_angles_of_strokes(scene, strokes)
    keys = {"s": topics.inputs[Stream.STROKES], "a": topics.inputs[Stream.ANGLES], "c": topics.outputs[Output.CHANGES]}
    told = Change(5 * SECOND, True, Settings(payload=50.0).live, {"joint_1": 0.02})
    with MessageWriter(tmp_path / "bag", keys) as bag:
        for k in range(100):
            stamp = 4 * SECOND + 20_000_000 * k
            bag.write("s", stamp, sensor_message(Sample(Stream.STROKES, stamp, strokes)))
            bag.write("a", stamp, sensor_message(Sample(Stream.ANGLES, stamp, joints)))
            if stamp == told.stamp:
                bag.write_encoded("c", stamp + 1_000_000, encode_changes(told))
    result = replay(tmp_path / "bag", scene, tmp_path / "out")
    predictions, residuals = result.recording.whole.predictions, result.recording.whole.residuals_of(Stream.ANGLES)
    assert predictions.tip_position[49, 1] - predictions.tip_position[50, 1] > 0.01
    assert residuals.values[49, 0] - residuals.values[50, 0] > 0.015
    events = json.loads((tmp_path / "out" / "summary.json").read_text())["events"]
    assert events == {"load": 1, "zero": 1}
    topic = keys["c"]
    again = [decode_changes(msg) for _, _, msg in read(scan(tmp_path / "out" / "bag"), {topic.absolute: topic.type})]
    assert [each.stamp for each in again] == [4 * SECOND, 5 * SECOND] and again[1] == told
