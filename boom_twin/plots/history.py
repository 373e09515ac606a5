"""Records that pictures are drawn from: frozen arrays, times in s since the first sample, model axes (x forward, y up)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ..types import Array


@dataclass(frozen=True)
class ImuTrace:
    """Specific force at the tip, along x and z of the tip frame, m/s^2, gravity included; NaN where there is none."""

    stamps_s: Array  # (j,)
    measured: Array  # (j, 2)
    predicted: Array


@dataclass(frozen=True)
class ResidualTrace:
    """Residuals of one channel, in its unit: measured minus predicted; NaN where it has no sample. Shapes (k,)."""

    stamps_s: Array
    values: Array
    sigmas: Array  # expected deviations
    means: Array  # over a second


@dataclass(frozen=True)
class EstimateTrace:
    """Tip as all sensors see it, at the stamps of the predictions, shape (m, 2); NaN before anything was measured."""

    displacement: Array  # m, against a rigid boom on the same strokes
    acceleration: Array  # m/s^2
    load: Array  # N, force that the model does not know
    displacement_sigmas: Array  # standard deviations
    acceleration_sigmas: Array
    load_sigmas: Array


@dataclass(frozen=True)
class Truth:
    """True motion of the rig that made a synthetic session."""

    stamps_s: Array  # (t,)
    tip_position: Array  # (t, 2), m
    tip_acceleration: Array  # (t, 2), m/s^2


@dataclass(frozen=True)
class AlarmSpan:
    """Alarm: the channel where it shows, from and to (s; the end of the session while it lasts), and its cause or kind."""

    channel: str
    start: float
    stop: float
    label: str


@dataclass(frozen=True)
class Density:
    """Power spectral density: frequencies (Hz) and power, shapes (f,), from so many segments of samples `interval` s apart."""

    frequencies: Array
    power: Array
    interval: float
    segments: int


@dataclass(frozen=True)
class ResidualDistribution:
    """Distribution of the residuals of one channel over their expected deviations."""

    counts: NDArray[np.int64]  # (b,), between `boom_twin.plots.residuals.EDGES`
    mean: float | None  # None without any
    deviation: float | None
    reach: float  # largest residual that a picture is to show, in the unit of the channel; 0 without any


@dataclass(frozen=True)
class SessionDistributions:
    """Statistics of all rows of a session, also of those that are not in its `History`.

    Densities are of the specific force at the tip along x and z; without an IMU of the predicted acceleration of the tip.
    """

    residuals: dict[str, ResidualDistribution]  # by channel
    predicted: tuple[Density, ...]
    measured: tuple[Density, ...] | None


@dataclass(frozen=True)
class History:
    """Everything predicted in a replay of m stroke samples, and the residuals; n joints.

    Of a long session, rows are left out between those that hold the extremes. Then `distributions` are given, which do not
    follow from the rows that are left.
    """

    stamps_s: Array  # (m,)
    tip_displacement: Array  # (m, 2), m
    tip_position: Array  # (m, 2), m
    tip_acceleration: Array  # (m, 2), m/s^2
    joints: Array  # (m, n), rad
    cylinder_forces: Array  # (m, n), N, positive in tension
    strokes: Array  # (m, n), m, of the drives
    residuals: dict[str, ResidualTrace]  # by channel: `joint_<i>` (rad), `tip_imu_x`, .. (m/s^2)
    imu: ImuTrace | None = None
    shapes: list[tuple[float, Array]] = field(default_factory=list)  # deflected centre lines from base to tip, (p, 2), m
    gaps: list[tuple[float, float]] = field(default_factory=list)  # from and to, where strokes were missing
    alarms: list[AlarmSpan] = field(default_factory=list)  # in the order of their beginning
    moments: Array = field(default_factory=lambda: np.zeros((0, 0)))  # N m at the `boom_twin.analysis.bending_stress.stations`
    slow_moments: Array = field(default_factory=lambda: np.zeros((0, 0)))  # their static parts
    distributions: SessionDistributions | None = None
    estimate: EstimateTrace | None = None  # None where nothing but strokes was measured
    load_text: str = ""  # size and main frequency of its load, in words
    natural: Array = field(default_factory=lambda: np.zeros((0, 2)))  # (modes, 2), Hz: least and largest over the postures
    section_middles: tuple[int, ...] = ()  # points of `shapes` nearest to the middles of the sections


def extremes(bins: NDArray[np.int64], keys: Sequence[Array]) -> NDArray[np.bool_]:
    """Return True for the first rows with the least or the largest value of a key in their bin; NaN is no value.

    `bins` (k,) ascend; keys have the shape (k,) or (k, c).
    """
    starts = np.flatnonzero(np.diff(bins, prepend=-1))
    sizes = np.diff(starts, append=len(bins))
    found = np.zeros(len(bins), bool)
    for column in (column for table in keys for column in table.reshape(len(bins), -1).T):
        for extreme in (np.fmin, np.fmax):
            rows = np.flatnonzero(column == np.repeat(extreme.reduceat(column, starts), sizes))
            _, first = np.unique(bins[rows], return_index=True)
            found[rows[first]] = True
    return found
