"""Launch file, RViz configuration, layouts: they name what is there. None of the programs that read them is on PyPI."""

from __future__ import annotations

import ast
import json
import re
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pytest
from command import main
from ros_messages import load_topics, new_message
from ruamel.yaml import YAML

import boom_twin
from boom_twin.messages.report_encoder import ShapeMarkers
from boom_twin.messages.urdf import RVIZ, VIEWS

ROOT = Path(boom_twin.__file__).parent
LAUNCH = ROOT / "launch" / "twin.launch.py"
CONFIG = ROOT / "msg_config"
TOPICS = {topic.absolute: topic for each in (load_topics().inputs, load_topics().outputs) for topic in each.values()}
CHANNELS = [f"{kind}_{i}" for kind in ("joint", "cylinder", "mode") for i in range(1, 5)] + ["tip_imu_x", "tip_imu_z"]

API = {
    "launch": {"LaunchContext", "LaunchDescription", "LaunchDescriptionEntity"},
    "launch.actions": {"DeclareLaunchArgument", "ExecuteProcess", "OpaqueFunction", "Shutdown"},
    "launch.substitutions": {"LaunchConfiguration"},
    "launch_ros.actions": {"Node"},
    "launch_ros.parameter_descriptions": {"ParameterValue"},
}
"""Names in modules of ROS 2 Jazzy that the launch file may use."""


def calls(tree: ast.AST, name: str) -> list[ast.Call]:
    return [node for node in ast.walk(tree) if isinstance(node, ast.Call) and getattr(node.func, "id", None) == name]


def test_every_launch_argument_is_declared_and_described_and_imports_exist() -> None:
    """Imports of launch are checked by `API`, those of this package by importing them."""
    tree = ast.parse(LAUNCH.read_text(encoding="utf-8"))
    declared = {call.args[0].value: {key.arg for key in call.keywords} for call in calls(tree, "DeclareLaunchArgument")}
    assert all({"default_value", "description"} <= given for given in declared.values())
    named = [call.args[0] for call in calls(tree, "LaunchConfiguration")]
    assert {node.value for node in named if isinstance(node, ast.Constant)} <= declared.keys()
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and str(node.module).startswith("boom_twin"):
            module = __import__(str(node.module), fromlist=["_"])
            assert all(hasattr(module, alias.name) for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and str(node.module).split(".")[0] in ("launch", "launch_ros"):
            assert {alias.name for alias in node.names} <= API[str(node.module)]


def test_rviz_shows_topics_and_namespaces_that_exist() -> None:
    document = YAML(typ="safe").load((CONFIG / "boom_twin.rviz").read_text(encoding="utf-8"))
    manager = document["Visualization Manager"]
    assert manager["Global Options"]["Fixed Frame"] == "base_link"
    shown = {each["Class"].split("/")[1]: each["Topic"] for each in manager["Displays"] if "Topic" in each}
    for kind, topic in shown.items():
        known = TOPICS[f"/{topic['Value']}"]  # relative to RViz's namespace
        assert known.type.endswith((f"/{kind}", f"/{kind}Stamped"))
        assert topic["Reliability Policy"].lower() == known.qos.reliability
    (boom,) = (each for each in manager["Displays"] if each["Name"] == "Boom")
    drawn = re.findall(r"^    ``(\w+)``,", ShapeMarkers.__doc__ or "", flags=re.MULTILINE)
    assert boom["Namespaces"] == dict.fromkeys(drawn, True)


def field(type_name: str, path: list[str]) -> Any:
    """What a field path leads to in a message of that type; arrays of a JointState have eight entries and more."""
    value: Any = new_message(type_name)
    for part in path:
        name, _, index = part.partition("[")
        value = getattr(value, name)
        assert not index or int(index[:-1]) < 8
    return value


def test_foxglove_shows_topics_and_fields_that_exist() -> None:
    document = json.loads((CONFIG / "foxglove.json").read_text(encoding="utf-8"))
    panels = document["configById"]
    placed = re.findall(r'"(?:first|second)": "([^"]+)"', json.dumps(document["layout"]))
    assert sorted(placed) == sorted(panels)
    assert panels["3D!boom"]["topics"].keys() - TOPICS.keys() == {"/robot_description"}
    paths = [row["value"] for panel in panels.values() for row in panel.get("paths", [])]
    assert len(paths) == 29
    for path in paths:
        topic, *parts = path.split(".")
        field(TOPICS[topic].type, parts)
    assert panels["RawMessages!residuals"]["topicPath"] in TOPICS
    assert panels["DiagnosticSummary!diagnostics"]["topicToRender"] in TOPICS


def test_plotjuggler_shows_topics_and_fields_that_exist() -> None:
    """It names the arrays of a JointState by channel."""
    root = ElementTree.parse(CONFIG / "plotjuggler.xml").getroot()
    curves = [curve.attrib["name"] for curve in root.iter("curve")]
    assert (len(curves), len(set(curves))) == (58, 54)  # those of the prediction stand beside the estimate again
    for curve in curves:
        (topic,) = (name for name in TOPICS if curve.startswith(f"{name}/"))
        *parts, last = curve.removeprefix(f"{topic}/").split("/")
        if TOPICS[topic].type.endswith("JointState"):
            assert parts[0] in CHANNELS
            parts = []
        field(TOPICS[topic].type, [*parts, last])
    (selected,) = root.iter("selected_topics")
    heard = selected.attrib["value"].split(";")
    assert set(heard) <= TOPICS.keys()
    assert all(curve.startswith(tuple(f"{name}/" for name in heard)) for curve in curves)


def test_the_views_of_a_boom_in_a_namespace_show_nothing_of_another(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Each topic is put into the namespace, each frame has its prefix; without both they are the files of the package."""
    assert main(["views", "--out", str(tmp_path / "one"), "--namespace", "/yard/front", "--frame-prefix", "front/"]) == 0
    assert main(["views", "--out", str(tmp_path / "usual")]) == 0
    for view in VIEWS:
        usual, own = (tmp_path / folder / view.name for folder in ("usual", "one"))
        assert usual.read_text() == view.read_text()
        text = own.read_text()
        absolute = set(re.findall(r'(?<=[";])/[a-z_]+', text)) - {"/diagnostics"}
        assert absolute == (set() if view is RVIZ else {"/yard"})
        frames = re.findall(r"[\w/]*base_link", "\n".join(line for line in text.splitlines() if not line.startswith("#")))
        assert set(frames) <= {"front/base_link"} and (frames or view.suffix == ".xml")
    shown = json.loads((tmp_path / "one" / "foxglove.json").read_text())["configById"]["3D!boom"]["topics"]
    assert "/yard/front/robot_description" in shown and "/yard/front/boom_twin/shape" in shown
    assert 'TF Prefix: "front/"' in (tmp_path / "one" / "boom_twin.rviz").read_text()
    capsys.readouterr()
    assert main(["views", "--out", str(tmp_path / "one")]) == 1
    assert "there already" in capsys.readouterr().err
