"""A small session, and files of it written in other ways."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from default_boom import joint_angles_of_strokes, strokes_of_posture
from fuzz.mcap_files import rewrite
from recordings import FILE_NAME, Session, read, write_session

from boom_twin import load_scene

NOTES = {"origin": "synthetic, made for a test"}
JOINT_STATE = "sensor_msgs/msg/JointState"
WANTED = {"cylinder_strokes": JOINT_STATE, "joint_angles": JOINT_STATE, "tip_imu": "sensor_msgs/msg/Imu"}
ROWS = 40


@pytest.fixture(scope="session")
def arrays() -> dict[str, Any]:
    """Stamps (ns), strokes (m), joints (rad), imu (m/s^2) of a short session of a boom with three sections."""
    random = np.random.default_rng(7)
    return {
        "stamps_ns": 1_700_000_000_000_000_000 + np.arange(ROWS) * 5_000_000 + random.integers(-200_000, 200_000, ROWS),
        "strokes": random.uniform(0.0, 0.5, (ROWS, 3)),
        "joints": random.uniform(-2.0, 1.0, (ROWS, 3)),
        "imu": random.normal((0.0, 9.81), 0.05, (ROWS, 2)),
    }


@pytest.fixture(scope="session")
def moving(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two seconds of a gentle move of the default boom. It is only read."""
    scene, path = load_scene(), tmp_path_factory.mktemp("moving") / "bag"
    time_s = np.arange(400) / 200.0
    strokes = strokes_of_posture(scene, "arch") + 0.01 * (1.0 - np.cos(3.0 * time_s))[:, None]
    joints = np.array([joint_angles_of_strokes(scene, row) for row in strokes])
    imu = np.random.default_rng(2).normal((0.0, 9.81), 0.05, (400, 2))
    stamps = 1_700_000_000_000_000_000 + np.arange(400) * 5_000_000
    write_session(path, stamps, strokes, joints, imu, NOTES)
    return path


@pytest.fixture
def bag(tmp_path: Path, arrays: dict[str, Any]) -> Path:
    write_session(tmp_path / "bag", **arrays, description=NOTES)
    return tmp_path / "bag"


@pytest.fixture
def wanted() -> dict[str, str]:
    return dict(WANTED)


@pytest.fixture
def content() -> Callable[[Session], list[tuple[Any, ...]]]:
    """All that matters of a session, as plain values that compare."""

    def values(session: Session) -> list[tuple[Any, ...]]:
        return [(name, time, *_plain(msg)) for name, time, msg in read(session, WANTED)]

    return values


def _plain(msg: Any) -> tuple[Any, ...]:
    stamp = (msg.header.stamp.sec, msg.header.stamp.nanosec, msg.header.frame_id)
    if hasattr(msg, "position"):
        return (*stamp, tuple(msg.name), tuple(msg.position), tuple(msg.velocity), tuple(msg.effort))
    force = msg.linear_acceleration
    return (*stamp, force.x, force.y, force.z, tuple(msg.linear_acceleration_covariance))


@pytest.fixture
def rewritten(tmp_path: Path) -> Callable[..., Path]:
    """Writes the messages of a bag into another .mcap file: other options, order, or names."""

    def other(bag: Path, name: str = "other.mcap", **options: Any) -> Path:
        return rewrite(bag / FILE_NAME, tmp_path / name, **options)

    return other
