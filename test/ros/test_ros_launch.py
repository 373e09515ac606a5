"""The launch files under ROS's own launch, in processes of their own; programs of C++ are stood in for by scripts.

launch and launch_ros are not on PyPI: the tests run where this Python has them, or the one that ``LAUNCH_PYTHON`` names, in
which this package must be installed too.
"""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from eventually import eventually

pytest.importorskip("rclpy")

from default_boom import default_text
from recordings import mapping_of, scene_of
from ros_messages import Output

import boom_twin
from boom_twin import Stream

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
        def all_said() -> None:
            said = self.said()
            assert all(text in said for text in texts), f"no {texts} in:\n{said}"

        eventually(all_said, PATIENCE)

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


def parameters(folder: Path, node: str) -> dict[str, Path]:
    """A parameter file, and the scene and the mapping that it names."""
    found = {name: folder / f"{name}.yaml" for name in ("scene", "mapping", "params_file")}
    found["scene"].write_text(default_text() + "# of the file\n")
    found["mapping"].write_text("inputs: {tip_imu: {delay: 0.01}}\n")
    own = {"scene": f'"{found["scene"]}"', "mapping": f'"{found["mapping"]}"', "frame_prefix": "file/", "payload": "7.5"}
    blocks = "".join(f"    {key}: {value}\n" for key, value in (own | {"use_sim_time": "true"}).items())
    found["params_file"].write_text(f"{node}:\n  ros__parameters:\n{blocks}")
    return found


def kept(launched: Launched, out: Path, word: str) -> tuple[str, Any]:
    """Scene and topics that a recording has, once `word` of the node is in it and all has been ended."""

    def is_told() -> None:
        assert word in (out / "session.yaml").read_text()

    eventually(is_told, PATIENCE)
    launched.end(signal.SIGINT)
    assert launched.is_gone() and "Traceback" not in launched.said()
    return scene_of(out).text, mapping_of(out).topics


def test_the_parameter_file_holds_where_no_argument_is_given(start: Start, tmp_path: Path) -> None:
    """Empty arguments are not given. Node, recorder, robot_state_publisher and RViz in a namespace are all told."""
    given = {"namespace": "front", "params_file": parameters(tmp_path, "/front/boom_twin")["params_file"]}
    out, names = tmp_path / "session", ("robot_state_publisher", "rviz2")
    launched = start("twin", *names, **given, record=out, ignore_timestamp="true", rviz="true")
    launched.wait_for("active; listening to /front/cylinder_strokes", "recording", "use_sim_time: true", "ignore_timestamp")
    launched.wait_for("stand-in robot_state_publisher", "stand-in rviz2", "<robot", "frame_prefix: file/", "TF Prefix")
    said = launched.said()
    assert "__ns:=/front" in said and "joint_states:=boom_twin/joint_states" in said
    assert "Fixed Frame: file/base_link" in said and "tip_pitch" in said
    scene, topics = kept(launched, out, "payload: 7.5")
    assert {topic.name.split("/")[1] for topic in topics.inputs.values()} == {"front"}
    assert topics.outputs[Output.SHAPE].absolute == "/front/boom_twin/shape"
    assert topics.frame == "file/base_link"
    assert {stream: topic.delay for stream, topic in topics.inputs.items() if topic.delay} == {Stream.IMU: 0.01}
    assert scene.endswith("# of the file\n")


def test_arguments_win_without_a_screen_and_without_cpp(start: Start, tmp_path: Path) -> None:
    """Whatever name the file gives the node."""
    scene, mapping, out = tmp_path / "given.yaml", tmp_path / "other.yaml", tmp_path / "session"
    scene.write_text("# given\n" + default_text())
    mapping.write_text("inputs: {tip_imu: {delay: 0.02}}\n")
    given = {"scene": scene, "mapping": mapping, "frame_prefix": "given/", "namespace": "front", "state_publisher": "false"}
    launched = start("twin", **given, params_file=parameters(tmp_path, "/**")["params_file"], record=out)
    launched.wait_for("active;", "recording")
    text, topics = kept(launched, out, "given/base_link")
    assert text.startswith("# given\n")
    assert (topics.frame, topics.inputs[Stream.IMU].delay) == ("given/base_link", 0.02)


NO_CPP = {"state_publisher": "false"}


@pytest.mark.parametrize(
    ("name", "arguments", "words"),
    [
        ("twin", {}, "package robot_state_publisher is not in AMENT_PREFIX_PATH: install it, or say state_publisher:=false"),
        ("twin", NO_CPP | {"scene": "/no/such/boom.yaml"}, "/no/such/boom.yaml"),
        ("twin", NO_CPP | {"params_file": "/no/such/twin.yaml"}, "/no/such/twin.yaml"),
    ],
)
def test_what_fails_leaves_nothing_behind(start: Start, name: str, arguments: dict[str, str], words: str) -> None:
    launched = start(name, **arguments)
    assert launched.end() == 1
    assert launched.is_gone() and words in launched.said()
    assert "process started" not in launched.said()


def test_a_node_that_cannot_start_ends_all(start: Start) -> None:
    launched = start("twin", "robot_state_publisher", frame_prefix="/front/")
    launched.end()
    assert launched.is_gone() and "frame_prefix = '/front/'" in launched.said()
