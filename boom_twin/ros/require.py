"""Whether rclpy is there, told before anything here is imported that needs it."""

from __future__ import annotations

from importlib.util import find_spec

from ..errors import UsageError


def require_rclpy() -> None:
    """Raise UsageError, with the remedy, where rclpy is not installed."""
    if find_spec("rclpy") is None:
        raise UsageError(
            'rclpy is not installed, and this needs ROS 2. Run `pip install "boom_twin[ros]"`, '
            "or source the setup file of a ROS 2 Jazzy installation."
        )
