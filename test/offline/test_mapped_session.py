"""A rig with sensors of its own: other names, units, signs and zeros, one topic for all, angles at a quarter of the rate."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from command import main
from recordings import MessageWriter, SessionMetadata, write_session
from ros_messages import fill_header, load_topics, new_message
from session_readings import rows_in

from boom_twin import Stream, UsageError, load_scene, replay

SESSION = Path(__file__).parents[2] / "bags" / "arch_session"
JOINT_STATE = "sensor_msgs/msg/JointState"
ROWS, EVERY = 600, 4
MAPPING = """
inputs:
  cylinder_strokes: {name: /rig/joint_states}
  joint_angles: {name: /rig/joint_states}
sensors:
  cylinder_1: {name: lift, unit: mm, zero: 1200.0, sign: -1}
  cylinder_2: {name: "cyl b", unit: cm}
  joint_1: {name: alpha, unit: deg, zero: 90.0}
  joint_2: {name: beta, scale: 0.5}
  joint_4: {name: delta, unit: gon, sign: -1}
"""


@pytest.fixture(scope="module")
def arrays():
    return tuple(each[:ROWS] for each in rows_in(SESSION, 4.0)[:3])


@pytest.fixture(scope="module")
def usual(arrays, tmp_path_factory):
    """Replay of the same numbers as the twin has them by itself."""
    path = tmp_path_factory.mktemp("usual")
    write_session(path / "bag", *arrays, None, {"origin": "synthetic, a test"})
    return replay(path / "bag", load_scene(), path / "out")


@pytest.fixture(scope="module")
def rig(arrays, tmp_path_factory):
    """The bag of the rig, with its mapping; every fourth message has the angles too."""
    path = tmp_path_factory.mktemp("rig") / "bag"
    topic = load_topics().inputs[Stream.STROKES].model_copy(update={"name": "/rig/joint_states"})
    with MessageWriter(path, {"all": topic}, {"origin": "synthetic, a test"}) as bag:
        for row, (stamp, strokes, angles) in enumerate(zip(*arrays, strict=True)):
            msg = new_message(JOINT_STATE)
            fill_header(msg.header, int(stamp))
            values = {
                "slew": 0.3,
                "lift": 1200.0 - 1e3 * strokes[0],
                "cylinder_4": strokes[3],
                "cyl b": 1e2 * strokes[1],
                "cylinder_3": strokes[2],
            }
            if row % EVERY == 0:
                gon = -angles[3] * 200.0 / np.pi
                own = {"delta": gon, "joint_3": angles[2], "beta": 2 * angles[1], "alpha": 90.0 + np.degrees(angles[0])}
                values = {**own, **values}
            msg.name, msg.position = list(values), np.array([*values.values()])
            bag.write("all", int(stamp), msg)
    SessionMetadata("test", "", "", MAPPING, {}).write(path)
    return path


def test_a_recording_is_replayed_with_its_own_mapping(rig, usual, tmp_path):
    found = replay(rig, load_scene(), tmp_path / "out")
    assert found.summary["mapping"] == f"{rig / 'session.yaml'}, mapping"
    assert (found.summary["samples"], found.summary["dropped"], found.summary["events"]) == (ROWS, 0, {})
    one, other = found.recording.whole.predictions, usual.recording.whole.predictions
    assert one.stamps.tolist() == other.stamps.tolist()
    np.testing.assert_allclose(one.tip_position, other.tip_position, atol=1e-9)
    np.testing.assert_allclose(one.tip_acceleration, other.tip_acceleration, atol=1e-5)
    expected, angles = usual.recording.whole.residuals_of(Stream.ANGLES), found.recording.whole.residuals_of(Stream.ANGLES)
    assert len(angles.stamps) == ROWS // EVERY
    rows = np.searchsorted(expected.stamps, angles.stamps)
    assert expected.stamps[rows].tolist() == angles.stamps.tolist()
    np.testing.assert_allclose(angles.values, expected.values[rows], atol=1e-9)


def test_a_mapping_for_another_boom_is_refused(rig, tmp_path):
    (tmp_path / "own.yaml").write_text("sensors: {joint_7: {}}")
    with pytest.raises(UsageError, match="the scene has 4 joints"):
        replay(rig, load_scene(), tmp_path / "out", mapping=tmp_path / "own.yaml")


def test_info_looks_for_the_names_of_the_recording(rig, capsys):
    assert main(["info", str(rig)]) == 0
    told = capsys.readouterr().out
    assert "missing" in told and "tip_imu" in told and "never names" not in told
