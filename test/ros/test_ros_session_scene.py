"""A recorder beside a node in a namespace, with sensors of other names and units: a replay needs nothing but the recording."""

from __future__ import annotations

import json
import signal
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("rclpy")

from command import main
from default_boom import default_text
from geometry_msgs.msg import PointStamped
from rclpy.qos import DurabilityPolicy, QoSProfile
from recordings import mapping_of
from ros_messages import Output, stamp_of
from ros_rig import Rig, all_stored, joint_state, published
from ruamel.yaml import YAML
from sensor_msgs.msg import JointState

from boom_twin.ros.bag.recorder import COMPLETE

MAPPING = """
inputs:
  cylinder_strokes: {name: rig/joint_states, qos: {reliability: reliable, depth: 500}}
  joint_angles: {name: rig/joint_states, qos: {reliability: reliable, depth: 500}}
outputs:
  tip_position: {qos: {durability: transient_local, depth: 1}}
sensors:
  cylinder_1: {name: lift, unit: mm, sign: -1, zero: 900.0}
  joint_2: {name: knee, unit: deg}
"""
ROWS = 200


def message(stamp: int, strokes: Any, angles: Any) -> JointState:
    """One for all sensors; angles come with some only."""
    names = ["spare", "cylinder_4", "cylinder_3", "cylinder_2", "lift"]
    values = [7.0, strokes[3], strokes[2], strokes[1], 900.0 - 1e3 * strokes[0]]
    if angles is not None:
        names += ["joint_1", "knee", "joint_3", "joint_4"]
        values += [angles[0], np.degrees(angles[1]), angles[2], angles[3]]
    return joint_state(stamp, names, values)


def test_scene_and_names_are_those_of_the_node(
    spawn: Callable[..., Any],
    spawn_node: Callable[..., Any],
    new_rig: Callable[..., Rig],
    motion: dict[str, Any],
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    texts = {"scene": default_text() + "# a copy\n", "mapping": MAPPING}
    files = {name: tmp_path / f"{name}.yaml" for name in texts}
    for name, text in texts.items():
        files[name].write_text(text)
    node = spawn_node("-r", "__ns:=/front", *(part for name in texts for part in ("-p", f"{name}:={files[name]}")))
    node.wait_for("active; listening to /front/rig/joint_states, /front/tip_imu")
    rig, out = new_rig("/front"), tmp_path / "bag"
    publisher = rig.node.create_publisher(JointState, "rig/joint_states", 500)

    strange = joint_state(1, ["lift", "cylinder_2", "cylinder_3", "cylinder_4", "cylinder_5"], [0.1] * 5)
    told = f"names cylinder_5; the scene ({files['scene']}) has 4 cylinders"

    def is_told() -> bool:
        return any(told in status.message and status.level == b"\x02" for msg in rig.diagnostics for status in msg.status)

    rig.until(is_told, lambda: publisher.publish(strange))
    record = ("record", "--out", str(out), "--mapping", str(files["mapping"]), "--ros-args", "-r", "__ns:=/front")
    recorder, sheet = spawn("boom_twin.cli.main", *record), out / "session.yaml"
    recorder.wait_for(COMPLETE)
    rig.until(lambda: publisher.get_subscription_count() == 2)
    rig.until(lambda: "# a copy" in sheet.read_text())
    for row in range(ROWS):
        angles = motion["joints"][row] if row % 4 == 0 else None
        publisher.publish(message(motion["stamps_ns"][row], motion["strokes"][row], angles))
    last, late = int(motion["stamps_ns"][ROWS - 1]), list[int]()
    rig.until(lambda: bool(rig.answers) and rig.answers[-1][0] == last)
    keeping = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    topic = "/front/boom_twin/tip/position"
    rig.node.create_subscription(PointStamped, topic, lambda msg: late.append(stamp_of(msg)), keeping)
    rig.until(lambda: late == [last])
    all_stored(rig.node, "front")
    assert recorder.stop(signal.SIGINT) == node.stop() == 0, recorder.said()
    assert "no scene is kept" not in recorder.said()

    kept = YAML(typ="safe").load(sheet.read_text())
    assert kept["scene"] == texts["scene"]
    topics = mapping_of(out).topics
    assert topics.outputs[Output.TIP_POSITION].name == topic
    assert {each.name.rpartition("/")[0] for each in topics.inputs.values()} == {"/front", "/front/rig"}
    assert main(["info", str(out), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["scene"] == f"{sheet}, scene"
    assert all(
        any(name in each for name in ("tip_imu", "cylinder_forces", "cylinder_pressures"))
        for each in found["missing_for_replay"]
    ), found
    assert main(["replay", str(out), "--out", str(tmp_path / "out"), "--no-pictures", "--json"]) == 0
    summary = json.loads(capsys.readouterr().out)
    assert {name: summary[name] for name in texts} == {name: f"{sheet}, {name}" for name in texts}
    assert (summary["samples"], summary["dropped"]) == (ROWS, 0)
    live, again = (
        [published(folder, topics, key) for key in (Output.TIP_POSITION, Output.RESIDUALS)]
        for folder in (out, tmp_path / "out" / "bag")
    )
    assert len(live[1]) >= ROWS - 1 and live[1] == again[1]
    assert live[0] and set(live[0]) <= set(again[0])  # a publisher of depth 1 may lose all but the newest of a burst
