"""Transitions, parameters, and how the node ends."""

from __future__ import annotations

import signal
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("rclpy")

import rclpy
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState, GetState
from rcl_interfaces.srv import DescribeParameters, SetParameters
from rclpy.parameter import Parameter

from boom_twin.scene.load import default_text
from boom_twin.settings import Settings


class Remote:
    """A node's services, called from here."""

    def __init__(self) -> None:
        self.node = rclpy.create_node("remote")

    def call(self, kind: Any, name: str, request: Any) -> Any:
        client = self.node.create_client(kind, f"/boom_twin/{name}")
        assert client.wait_for_service(30.0)
        future = client.call_async(request)
        rclpy.spin_until_future_complete(self.node, future, timeout_sec=240.0)
        self.node.destroy_client(client)
        return future.result()

    def change(self, transition: int) -> bool:
        request = ChangeState.Request(transition=Transition(id=transition))
        return bool(self.call(ChangeState, "change_state", request).success)

    def state(self) -> str:
        return str(self.call(GetState, "get_state", GetState.Request()).current_state.label)

    def set(self, name: str, value: Any) -> Any:
        request = SetParameters.Request(parameters=[Parameter(name, value=value).to_parameter_msg()])
        return self.call(SetParameters, "set_parameters", request).results[0]


@pytest.fixture
def remote(domain: None) -> Iterator[Remote]:
    caller = Remote()
    yield caller
    caller.node.destroy_node()


@pytest.fixture
def idle(spawn_node: Callable[..., Any]) -> Iterator[Any]:
    """A node that waits for its transitions; strokes remapped."""
    node = spawn_node("-p", "autostart:=false", "-r", "cylinder_strokes:=rig/strokes")
    yield node
    node.close()


def test_transitions_by_service(idle: Any, remote: Remote) -> None:
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


def test_parameters_have_bounds_and_are_fixed_while_configured(idle: Any, remote: Remote) -> None:
    request = DescribeParameters.Request(names=["rho", "lag"])
    rho, lag = remote.call(DescribeParameters, "describe_parameters", request).descriptors
    assert (rho.floating_point_range[0].from_value, rho.floating_point_range[0].to_value) == (0.0, 1.0)
    assert (rho.description, lag.additional_constraints) == (Settings.model_fields["rho"].description, "lag > 0.0")
    for name, value in [
        ("rho", 1.5),
        ("rho", 1.0),
        ("lag", 0.0),
        ("lag", -1.0),
        ("gap", float("nan")),
        ("gap", "long"),
    ]:
        assert not remote.set(name, value).successful, (name, value)
    assert remote.set("lag", 0.08).successful
    assert remote.change(Transition.TRANSITION_CONFIGURE), idle.said()
    refused = remote.set("lag", 0.05)
    assert not refused.successful and "lag: fixed while the node is configured" in refused.reason
    assert remote.change(Transition.TRANSITION_CLEANUP)
    assert remote.set("lag", 0.05).successful


def test_a_scene_that_cannot_be_used_can_be_replaced(idle: Any, remote: Remote, tmp_path: Path) -> None:
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
        (["-p", "rho:=1.5"], "rho"),
        (["-p", "lag:=0.0"], "lag"),
        (["-p", "gap:=1"], "1.0, not 1"),
        (["--params-file", "/nowhere.yaml"], "/nowhere.yaml"),
    ],
)
def test_a_bad_argument_ends_the_node_with_its_name(
    spawn_node: Callable[..., Any], arguments: list[str], words: str
) -> None:
    node = spawn_node(*arguments)
    assert node.end() == 1
    assert words in node.said() and "Traceback" not in node.said()


def test_sigterm_ends_the_node_in_order(spawn_node: Callable[..., Any]) -> None:
    node = spawn_node()
    node.wait_for("active;")
    assert node.stop(signal.SIGTERM) == 0
    assert "Traceback" not in node.said()
