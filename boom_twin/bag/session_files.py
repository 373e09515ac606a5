"""Write a session from arrays of samples."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import UsageError
from ..messages.topic_table import FRAME, every_input
from ..messages.type_store import fill_header, new_message
from ..types import SENSORS, Array, Sample, Stream
from .writer import MessageWriter

_UNKNOWN = -1.0  # first element of a covariance: the quantity is not measured (REP-145)


def write_session(
    directory: Path,
    stamps_ns: NDArray[np.int64],
    strokes: Array,
    joints: Array | None,
    imu: Array | None,
    description: Mapping[str, str],
    angle_stamps_ns: NDArray[np.int64] | None = None,
    forces: Array | None = None,
    placed: Mapping[Stream, Array] | None = None,
) -> None:
    """Write the bag of one session in the order of its stamps. Log times are the stamps.

    Parameters
    ----------
    directory : Path
        New or empty folder.
    stamps_ns : ndarray of int, shape (k,)
        Stamps, ns.
    strokes : ndarray, shape (k, n)
        Strokes, m.
    joints : ndarray, shape (k, n), optional
        Joint angles, rad.
    imu : ndarray, shape (k, 2), optional
        Specific force along x and z of the tip, m/s^2.
    description : dict of str to str
        Notes of the bag. Describe the session, and state if it is synthetic.
    angle_stamps_ns : ndarray of int, shape (k,), optional
        Stamps of the joint angles, if other than the strokes'.
    forces : ndarray, shape (k, n), optional
        Cylinder forces, N, positive in tension.
    placed : dict of Stream to ndarray, shape (k, channels), optional
        Readings of further sensors.

    Raises
    ------
    UsageError
        If the shapes do not agree.
    BagError
        If `directory` holds anything.
    """
    values = {Stream.STROKES: strokes, Stream.ANGLES: joints, Stream.IMU: imu, Stream.FORCES: forces}
    values |= placed or {}
    there = {stream: rows for stream, rows in values.items() if rows is not None}
    _check_shapes(len(stamps_ns), strokes.shape[-1], there)
    write_samples(directory, samples_of(stamps_ns, there, angle_stamps_ns), there, description)


def write_samples(
    directory: Path, samples: Iterable[Sample], streams: Iterable[Stream], description: Mapping[str, str]
) -> None:
    """Write the bag of one session from ordered `samples`, with the topics of `streams`. Else as `write_session`.

    Readings that come beside others, those of a gyro, are in the messages with the same stamp.
    """
    samples, inputs = list(samples), every_input()
    beside = {
        (SENSORS[sample.stream].beside, sample.stamp): sample.values for sample in samples if SENSORS[sample.stream].beside
    }
    topics = {stream.value: inputs[stream] for stream in streams if not SENSORS[stream].beside}
    with MessageWriter(directory, topics, description) as bag:
        for sample in samples:
            if sample.stream.value in topics:
                bag.write(
                    sample.stream.value, sample.stamp, sensor_message(sample, beside.get((sample.stream.value, sample.stamp)))
                )


def samples_of(
    stamps_ns: NDArray[np.int64], values: Mapping[Stream, Array], angle_stamps_ns: NDArray[np.int64] | None = None
) -> list[Sample]:
    """Return the samples of a session by stamp, from rows of readings; at equal stamps in the order of `values`.

    A row without any value gives no sample.
    """
    other = {} if angle_stamps_ns is None else {Stream.ANGLES: angle_stamps_ns}
    samples = [
        Sample(stream, stamp, row)
        for stream, rows in values.items()
        for stamp, row in zip(other.get(stream, stamps_ns).tolist(), rows, strict=True)
        if not np.isnan(row).all()
    ]
    return sorted(samples, key=lambda sample: sample.stamp)


def sensor_message(sample: Sample, rate: Array | None = None) -> Any:
    """Return the message that a rig's sensor sends. An Imu has the acceleration in the plane, and the `rate` (1,) if given."""
    kind = SENSORS[sample.stream]
    msg = new_message(kind.message)
    if not kind.is_named:
        fill_header(msg.header, sample.stamp, kind.stem.removesuffix("_imu"))
        if kind.field == "point":
            msg.point.x, msg.point.z = map(float, sample.values)
            return msg
        msg.orientation.w = 1.0
        msg.orientation_covariance[0] = msg.angular_velocity_covariance[0] = _UNKNOWN
        if kind.beside:
            rate, msg.linear_acceleration_covariance[0] = sample.values, _UNKNOWN
        else:
            msg.linear_acceleration.x, msg.linear_acceleration.z = map(float, sample.values)
        if rate is not None:
            msg.angular_velocity.y, msg.angular_velocity_covariance[0] = -float(rate[0]), 0.0
        return msg
    fill_header(msg.header, sample.stamp, FRAME)
    joints = len(sample.values) // (len(kind.ends) or 1)
    msg.name = [*kind.channels(joints)] if kind.gives else [f"{kind.named}_{end}" for end in kind.ends or range(1, 1 + joints)]
    setattr(msg, kind.field, np.array(sample.values, dtype=float))
    return msg


def _check_shapes(rows: int, joints: int, values: Mapping[Stream, Array]) -> None:
    for stream, kind in SENSORS.items():
        shape = rows, len(kind.channels(joints))
        if stream in values and values[stream].shape != shape:
            found = f"{kind.title}: shape {values[stream].shape}, not {shape}"
            raise UsageError(f"{found}. Give one row for each of {rows} stamps.")
