"""From a message of the rig to a sample in the scene's order.

Reads attributes only, so that messages of rclpy and of rosbags give the same numbers.
"""

from __future__ import annotations

from collections import Counter
from functools import lru_cache
from math import inf, isnan, nan
from typing import Any

import numpy as np

from ..records import Sample, Stream

LIMIT = 1e6
"""Largest magnitude that is taken for a reading: no stroke (m), angle (rad) or acceleration (m/s^2) comes near it."""

LATEST = 2**31 * 1_000_000_000
"""Stamps (ns) from here on have no place in a message."""

_PREFIX = {Stream.STROKES: "cylinder_", Stream.ANGLES: "joint_"}
_ABSENT = float("nan")
"""Known by identity: stands for a channel that the message does not have, unlike one that reads NaN."""


def stamp_of(msg: Any) -> int:
    """``header.stamp`` of a message in nanoseconds."""
    stamp = msg.header.stamp
    return int(stamp.sec) * 1_000_000_000 + int(stamp.nanosec)


@lru_cache(maxsize=64)
def _places(names: tuple[str, ...], prefix: str, count: int) -> tuple[int, ...]:
    """Where ``prefix1 .. prefixN`` stand in `names`, the first of equal ones; -1 for those that are not there."""
    wanted = [f"{prefix}{number}" for number in range(1, count + 1)]
    return tuple(names.index(name) if name in names else -1 for name in wanted)


class Intake:
    """Maps messages to samples and counts what is odd about them.

    Parameters
    ----------
    count : int
        Number of joints of the scene, n.

    Attributes
    ----------
    oddities : Counter
        How often each of these was met:

        ``unequal arrays``
            ``position`` shorter or longer than ``name``; the values that have a name are used.
        ``missing names``
            Some of the scene's channels are not in the message; they are NaN.
        ``unknown names only``
            None of the scene's channels is in the message; no sample.
        ``not finite``
            NaN or infinity; NaN in the sample.
        ``absurd magnitude``
            Above `LIMIT`; NaN in the sample.
        ``no measurement``
            An Imu that says by ``linear_acceleration_covariance[0] = -1`` that it has none (REP-145); no sample.
        ``no usable value``
            Nothing was left; no sample.
        ``impossible stamp``
            Before 1970, or more seconds than a message can hold; no sample.
    """

    def __init__(self, count: int) -> None:
        self._count = count
        self.oddities: Counter[str] = Counter()

    def put(self, stream: Stream, stamp_ns: int, msg: Any) -> Sample | None:
        """The sample that `msg` holds.

        Parameters
        ----------
        stream : Stream
            The role of the topic that it came by.
        stamp_ns : int
            Nanoseconds, see `stamp_of`.
        msg : sensor_msgs/JointState or sensor_msgs/Imu
            Of rclpy or of rosbags.

        Returns
        -------
        Sample or None
            None when no value of it can be used.
        """
        if not 0 <= stamp_ns < LATEST:
            self.oddities["impossible stamp"] += 1
            return None
        raw = self._force(msg) if stream is Stream.IMU else self._positions(msg, _PREFIX[stream])
        if raw is None:
            return None
        values = [value if -LIMIT <= value <= LIMIT else self._reject(value) for value in raw]
        if all(map(isnan, values)):
            self.oddities["no usable value"] += 1
            return None
        return Sample(stream, stamp_ns, np.array(values, dtype=np.float64))

    def _positions(self, msg: Any, prefix: str) -> list[float] | None:
        """Positions in the scene's order, `_ABSENT` where there is none; None if there is none at all."""
        names, positions = tuple(msg.name), msg.position
        places = _places(names, prefix, self._count)
        if len(positions) != len(names):
            self.oddities["unequal arrays"] += 1
        if -1 in places:
            if max(places) < 0:
                self.oddities["unknown names only"] += 1
                return None
            self.oddities["missing names"] += 1
        end = len(positions)
        return [float(positions[place]) if 0 <= place < end else _ABSENT for place in places]

    def _force(self, msg: Any) -> list[float] | None:
        """Specific force along x and z."""
        if msg.linear_acceleration_covariance[0] == -1.0:
            self.oddities["no measurement"] += 1
            return None
        force = msg.linear_acceleration
        return [float(force.x), float(force.z)]

    def _reject(self, value: float) -> float:
        """NaN, and a count of why; a channel that is absent has been counted before."""
        if value is not _ABSENT:
            self.oddities["absurd magnitude" if abs(value) < inf else "not finite"] += 1
        return nan
