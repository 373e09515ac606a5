"""The launch files under ROS's own launch, in processes of their own; programs of C++ are stood in for by scripts.

launch and launch_ros are not on PyPI: the tests run where this Python has them, or the one that ``LAUNCH_PYTHON`` names, in
which this package must be installed too.
"""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("rclpy")

import boom_twin
from boom_twin.bag.reader import scan
from boom_twin.bag.session_model import mapping_of, scene_of
from boom_twin.messages.topic_table import Output
from boom_twin.scene.load import default_text

LAUNCH = Path(boom_twin.__file__).parent / "launch"
PYTHON = os.environ.get("LAUNCH_PYTHON", sys.executable)
PATIENCE = 240.0
RUN = """
import sys
from launch import LaunchDescription, LaunchService
from launch.actions import IncludeLaunchDescription
from launch.launch_description_sources import PythonLaunchDescriptionSource
path, *pairs = sys.argv[1:]
given = [pair.split(":=", 1) for pair in pairs]
service = LaunchService()
source = PythonLaunchDescriptionSource(path)
service.include_launch_description(LaunchDescription([IncludeLaunchDescription(source, launch_arguments=given)]))
sys.exit(service.run())
"""
STAND_IN = """#!/bin/sh
echo "stand-in {name} $*"
for word in "$@"; do [ -f "$word" ] && cat "$word"; done
exec sleep 1000
"""


def own_environment() -> dict[str, str]:
    """That of another Python than this one."""
    left_out = ("_ROS_WHEELS_BOOTSTRAP_COMPLETE", "LD_LIBRARY_PATH")
    return {name: value for name, value in os.environ.items() if name not in left_out}


def has_launch() -> bool:
    command = [PYTHON, "-c", "import launch_ros.actions, boom_twin"]
    return subprocess.run(command, env=own_environment(), capture_output=True, check=False).returncode == 0


pytestmark = pytest.mark.skipif(not has_launch(), reason=f"{PYTHON} has no launch_ros; name another one by LAUNCH_PYTHON")


class Launched:
    """A launch in a session of its own, so that what it leaves behind can be found."""

    def __init__(self, folder: Path, prefixes: list[Path], name: str, arguments: dict[str, Any]) -> None:
        self._log, self._ros = folder / "log", folder / "ros"
        environment = own_environment() | {
            "AMENT_PREFIX_PATH": os.pathsep.join(map(str, prefixes)),
            "ROS_LOG_DIR": str(self._ros),
            "PYTHONUNBUFFERED": "1",
        }
        words = [f"{key}:={value}" for key, value in arguments.items()]
        with self._log.open("w") as log:
            command = [PYTHON, "-c", RUN, str(LAUNCH / f"{name}.launch.py"), *words]
            self.process = subprocess.Popen(
                command, env=environment, stdin=subprocess.DEVNULL, stdout=log, stderr=log, start_new_session=True
            )

    def said(self) -> str:
        """On the screen, then in the files of launch, where the words of others than the twin are."""
        return "".join(path.read_text() for path in (self._log, *sorted(self._ros.rglob("*.log"))))

    def wait_for(self, *texts: str) -> None:
        end = time.monotonic() + PATIENCE
        while not all(text in self.said() for text in texts):
            assert self.process.poll() is None and time.monotonic() < end, f"no {texts} in:\n{self.said()}"
            time.sleep(0.1)

    def end(self, number: signal.Signals | None = None) -> int:
        if number is not None:
            self.process.send_signal(number)
        return self.process.wait(PATIENCE)

    def is_gone(self) -> bool:
        """Whether no process is left of all that were started."""
        try:
            os.killpg(self.process.pid, 0)
        except ProcessLookupError:
            return True
        return False

    def close(self) -> None:
        if not self.is_gone():
            os.killpg(self.process.pid, signal.SIGKILL)
        self.process.wait()


def add_package(prefix: Path, name: str, executable: str, text: str) -> None:
    """Put a package of one script into an index."""
    for path, content in {
        prefix / "share/ament_index/resource_index/packages" / name: "",
        prefix / "lib" / name / executable: text,
    }.items():
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(content)
        path.chmod(0o755)


Start = Callable[..., Launched]


@pytest.fixture
def start(isolation: Any, tmp_path: Path) -> Iterator[Start]:
    """Launches a file; `extra` are packages of C++ that are there."""
    made: list[Launched] = []

    def start(name: str, *extra: str, **arguments: Any) -> Launched:
        prefix = tmp_path / f"prefix_{len(made)}"
        add_package(prefix, "boom_twin", "twin_node", f'#!/bin/sh\nexec {PYTHON} -P -m boom_twin.ros.node.main "$@"\n')
        for each in extra:
            add_package(prefix, each, each, STAND_IN.format(name=each))
        made.append(Launched(prefix, [prefix], name, arguments))
        return made[-1]

    yield start
    for each in made:
        each.close()


def test_without_a_screen_and_without_cpp(start: Start, tmp_path: Path) -> None:
    """Node and recorder in a namespace; the recording knows what the launch was given."""
    scene, mapping = tmp_path / "boom.yaml", tmp_path / "mapping.yaml"
    scene.write_text("# of this rig\n" + default_text())
    mapping.write_text("inputs: {tip_imu: {delay: 0.01}}\n")
    out = tmp_path / "session"
    given = {"namespace": "front", "frame_prefix": "front/", "state_publisher": "false", "record": out}
    launched = start("twin", **given, scene=scene, mapping=mapping)
    launched.wait_for("active; listening to /front/cylinder_strokes", "recording")
    end = time.monotonic() + PATIENCE
    while '"front/base_link"' not in (out / "session.yaml").read_text():
        assert time.monotonic() < end
        time.sleep(0.1)
    launched.end(signal.SIGINT)
    assert launched.is_gone() and "Traceback" not in launched.said()
    kept = mapping_of(out).topics
    assert {topic.name.split("/")[1] for topic in kept.inputs.values()} == {"front"}
    assert kept.outputs[Output.SHAPE].absolute == "/front/boom_twin/shape"
    assert (kept.frame, [topic.delay for topic in kept.inputs.values()]) == ("front/base_link", [0.0, 0.0, 0.01, 0.0])
    assert scene_of(out).text.startswith("# of this rig\n")


def test_robot_state_publisher_is_told_everything(start: Start) -> None:
    names = ("robot_state_publisher", "rviz2")
    launched = start("twin", *names, namespace="rear", frame_prefix="rear/", ignore_timestamp="true", rviz="true")
    launched.wait_for("stand-in robot_state_publisher", "stand-in rviz2", "<robot", "ignore_timestamp", "TF Prefix")
    said = launched.said()
    assert "__ns:=/rear" in said and "joint_states:=boom_twin/joint_states" in said
    assert "frame_prefix: rear/" in said and "Fixed Frame: rear/base_link" in said and "tip_pitch" in said
    launched.wait_for("active;")
    launched.end(signal.SIGINT)
    assert launched.is_gone()


@pytest.mark.parametrize("name", ["/**", "/front/boom_twin"])
def test_the_parameter_file_holds_where_no_argument_is_given(start: Start, tmp_path: Path, name: str) -> None:
    """Empty arguments are not given; those that are win, whatever name the file gives the node."""
    scene, mapping, params = (tmp_path / f"{each}.yaml" for each in ("boom", "mapping", "params"))
    scene.write_text(default_text() + "# of the file\n")
    mapping.write_text("inputs: {tip_imu: {delay: 0.01}}\n")
    own = {"scene": f'"{scene}"', "mapping": f'"{mapping}"', "frame_prefix": "file/", "use_sim_time": "true", "payload": "7.5"}
    blocks = "".join(f"    {key}: {value}\n" for key, value in own.items())
    params.write_text(f"{name}:\n  ros__parameters:\n{blocks}")
    out = tmp_path / "session"
    given = {"namespace": "front", "params_file": params, "record": out}
    launched = start("twin", "robot_state_publisher", **given)
    launched.wait_for("active;", "recording", "frame_prefix: file/", "use_sim_time: true")
    end = time.monotonic() + PATIENCE
    while "payload: 7.5" not in (out / "session.yaml").read_text():
        assert time.monotonic() < end
        time.sleep(0.1)
    launched.end(signal.SIGINT)
    assert mapping_of(out).topics.frame == "file/base_link" and scene_of(out).text.endswith("# of the file\n")
    launched = start(
        "twin", "robot_state_publisher", params_file=params, namespace="front", frame_prefix="given/", monitor="false"
    )
    launched.wait_for("active;", "frame_prefix: given/", "use_sim_time: true")
    launched.end(signal.SIGINT)
    assert launched.is_gone()


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({}, "package robot_state_publisher is not in AMENT_PREFIX_PATH: install it, or say state_publisher:=false"),
        ({"state_publisher": "false", "rviz": "true"}, "package rviz2 is not in AMENT_PREFIX_PATH"),
        ({"state_publisher": "false", "scene": "/no/such/boom.yaml"}, "/no/such/boom.yaml"),
        ({"state_publisher": "false", "mapping": "/no/such/mapping.yaml"}, "/no/such/mapping.yaml"),
        ({"state_publisher": "false", "params_file": "/no/such/twin.yaml"}, "/no/such/twin.yaml"),
        ({"state_publisher": "perhaps"}, "perhaps"),
    ],
)
def test_what_fails_leaves_nothing_behind(start: Start, arguments: dict[str, str], words: str) -> None:
    launched = start("twin", **arguments)
    assert launched.end() == 1
    assert launched.is_gone() and words in launched.said()
    assert "process started" not in launched.said()


def test_a_node_that_cannot_start_ends_all(start: Start, tmp_path: Path) -> None:
    launched = start("twin", "robot_state_publisher", frame_prefix="/front/")
    launched.end()
    assert launched.is_gone() and "frame_prefix = '/front/'" in launched.said()


def test_a_session_is_played_into_the_twin_and_all_ends_with_it(start: Start, bag: Path, tmp_path: Path) -> None:
    out = tmp_path / "again"
    launched = start("replay", bag=bag, namespace="front", state_publisher="false", rviz="false", record=out)
    assert launched.end() == 0, launched.said()
    assert launched.is_gone() and "sent in" in launched.said() and "\r" not in launched.said()
    found = scan(out)
    strokes, positions = (found.find(f"/front/{name}") for name in ("cylinder_strokes", "boom_twin/tip/position"))
    assert strokes is not None and positions is not None and min(strokes.count, positions.count) > 100


def test_a_session_that_cannot_be_played_starts_nothing(start: Start, tmp_path: Path) -> None:
    launched = start("replay", bag=tmp_path / "none", state_publisher="false", rviz="false")
    assert launched.end() == 1
    assert launched.is_gone() and "process started" not in launched.said() and "none" in launched.said()
