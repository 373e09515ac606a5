"""Transitions, parameters, and how the node ends."""

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

import rclpy
import rclpy.experimental
from geometry_msgs.msg import PointStamped
from lifecycle_msgs.msg import Transition
from rcl_interfaces.srv import DescribeParameters
from rclpy.lifecycle import TransitionCallbackReturn

from boom_twin.config.settings import Settings
from boom_twin.messages.topic_table import Output
from boom_twin.ros import runtime
from boom_twin.ros.node.node import TwinNode
from boom_twin.scene.load import default_text


@pytest.fixture
def idle(spawn_node: Callable[..., Any]) -> Iterator[Any]:
    """A node that waits for its transitions; strokes remapped."""
    node = spawn_node("-p", "autostart:=false", "-r", "cylinder_strokes:=rig/strokes")
    yield node
    node.stop()  # in order, or the next one's services are taken for those of this one


def test_transitions_by_service(idle: Any, remote: Any) -> None:
    assert remote.state() == "unconfigured"
    steps = [
        (Transition.TRANSITION_CONFIGURE, "inactive"),
        (Transition.TRANSITION_ACTIVATE, "active"),
        (Transition.TRANSITION_DEACTIVATE, "inactive"),
        (Transition.TRANSITION_ACTIVATE, "active"),
        (Transition.TRANSITION_DEACTIVATE, "inactive"),
        (Transition.TRANSITION_CLEANUP, "unconfigured"),
        (Transition.TRANSITION_CONFIGURE, "inactive"),
        (Transition.TRANSITION_INACTIVE_SHUTDOWN, None),
    ]
    for transition, state in steps:
        assert remote.change(transition), idle.said()
        assert state is None or remote.state() == state
    assert idle.end(30.0) == 0
    assert "listening to /rig/strokes, /joint_angles, /tip_imu" in idle.said()


def test_a_transition_that_is_not_there_is_refused_and_the_node_lives_on(idle: Any, remote: Any) -> None:
    """Two who manage it both activate it, or somebody asks for a transition that no state has: rclpy raises then."""
    for transition in (Transition.TRANSITION_ACTIVATE, 99, 0, Transition.TRANSITION_CLEANUP):
        assert not remote.change(transition)
    assert remote.state() == "unconfigured"
    assert remote.change(Transition.TRANSITION_CONFIGURE) and remote.change(Transition.TRANSITION_ACTIVATE)
    for _ in range(5):
        assert not remote.change(Transition.TRANSITION_ACTIVATE)
    assert remote.state() == "active" and "single-threaded" not in idle.said()
    assert idle.said().count("transition 3 refused in state active: ") == 1
    assert remote.change(Transition.TRANSITION_ACTIVE_SHUTDOWN) and idle.end(30.0) == 0


def test_parameters_have_bounds_and_are_fixed_while_configured(idle: Any, remote: Any) -> None:
    request = DescribeParameters.Request(names=["stroke_rate", "imu_sigma"])
    stroke_rate, imu_sigma = remote.call(DescribeParameters, "describe_parameters", request).descriptors
    assert (stroke_rate.floating_point_range[0].from_value, stroke_rate.floating_point_range[0].to_value) == (1e-6, 1e9)
    words = "fixed while the node is configured"
    assert stroke_rate.description == Settings.model_fields["stroke_rate"].description
    assert imu_sigma.additional_constraints.endswith(words)
    for name, value in [
        ("stroke_rate", 1e10),
        ("imu_sigma", 0.0),
        ("imu_sigma", -1.0),
        ("gap", float("nan")),
        ("gap", "long"),
    ]:
        assert not remote.set(name, value).successful, (name, value)
    for name, value, reason in [
        ("playload", 40.0, "playload: unknown. The nearest is `payload`. `ros2 param list` names all."),
        ("payload", 40, "payload: a number needs a decimal point: 40.0, not 40"),
    ]:
        refused = remote.set(name, value)
        assert not refused.successful and refused.reason == reason
    assert remote.set("imu_sigma", 0.03).successful
    assert remote.change(Transition.TRANSITION_CONFIGURE), idle.said()
    for name, value in [("imu_sigma", 0.05), ("scene", "other.yaml")]:
        refused = remote.set(name, value)
        assert not refused.successful and f"{name}: fixed while the node is configured" in refused.reason
    assert not any(remote.set("gap", absurd).successful for absurd in (1e308, 5e-324))
    assert remote.set("gap", 0.2).successful
    assert not remote.set("payload", -2.0).successful
    assert remote.change(Transition.TRANSITION_CLEANUP)
    assert remote.set("imu_sigma", 0.05).successful


def test_only_what_is_listened_to_is_encoded_and_what_late_listeners_get(domain: None, monkeypatch: Any) -> None:
    """Of a node in this process, by another name: its services are seen until the process ends."""
    monkeypatch.setattr("boom_twin.ros.node.node.NODE", "listened_twin")
    node, listener, end = TwinNode(), rclpy.create_node("listener"), time.monotonic() + 60.0
    assert node.trigger_configure() == TransitionCallbackReturn.SUCCESS
    assert {key for key in node._outputs if node._is_wanted(key)} == {Output.CHANGES}
    heard = listener.create_subscription(PointStamped, "/listened_twin/tip/position", print, 10)
    while not node._is_wanted(Output.TIP_POSITION):
        assert time.monotonic() < end
        rclpy.spin_once(node, timeout_sec=0.01)
    listener.destroy_subscription(heard)
    while node._is_wanted(Output.TIP_POSITION):
        assert time.monotonic() < end
        rclpy.spin_once(node, timeout_sec=0.01)
    assert node.trigger_cleanup() == TransitionCallbackReturn.SUCCESS
    node.destroy_node()
    listener.destroy_node()


def test_a_scene_that_cannot_be_used_can_be_replaced(idle: Any, remote: Any, tmp_path: Path) -> None:
    assert remote.set("scene", str(tmp_path / "absent.yaml")).successful
    assert not remote.change(Transition.TRANSITION_CONFIGURE)
    assert remote.state() == "unconfigured"
    assert "absent.yaml" in idle.said()
    assert remote.set("scene", "").successful
    assert remote.change(Transition.TRANSITION_CONFIGURE), idle.said()


def test_a_bad_scene_ends_the_node_with_its_fault(spawn_node: Callable[..., Any], tmp_path: Path) -> None:
    scene = tmp_path / "scene.yaml"
    scene.write_text(default_text().replace("rho_A:", "rho_B:"))
    node = spawn_node("-p", f"scene:={scene}")
    assert node.end() == 1
    assert "sections[0].rho_B = 52.0: unknown key" in node.said()
    assert "Traceback" not in node.said()


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--badly"], "--badly"),
        (["-p", "imu_sigma:=-1.0"], "imu_sigma"),
        (["-p", "look_step:=0.03"], "look_step: without effect since 0.2.0, whose filter adapts by itself: leave it out"),
        (["-p", "gap:=1"], "1.0, not 1"),
        (["--params-file", "/nowhere.yaml"], "/nowhere.yaml"),
        (["-p", "strok_rate:=0.4"], "strok_rate: unknown. The nearest is `stroke_rate`"),
        (["-p", "frame_prefix:=/front/"], "names of frames have no leading slash (tf2). Give 'front/'"),
    ],
)
def test_a_bad_argument_ends_the_node_with_its_name(spawn_node: Callable[..., Any], arguments: list[str], words: str) -> None:
    node = spawn_node(*arguments)
    assert node.end() == 1
    assert words in node.said() and "Traceback" not in node.said()


def test_a_parameter_without_ros_args_is_told_where_it_belongs() -> None:
    command = [sys.executable, "-P", "-m", "boom_twin.ros.node.main", "-p", "payload:=40.0"]
    ended = subprocess.run(command, capture_output=True, text=True, timeout=60.0, check=False)
    assert ended.returncode == 2 and "-p payload:=40.0: unknown. Parameters and remappings follow --ros-args" in ended.stderr


ACTIVE, PREPARING = "active;", "preparing the model"
MOMENTS = [("", signal.SIGINT), (PREPARING, signal.SIGTERM), (ACTIVE, signal.SIGINT), (ACTIVE, signal.SIGTERM)]
CLOSED = pytest.mark.skipif(signal.getsignal(signal.SIGHUP) is signal.SIG_IGN, reason="nohup: a closed terminal ends nothing")
RARER = [("", signal.SIGTERM), (PREPARING, signal.SIGINT)]


@pytest.mark.parametrize(
    ("moment", "number"),
    [
        *MOMENTS,
        pytest.param(ACTIVE, signal.SIGHUP, marks=CLOSED),
        *(pytest.param(*rare, marks=pytest.mark.slow) for rare in RARER),
    ],
)
def test_signals_end_the_node_in_order_at_any_time(
    spawn_node: Callable[..., Any], number: signal.Signals, moment: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    if moment == PREPARING:
        monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))  # so that it compiles
    node = spawn_node()
    node.wait_for(moment)
    time.sleep(0.7)
    assert node.stop(number) == 0, node.said()
    assert node.ended_after < 4.0  # 2 on a machine that is free
    assert "Traceback" not in node.said() and "FATAL" not in node.said()


IN_EXEC = """
import sys
from boom_twin.ros.startup import StopSignal
stop = StopSignal()
print("begun", flush=True)
try:
    exec("while True: pass")
except KeyboardInterrupt:
    sys.exit(0)
"""


def test_a_piece_of_work_in_exec_is_interrupted_in_order() -> None:
    """Dataclasses are made in one while modules are imported; Python would end the process as killed by SIGINT."""
    child = subprocess.Popen([sys.executable, "-c", IN_EXEC], stdout=subprocess.PIPE, text=True)
    assert child.stdout is not None and child.stdout.readline() == "begun\n"
    child.send_signal(signal.SIGTERM)
    assert child.wait(60.0) == 0


STUCK = """
import hashlib, sys
from boom_twin.twin.twin import Twin
Twin.warm_up = lambda self: hashlib.pbkdf2_hmac("sha256", b"", b"", 10**9)
from boom_twin.ros.node.main import main
sys.exit(main([]))
"""
"""A node whose preparation is one call into C that takes minutes, as compiling a large kernel takes seconds."""


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_a_node_that_is_deep_in_compiled_code(
    spawn: Callable[..., Any], number: signal.Signals, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PYTHONPATH", f"{tmp_path}{os.pathsep}{os.getcwd()}")
    (tmp_path / "start_stuck.py").write_text(STUCK)
    node = spawn("start_stuck")
    node.wait_for("preparing the model")
    time.sleep(0.7)
    assert node.stop(number) == 0, node.said()
    assert "stopped in the midst of its work" in node.said() and "Traceback" not in node.said()


MISSING = "del e.EventsExecutor"
FAILING = """
class Bad:
    add_node = remove_node = lambda self, node: None
    def spin_once(self, timeout_sec): raise RuntimeError("worn out")
e.EventsExecutor = Bad
"""


@pytest.mark.parametrize("fault", [MISSING, FAILING])
def test_without_the_events_executor(
    spawn: Callable[..., Any], fault: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PYTHONPATH", f"{tmp_path}{os.pathsep}{os.getcwd()}")
    lines = ["import sys, rclpy.experimental as e", fault, "from boom_twin.ros.node.main import main", "sys.exit(main([]))"]
    (tmp_path / "start_without.py").write_text("\n".join(lines))
    node = spawn("start_without")
    node.wait_for("the single-threaded executor goes on")
    assert node.said().count("events executor:") == 1
    time.sleep(0.5)
    assert node.stop() == 0, node.said()
    assert "Traceback" not in node.said()


def test_turns_of_the_events_executor_are_long_and_end_in_time(domain: None, monkeypatch: pytest.MonkeyPatch) -> None:
    turns: list[float] = []

    class Counted:
        """The events executor, and when its turns begin."""

        def __init__(self) -> None:
            self._executor = rclpy.experimental.EventsExecutor()

        def __getattr__(self, name: str) -> Any:
            return getattr(self._executor, name)

        def spin_until_future_complete(self, turn: Any, timeout_sec: float) -> None:
            turns.append(time.monotonic())
            self._executor.spin_until_future_complete(turn, timeout_sec=timeout_sec)

    monkeypatch.setattr(runtime, "events_executor", Counted)
    node, begun = rclpy.create_node("turns"), time.monotonic()
    with runtime.CallbackTurns(node, lambda: time.monotonic() > begun + 2.0) as running:
        running.run()
    assert len(turns) == 1  # each leaves something behind in rclpy 7.1: ten of them at the former 0.2 s
    assert not list(node.timers)
    node.destroy_node()
