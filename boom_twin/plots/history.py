"""Records that pictures are drawn from: frozen arrays, times in seconds since the first sample."""

from __future__ import annotations

from dataclasses import dataclass, field, fields

import numpy as np
from numpy.typing import NDArray

from ..types import Array


@dataclass(frozen=True)
class ImuTrace:
    """Specific force at the tip, along x and z of the tip frame.

    Attributes
    ----------
    stamps_s : ndarray, shape (j,)
    measured, predicted : ndarray, shape (j, 2)
        m/s^2, gravity included; NaN where there is none.
    """

    stamps_s: Array
    measured: Array
    predicted: Array


@dataclass(frozen=True)
class EstimateTrace:
    """Tip as all sensors see it, at the stamps of the predictions (x forward, y up); NaN before anything was measured.

    Attributes
    ----------
    displacement, acceleration, load : ndarray, shape (m, 2)
        Against a rigid boom on the same strokes, m; m/s^2; force that the model does not know, N.
    displacement_sigmas, acceleration_sigmas, load_sigmas : ndarray, shape (m, 2)
        Their standard deviations.
    """

    displacement: Array
    acceleration: Array
    load: Array
    displacement_sigmas: Array
    acceleration_sigmas: Array
    load_sigmas: Array

    @property
    def columns(self) -> tuple[Array, ...]:
        """All arrays, in the order of the fields."""
        return tuple(getattr(self, each.name) for each in fields(self))


@dataclass(frozen=True)
class Truth:
    """True motion of the rig that made a synthetic session (model frame: x forward, y up).

    Attributes
    ----------
    stamps_s : ndarray, shape (t,)
    tip_position, tip_acceleration : ndarray, shape (t, 2)
        m, m/s^2.
    """

    stamps_s: Array
    tip_position: Array
    tip_acceleration: Array


@dataclass(frozen=True)
class Orbits:
    """Motion of k pins with clearance, at m instants.

    Attributes
    ----------
    times : ndarray, shape (m,)
        s.
    names : tuple of str
    clearances : ndarray, shape (k,)
        Radial, m.
    pins : ndarray, shape (m, k, 4)
        Offset x, y of the journal (m, model axes), force (N), 1 where it touches.
    lost : ndarray of int, shape (k,)
        How often contact was lost.
    """

    times: Array
    names: tuple[str, ...]
    clearances: Array
    pins: Array
    lost: NDArray[np.int64]


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
    """Distribution of the residuals of one channel over their expected deviations.

    Attributes
    ----------
    counts : ndarray of int, shape (b,)
        Between `boom_twin.plots.session_totals.EDGES`.
    mean, deviation : float or None
        None without any.
    reach : float
        Largest residual that a picture is to show, in the unit of the channel; 0 without any.
    """

    counts: NDArray[np.int64]
    mean: float | None
    deviation: float | None
    reach: float


@dataclass(frozen=True)
class SessionTotals:
    """Statistics of all rows of a session, also of those that are not in its `History`.

    Attributes
    ----------
    residuals : dict of str to ResidualDistribution
        By channel.
    predicted, measured : tuple of Density
        Specific force at the tip along x and z; without an IMU the predicted acceleration of the tip, and nothing measured.
    """

    residuals: dict[str, ResidualDistribution]
    predicted: tuple[Density, ...]
    measured: tuple[Density, ...] | None


@dataclass(frozen=True)
class History:
    """Everything predicted in a replay of m stroke samples, and k rows of residuals of c channels; n joints.

    Of a long session, rows are left out between those that hold the extremes, see `boom_twin.plots.extreme_rows`. Then
    `totals` are given, which do not follow from the rows that are left.

    Attributes
    ----------
    stamps_s : ndarray, shape (m,)
    tip_displacement, tip_position, tip_acceleration : ndarray, shape (m, 2)
        m, m, m/s^2; x forward, y up.
    joints, cylinder_forces, strokes : ndarray, shape (m, n)
        rad; N, positive in tension; m, of the drives.
    residual_stamps_s : ndarray, shape (k,)
    residual_names : tuple of str
        ``joint_<i>`` (rad) or ``tip_imu_x``, ``tip_imu_z`` (m/s^2).
    residual_values, residual_sigmas, residual_means : ndarray, shape (k, c)
        Measured minus predicted, the deviation expected of it, the mean over a second; NaN without a sample at that stamp.
    imu : ImuTrace or None
    shapes : list of (float, ndarray of shape (p, 2))
        Deflected centre lines from the base pivot to the tip, m, and when.
    gaps : list of (float, float)
        From and to, s, where strokes were missing.
    alarms : list of AlarmSpan
        In the order of their beginning.
    moments, slow_moments : ndarray, shape (m, k)
        Bending moments (N m) at the stations of `boom_twin.analysis.bending_moments`, and their static parts.
    totals : SessionTotals or None
    estimate : EstimateTrace or None
        None where nothing but strokes was measured.
    load_text : str
        Size and main frequency of its load, in words.
    """

    stamps_s: Array
    tip_displacement: Array
    tip_position: Array
    tip_acceleration: Array
    joints: Array
    cylinder_forces: Array
    strokes: Array
    residual_stamps_s: Array
    residual_names: tuple[str, ...]
    residual_values: Array
    residual_sigmas: Array
    residual_means: Array
    imu: ImuTrace | None = None
    shapes: list[tuple[float, Array]] = field(default_factory=list)
    gaps: list[tuple[float, float]] = field(default_factory=list)
    alarms: list[AlarmSpan] = field(default_factory=list)
    moments: Array = field(default_factory=lambda: np.zeros((0, 0)))
    slow_moments: Array = field(default_factory=lambda: np.zeros((0, 0)))
    totals: SessionTotals | None = None
    estimate: EstimateTrace | None = None
    load_text: str = ""
