"""Quality of service in the words of rclpy."""

from __future__ import annotations

from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy

from ..io.topics import Qos


def qos_profile(qos: Qos, depth: int | None = None) -> QoSProfile:
    """`qos` of ``topics.yaml``; with another depth, if one is given."""
    return QoSProfile(
        history=HistoryPolicy.KEEP_LAST,
        depth=depth or qos.depth,
        reliability=ReliabilityPolicy[qos.reliability.upper()],
        durability=DurabilityPolicy[qos.durability.upper()],
    )
