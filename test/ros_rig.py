"""A rig beside a live node: it sends what sensors read, and listens to what the node makes of it."""

from __future__ import annotations

import time
from array import array
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PointStamped
from recordings import read, scan
from ros_messages import TYPES, Output, Topics, jazzy, stamp_of
from sensor_msgs.msg import Imu, JointState

from boom_twin import load_scene, statics

PATIENCE = 240.0  # s
PERIOD = 5_000_000  # ns


def joint_state(stamp: int, names: Sequence[str] | str, values: Sequence[float]) -> Any:
    """A JointState; `names` may be the kind of all: ``cylinder`` for cylinder_1, .."""
    names = [f"{names}_{i + 1}" for i in range(len(values))] if isinstance(names, str) else list(names)
    message = JointState(name=names, position=array("d", values))
    message.header.stamp.sec, message.header.stamp.nanosec = divmod(int(stamp), 10**9)
    return message


class Rig:
    """A boom at rest in a posture whose sensors are sent to a node, and who listens to it. Its time goes on with its samples.

    `stamp` (ns) of the newest one. `answers`: stamps of the tip's predictions and their distance (m) from the equilibrium.
    `residuals`: the largest of each message.
    """

    def __init__(self, namespace: str = "", posture: str = "arch") -> None:
        rest = statics(load_scene(), posture=posture, modes=0)
        self.strokes, self.tip, self.joints = rest.lengths, rest.tip, rest.joints
        self.node, self.namespace = rclpy.create_node("rig", namespace=namespace), namespace
        self.stamp = 1_600_000_000 * 10**9
        self.answers: list[tuple[int, float]] = []
        self.residuals: list[float] = []
        self.diagnostics: list[Any] = []
        kinds = {"cylinder_strokes": JointState, "joint_angles": JointState, "tip_imu": Imu}
        self.publishers = {name: self.node.create_publisher(kind, name, 1000) for name, kind in kinds.items()}
        self.node.create_subscription(PointStamped, "boom_twin/tip/position", self._hear, 1000)
        self.node.create_subscription(JointState, "boom_twin/residuals", self._hear_residual, 1000)
        self.node.create_subscription(DiagnosticArray, "/diagnostics", self.diagnostics.append, 100)

    def _hear(self, msg: Any) -> None:
        self.answers.append((stamp_of(msg), float(np.hypot(msg.point.x - self.tip[0], msg.point.z - self.tip[1]))))

    def _hear_residual(self, msg: Any) -> None:
        self.residuals.append(max(map(abs, msg.position)))

    def send(self) -> None:
        """Send the strokes and angles of the next instant."""
        self.stamp += PERIOD
        for topic, kind, values in (("cylinder_strokes", "cylinder", self.strokes), ("joint_angles", "joint", self.joints)):
            if topic in self.publishers:
                self.publishers[topic].publish(joint_state(self.stamp, kind, values))

    def until(self, condition: Callable[[], bool], act: Callable[[], None] = lambda: None) -> None:
        """Listen until it holds; `act` between messages."""
        end = time.monotonic() + PATIENCE
        while not condition():
            assert time.monotonic() < end, {name: status.message for name, status in self.statuses().items()}
            act()
            for _ in range(4):  # messages come faster than they are sent
                rclpy.spin_once(self.node, timeout_sec=0.005)

    def until_right(self, count: int = 50) -> None:
        """Send until so many samples from now on are answered, the newest ten of them rightly."""
        before = len(self.answers)
        self.until(lambda: len(self.answers) >= before + count, self.send)
        self.until(lambda: self.answers[-1][0] == self.stamp)
        self.answers.clear()
        self.residuals.clear()
        for _ in range(10):
            self.send()
        self.until(lambda: len(self.answers) >= 10 and len(self.residuals) >= 20)  # of strokes and of angles
        assert self.answers[-1][0] == self.stamp
        assert max(miss for _, miss in self.answers) < 1e-3 and max(self.residuals) < 1e-3

    def statuses(self) -> dict[str, Any]:
        """The newest diagnostics of the node, by their names after its own."""
        prefix = f"{self.namespace.lstrip('/')}/boom_twin: ".lstrip("/")
        newest = next((msg for msg in reversed(self.diagnostics) if msg.status[0].name.startswith(prefix)), None)
        return {} if newest is None else {status.name.removeprefix(prefix): status for status in newest.status}

    def level(self, name: str) -> int:
        """That of a status, -1 as long as there is none."""
        found = self.statuses().get(name)
        return -1 if found is None else int.from_bytes(found.level, "little")

    def words(self, name: str) -> str:
        """The message of a status that is not well, else empty."""
        return self.statuses()[name].message if self.level(name) > 0 else ""

    def values(self, name: str) -> dict[str, str]:
        found = self.statuses().get(name)
        return {} if found is None else {pair.key: pair.value for pair in found.values}

    def close(self) -> None:
        self.node.destroy_node()


def spin_until(node: Any, condition: Callable[[], bool]) -> None:
    end = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < end
        rclpy.spin_once(node, timeout_sec=0.05)


def published(path: Path, topics: Topics, key: Output) -> list[tuple[int, bytes]]:
    """Stamp and CDR of every message of one output; encoded anew, because rclpy does not clear the bytes between values."""
    found = [msg for _, _, msg in read(scan(path), {topics.outputs[key].absolute: TYPES[key]})]
    holders = [msg.markers[0] if key is Output.SHAPE else msg for msg in found]
    return [(stamp_of(each), bytes(jazzy().serialize_cdr(msg, TYPES[key]))) for each, msg in zip(holders, found, strict=True)]


def all_stored(node: Any, namespace: str = "") -> None:
    """Wait until a recorder, by its own words on /diagnostics, has got nothing more but diagnostics for some seconds."""
    name, heard = f"{namespace}/boom_twin_recorder: recording".lstrip("/"), list[dict[str, str]]()

    def hear(msg: Any) -> None:
        for status in msg.status:
            if status.name == name:
                values = {pair.key: pair.value for pair in status.values if pair.key.startswith("received ")}
                heard.append({key: value for key, value in values.items() if not key.endswith("/diagnostics")})

    subscription = node.create_subscription(DiagnosticArray, "/diagnostics", hear, 100)
    spin_until(node, lambda: len(heard) >= 4 and heard[-1] == heard[-4])
    node.destroy_subscription(subscription)
