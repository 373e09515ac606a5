"""Nodes in processes of their own, in a ROS domain of this test run."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from default_boom import joint_angles_of_strokes, strokes_of_posture
from demo.isolation import Isolation
from made_once import MadeOnce
from recordings import MessageWriter, load_mapping, read_both, scan, write_session
from ros_messages import load_topics

from boom_twin import load_scene, statics

PATIENCE = 240.0  # s; the first node compiles
SECONDS, RATE = 4.0, 200.0


def mapping_with(qos: str) -> str:
    """The text of a mapping whose inputs have this quality of service."""
    return "inputs:\n" + "".join(f"  {stream.value}: {{qos: {{{qos}}}}}\n" for stream in load_topics().inputs)


class Process:
    """A child whose output is kept."""

    def __init__(self, log: Path, *arguments: str, stdin: int | None = subprocess.DEVNULL) -> None:
        self._log = log
        self._file = log.open("w")
        command = [sys.executable, "-m", *arguments]
        self._child = subprocess.Popen(
            command, stdin=stdin, stdout=self._file, stderr=subprocess.STDOUT, start_new_session=True
        )

    @property
    def pid(self) -> int:
        return self._child.pid

    @property
    def children(self) -> list[int]:
        return [int(pid) for pid in Path(f"/proc/{self.pid}/task/{self.pid}/children").read_text().split()]

    def said(self) -> str:
        return self._log.read_text()

    def wait_for(self, text: str) -> str:
        """What it has said, as soon as `text` is in it."""
        end = time.monotonic() + PATIENCE
        while text not in (said := self.said()):
            assert self._child.poll() is None and time.monotonic() < end, f"no {text!r} in:\n{said}"
            time.sleep(0.05)
        return said

    def send(self, number: signal.Signals) -> None:
        self._child.send_signal(number)

    def stop(self, number: signal.Signals = signal.SIGTERM) -> int:
        """Exit code after a signal."""
        self.send(number)
        return self.end()

    def end(self) -> int:
        """Exit code."""
        return self._child.wait(PATIENCE)

    def close(self) -> None:
        with suppress(ProcessLookupError):  # its children too
            os.killpg(self._child.pid, signal.SIGKILL)
        self._child.wait()
        self._file.close()


@pytest.fixture(scope="module")
def domain(isolation: Isolation) -> Iterator[None]:
    """rclpy, started in the domain of this test run."""
    import rclpy

    rclpy.init(args=[])
    yield
    rclpy.try_shutdown()


@pytest.fixture
def demo_path(monkeypatch: pytest.MonkeyPatch) -> None:
    """The demonstration, which is no part of the package, can be imported by children."""
    monkeypatch.setenv("PYTHONPATH", str(Path(__file__).parents[1]), prepend=os.pathsep)


@pytest.fixture(scope="module")
def spawn(domain: None, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Callable[..., Process]]:
    """Starts ``python -m ARGUMENTS``; all are ended with the module."""
    children: list[Process] = []

    def start(*arguments: str, stdin: int | None = subprocess.DEVNULL) -> Process:
        children.append(Process(tmp_path_factory.mktemp("process") / "log", *arguments, stdin=stdin))
        return children[-1]

    yield start
    for child in children:
        child.close()


@pytest.fixture(scope="module")
def spawn_node(spawn: Callable[..., Process]) -> Callable[..., Process]:
    """Starts the node with ROS arguments."""

    def start(*arguments: str) -> Process:
        return spawn("boom_twin.ros.node.main", *(["--ros-args", *arguments] if arguments else []))

    return start


@pytest.fixture(scope="session")
def reliable(tmp_path_factory: pytest.TempPathFactory) -> list[str]:
    """ROS arguments of a node that misses nothing of what a rig sends."""
    path = tmp_path_factory.mktemp("mapping") / "reliable.yaml"
    path.write_text(mapping_with("reliability: reliable"))
    return ["-p", f"mapping:={path}"]


@pytest.fixture(scope="session")
def mapping(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """With this one node and recorder miss nothing of `reliable_bag`, though they may find its player late."""
    path = tmp_path_factory.mktemp("mapping") / "kept.yaml"
    path.write_text(mapping_with("reliability: reliable, durability: transient_local"))
    return path


class Remote:
    """A node's services, called from here."""

    def __init__(self, name: str = "/boom_twin") -> None:
        import rclpy

        self.node, self.name = rclpy.create_node("remote"), name

    def call(self, kind: Any, name: str, request: Any) -> Any:
        import rclpy

        service = f"{self.name}/{name}"
        client = self.node.create_client(kind, service)
        end = time.monotonic() + 60.0
        while not (
            client.service_is_ready() and self.node.count_services(service) == 1
        ):  # a node that has ended is seen longer
            assert time.monotonic() < end, f"{self.node.count_services(service)} of {service}"
            rclpy.spin_once(self.node, timeout_sec=0.05)
        # A node that has just started may be seen from here before it sees who asks; an answer that it sends until then is
        # lost. What can be said twice is said again; a transition waits for a moment.
        is_repeatable = name.startswith(("get_", "describe_", "list_", "set_"))
        if not is_repeatable:
            time.sleep(0.3)
        for _ in range(8 if is_repeatable else 1):
            future = client.call_async(request)
            rclpy.spin_until_future_complete(self.node, future, timeout_sec=30.0 if is_repeatable else 240.0)
            if future.done():
                break
        self.node.destroy_client(client)
        return future.result()

    def trigger(self, name: str) -> Any:
        from std_srvs.srv import Trigger

        return self.call(Trigger, name, Trigger.Request())

    def change(self, transition: int) -> bool:
        from lifecycle_msgs.msg import Transition
        from lifecycle_msgs.srv import ChangeState

        request = ChangeState.Request(transition=Transition(id=transition))
        return bool(self.call(ChangeState, "change_state", request).success)

    def state(self) -> str:
        from lifecycle_msgs.srv import GetState

        return str(self.call(GetState, "get_state", GetState.Request()).current_state.label)

    def set(self, name: str, value: Any) -> Any:
        from rcl_interfaces.srv import SetParameters
        from rclpy.parameter import Parameter

        request = SetParameters.Request(parameters=[Parameter(name, value=value).to_parameter_msg()])
        return self.call(SetParameters, "set_parameters", request).results[0]


@pytest.fixture(scope="module")
def remote(domain: None) -> Iterator[Remote]:
    caller = Remote()
    yield caller
    caller.node.destroy_node()


@pytest.fixture(scope="session")
def motion(made_once: MadeOnce) -> dict[str, Any]:
    """Two cylinders of the default boom move; stamps (ns), lengths (m), joints (rad), imu (m/s^2, made up)."""
    return made_once.value("ros_motion", two_cylinders_move)


def two_cylinders_move() -> dict[str, Any]:
    scene, random = load_scene(), np.random.default_rng(3)
    time_s = np.arange(int(SECONDS * RATE)) / RATE
    stamps = 1_700_000_000_000_000_000 + (time_s * 1e9).astype(np.int64) + random.integers(-150_000, 150_000, len(time_s))
    strokes = np.tile(strokes_of_posture(scene, "arch"), (len(time_s), 1))
    strokes[:, 0] += 0.02 * (1.0 - np.cos(1.5 * time_s))
    strokes[:, 2] += 0.01 * (1.0 - np.cos(2.0 * time_s))
    few = np.arange(0, len(time_s), 20)  # slow enough for equilibria, and for sag to be interpolated
    rigid = np.array([joint_angles_of_strokes(scene, row) for row in strokes])
    at_rest = np.array([statics(scene, lengths=strokes[k], modes=0).joints - rigid[k] for k in few])
    joints = rigid + np.column_stack([np.interp(time_s, time_s[few], column) for column in at_rest.T])
    return {
        "stamps_ns": stamps,
        "strokes": strokes + random.normal(0.0, 2e-5, strokes.shape),
        "joints": joints + random.normal(0.0, 1.7e-4, joints.shape),
        "imu": random.normal((0.0, 9.81), 0.05, (len(time_s), 2)),
    }


@pytest.fixture(scope="session")
def bag(motion: dict[str, Any], tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The motion as a session."""
    path = tmp_path_factory.mktemp("session") / "bag"
    write_session(path, **motion, description={"origin": "synthetic, made for a test"})
    return path


@pytest.fixture(scope="session")
def reliable_bag(bag: Path, mapping: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The same, played with the quality of service of `mapping`."""
    path, inputs = tmp_path_factory.mktemp("session") / "bag", load_mapping(mapping).inputs
    topics = {topic.absolute: topic for topic in inputs.values() if scan(bag).find(topic.absolute) is not None}
    with MessageWriter(path, topics) as writer:
        for name, log_time, data, _ in read_both(scan(bag), {name: topic.type for name, topic in topics.items()}):
            writer.write_encoded(name, log_time, data)
    return path


@pytest.fixture(scope="module")
def new_rig(domain: None) -> Iterator[Callable[..., Any]]:
    """Makes a `ros_rig.Rig`; all are gone after the module."""
    from ros_rig import Rig

    made: list[Rig] = []

    def make(*arguments: str) -> Rig:
        made.append(Rig(*arguments))
        return made[-1]

    yield make
    for rig in made:
        rig.close()
