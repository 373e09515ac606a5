"""Transitions, parameters, and how the node ends."""

from __future__ import annotations

import signal
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("rclpy")

from lifecycle_msgs.msg import Transition
from rcl_interfaces.srv import DescribeParameters
from ros_rig import Rig

from boom_twin import Settings


@pytest.fixture(scope="module")
def idle(spawn_node: Callable[..., Any]) -> Any:
    """A node that waits for its transitions; strokes remapped."""
    return spawn_node("-p", "autostart:=false", "-r", "cylinder_strokes:=rig/strokes")


def test_parameters_have_bounds_and_are_fixed_while_configured(idle: Any, remote: Any, tmp_path: Path) -> None:
    request = DescribeParameters.Request(names=["stroke_rate", "imu_sigma"])
    stroke_rate, imu_sigma = remote.call(DescribeParameters, "describe_parameters", request).descriptors
    assert (stroke_rate.floating_point_range[0].from_value, stroke_rate.floating_point_range[0].to_value) == (1e-6, 1e9)
    assert stroke_rate.description == Settings.model_fields["stroke_rate"].description
    assert imu_sigma.additional_constraints.endswith("fixed while the node is configured")
    for name, value, reason in [
        ("stroke_rate", 1e10, "stroke_rate"),
        ("imu_sigma", 0.0, "imu_sigma"),
        ("gap", float("nan"), "gap"),
        ("gap", "long", "Type.DOUBLE"),
        ("playload", 40.0, "playload: unknown. The nearest is `payload`. `ros2 param list` names all."),
        ("payload", 40, "payload: a number needs a decimal point: 40.0, not 40"),
    ]:
        refused = remote.set(name, value)
        assert not refused.successful and reason in refused.reason, refused
    assert remote.set("imu_sigma", 0.03).successful
    assert remote.set("scene", str(tmp_path / "absent.yaml")).successful
    assert not remote.change(Transition.TRANSITION_CONFIGURE)
    assert remote.state() == "unconfigured" and "absent.yaml" in idle.said()
    assert remote.set("scene", "").successful
    assert remote.change(Transition.TRANSITION_CONFIGURE), idle.said()
    for name, value in [("imu_sigma", 0.05), ("scene", "other.yaml")]:
        refused = remote.set(name, value)
        assert not refused.successful and f"{name}: fixed while the node is configured" in refused.reason
    before = {"imu_sigma": 0.03, "scene": "", "autostart": False, "gap": Settings().gap}
    assert all(remote.set(name, value).successful for name, value in before.items())  # as they are
    assert not remote.set("autostart", True).successful
    assert not any(remote.set(name, absurd).successful for name, absurd in [("gap", 1e308), ("gap", 5e-324), ("payload", -2.0)])
    assert remote.set("gap", 0.2).successful
    assert remote.change(Transition.TRANSITION_CLEANUP)
    assert remote.set("imu_sigma", 0.05).successful


def test_transitions_by_service(idle: Any, remote: Any) -> None:
    """Those that the state lacks are refused, as where two who manage the node both activate it; rclpy raises then."""
    for transition in (Transition.TRANSITION_ACTIVATE, 99, 0, Transition.TRANSITION_CLEANUP):
        assert not remote.change(transition)
    for transition, state in [
        (Transition.TRANSITION_CONFIGURE, "inactive"),
        (Transition.TRANSITION_ACTIVATE, "active"),
        (Transition.TRANSITION_DEACTIVATE, "inactive"),
        (Transition.TRANSITION_ACTIVATE, "active"),
    ]:
        assert remote.change(transition), idle.said()
        assert remote.state() == state
    assert not any(remote.change(Transition.TRANSITION_ACTIVATE) for _ in range(3))
    assert remote.state() == "active" and "single-threaded" not in idle.said()
    assert idle.said().count("transition 3 refused in state active: ") == 1
    assert "listening to /rig/strokes, /joint_angles, /tip_imu" in idle.said()
    assert remote.change(Transition.TRANSITION_ACTIVE_SHUTDOWN) and idle.end() == 0


def is_caught(process: Any, number: signal.Signals) -> bool:
    """Whether the program has its own handler for a signal by now."""
    status = Path(f"/proc/{process.pid}/status").read_text()
    mask = int(next(line for line in status.splitlines() if line.startswith("SigCgt:")).split()[1], 16)
    return bool(mask >> (number - 1) & 1)


ACTIVE, PREPARING = "active;", "preparing the model"
CLOSED = pytest.mark.skipif(signal.getsignal(signal.SIGHUP) is signal.SIG_IGN, reason="nohup: a closed terminal ends nothing")


@pytest.mark.parametrize(("moment", "number"), [("", signal.SIGINT), pytest.param(ACTIVE, signal.SIGHUP, marks=CLOSED)])
def test_signals_end_the_node_in_order_at_any_time(spawn_node: Callable[..., Any], number: signal.Signals, moment: str) -> None:
    node = spawn_node()
    node.wait_for(moment)
    while not is_caught(node, signal.SIGTERM):
        time.sleep(0.01)
    assert node.stop(number) == 0, node.said()
    assert "stopping" in node.said() or moment != ACTIVE
    assert "Traceback" not in node.said() and "FATAL" not in node.said()


def test_a_node_that_compiles_answers_and_ends(
    spawn_node: Callable[..., Any], new_rig: Callable[..., Rig], remote: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    rig = new_rig()
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))  # so that the node compiles
    node = spawn_node()
    rig.until(lambda: rig.words("model") == PREPARING)
    assert remote.state() == "active" and remote.set("payload", 30.0).successful
    refused = remote.set("scene", "other.yaml")
    assert not refused.successful and "fixed while the node is configured" in refused.reason
    before = float(rig.values("model")["preparing_s"])
    rig.until(lambda: float(rig.values("model")["preparing_s"]) > before + 0.5)
    assert node.stop(signal.SIGINT) == 0 and "stopping" in node.said(), node.said()
    assert not any(word in node.said() for word in ("Traceback", "FATAL", "model ready")), node.said()
