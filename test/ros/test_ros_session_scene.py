"""A recorder beside a node in a namespace: the scene is the node's, the mapping names the topics that were heard."""

from __future__ import annotations

import json
import signal
import time
from array import array
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("rclpy")

import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from ruamel.yaml import YAML
from sensor_msgs.msg import JointState

from boom_twin.cli.main import main
from boom_twin.scene.load import default_text

ROWS = 200
BASELINE = "description: learnt\nangle_error: 0.0001\n"


class Rig:
    """Publishes strokes and angles in the namespace, and hears what the node says of itself."""

    def __init__(self) -> None:
        self.node = rclpy.create_node("rig")
        self.strokes = self.node.create_publisher(JointState, "/front/cylinder_strokes", 500)
        self.angles = self.node.create_publisher(JointState, "/front/joint_angles", 500)
        self.told: dict[str, Any] = {}
        self.node.create_subscription(DiagnosticArray, "/diagnostics", self._hear, 100)

    def _hear(self, message: Any) -> None:
        self.told.update({status.name: status for status in message.status})

    def until(self, condition: Callable[[], bool], act: Callable[[], None] = lambda: None) -> None:
        end = time.monotonic() + 120.0
        while not condition():
            assert time.monotonic() < end, {name: status.message for name, status in self.told.items()}
            act()
            rclpy.spin_once(self.node, timeout_sec=0.02)

    def send(self, publisher: Any, kind: str, stamp: int, values: Any) -> None:
        names = [f"{kind}_{i + 1}" for i in range(len(values))]
        message = JointState(name=names, position=array("d", values))
        message.header.stamp.sec, message.header.stamp.nanosec = divmod(stamp, 10**9)
        publisher.publish(message)


def test_scene_baseline_and_names_come_from_the_node(
    spawn: Callable[..., Any], spawn_node: Callable[..., Any], motion: dict[str, Any], tmp_path: Path, capsys: Any
) -> None:
    (tmp_path / "scene.yaml").write_text(default_text() + "# a copy\n")
    (tmp_path / "baseline.yaml").write_text(BASELINE)
    files = ["-p", f"scene:={tmp_path / 'scene.yaml'}", "-p", f"baseline:={tmp_path / 'baseline.yaml'}"]
    node, rig, out = spawn_node("-r", "__ns:=/front", *files), Rig(), tmp_path / "bag"
    node.wait_for("active; listening to /front/cylinder_strokes")

    def five() -> None:
        rig.send(rig.strokes, "cylinder", time.time_ns(), [*motion["strokes"][0], 0.1])

    name = "front/boom_twin: cylinder_strokes"
    rig.until(lambda: name in rig.told and rig.told[name].level == b"\x02", five)
    said = rig.told[name].message
    assert f"cylinder_strokes names cylinder_5; the scene ({tmp_path / 'scene.yaml'}) has 4 cylinders" in said

    recorder = spawn("boom_twin.cli.main", "record", "--out", str(out), "--ros-args", "-r", "__ns:=/front")
    sheet = out / "session.yaml"
    rig.until(lambda: sheet.is_file() and BASELINE.splitlines()[0] in sheet.read_text() and "# a copy" in sheet.read_text())
    rig.until(lambda: min(each.get_subscription_count() for each in (rig.strokes, rig.angles)) >= 2)
    time.sleep(0.5)  # a subscription may know of its publisher a moment after the publisher of it
    for row in range(ROWS):
        stamp = int(motion["stamps_ns"][row])
        rig.send(rig.strokes, "cylinder", stamp, motion["strokes"][row])
        rig.send(rig.angles, "joint", stamp, motion["joints"][row])
        time.sleep(0.004)
    time.sleep(1.0)
    rig.node.destroy_node()
    assert recorder.stop(signal.SIGINT) == 0, recorder.said()
    assert node.stop() == 0
    assert f"{ROWS:9d} {ROWS:9d} {0:14d}  /front/cylinder_strokes" in recorder.said()
    assert "no scene is kept" not in recorder.said()

    kept = YAML(typ="safe").load(sheet.read_text())
    assert (kept["scene"], kept["baseline"]) == (default_text() + "# a copy\n", BASELINE)
    mapping = YAML(typ="safe").load(kept["mapping"])
    assert mapping["inputs"]["joint_angles"]["name"] == "/front/joint_angles"
    assert mapping["outputs"]["tip_position"]["name"] == "/front/boom_twin/tip/position"
    assert main(["info", str(out), "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    optional = ("tip_imu", "cylinder_forces")
    lacking = [each for each in told["missing_for_replay"] if not any(name in each for name in optional)]
    assert told["scene"] == f"{sheet}, scene" and not lacking
    assert main(["replay", str(out), "--out", str(tmp_path / "out"), "--no-pictures", "--json"]) == 0
    summary = json.loads(capsys.readouterr().out)
    assert (summary["samples"], summary["scene"], summary["baseline"]) == (ROWS, f"{sheet}, scene", f"{sheet}, baseline")
