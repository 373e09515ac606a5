"""Steady state under a periodic load at the tip by the frequency response; swing over postures and pump rates.

The load stands for `INSTANTS` even instants of a period, of a long period as many as its harmonics up to `HIGHEST_HARMONIC`
need; every harmonic whose amplitude is above `NEGLIGIBLE` of the largest is answered by the boom linearised at rest, its mean
by the static limit, and the answers are added up in time.

A pump pulse has many harmonics, so a boom swings most where one of them meets a natural frequency, not only at that frequency
itself: with a first mode at 1.06 Hz already at 0.35 Hz, by the third harmonic.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ..errors import UsageError
from ..scene.kinematics import strokes_of_angles
from ..scene.pump_pulses import CHANGE_OVER, pump_pulses, upward
from ..scene.schema import Scene
from ..types import Array, ComplexArray
from .equilibrium import checked_strokes
from .frequency_response import LinearisedBoom, linearised_boom

INSTANTS = 2048
HIGHEST_HARMONIC = 200.0  # Hz; far above what moves a boom
NEGLIGIBLE = 1e-6


@dataclass(frozen=True)
class PeriodicLoad:
    """A force at the tip that repeats."""

    period: float  # s
    forces: Array  # (m, 2), x and y, N, at m even instants of a period, the first at its start

    @property
    def times(self) -> Array:
        """Times of the forces, s, shape (m,)."""
        return self.period * np.arange(len(self.forces)) / len(self.forces)


def pump_load(scene: Scene, frequency: float, height: float, change_over: float = CHANGE_OVER) -> PeriodicLoad:
    """Return vertical pump pulses of `frequency` (Hz) and `height` (N), on for half of a period, see `pump_pulses`.

    UsageError for a number that is not positive, or flanks that take longer than half a period.
    """
    for name, value, unit in (("rate", frequency, "Hz"), ("height", height, "N"), ("change-over", change_over, "s")):
        if not 0.0 < value < math.inf:
            raise UsageError(f"pump {name} = {value:g} {unit}: must be positive. Give three numbers like 0.4, 130 and 0.1.")
    if change_over > 0.5 / frequency:
        raise UsageError(
            f"pump change-over = {change_over:g} s: at {frequency:g} Hz it must be at most half a period, "
            f"{0.5 / frequency:g} s. Give less."
        )
    times = _instants(1.0 / frequency)
    pulses = height * pump_pulses(times, frequency, change_over)
    return PeriodicLoad(1.0 / frequency, pulses[:, None] * upward(scene.base.inclination))


def check_force_rows(rows: Array, what: str, names: Sequence[str]) -> None:
    """Raise UsageError unless times increase and forces are plausible; `rows` (m, 3) are time (s), x and y (N)."""
    largest_force = 1e7  # N; far above what any boom bears
    for row in np.flatnonzero(~(np.isfinite(rows[:, 0]) & (np.abs(rows[:, 1:]) <= largest_force).all(axis=1))):
        told = ", ".join(f"{name} = {value:g}" for name, value in zip(names, rows[row], strict=True))
        bound = f"a time must be finite, a force at most {largest_force:g} N"
        raise UsageError(f"row {row + 1} of the {what}: {told}: {bound}. Put it right.")
    for row in np.flatnonzero(np.diff(rows[:, 0]) <= 0.0):
        told = f"t_s = {rows[row + 1, 0]:.9g} s in row {row + 2} of the {what}"
        raise UsageError(f"{told}: not after row {row + 1}. Sort the rows.")


def load_of_rows(times: Array, forces: Array) -> PeriodicLoad:
    """Return a load that goes straight from row to row.

    `times` (m,), s, increase; `forces` (m, 2), N. The last row ends the period with the force of the first. UsageError
    otherwise.
    """
    if len(times) < 3:
        raise UsageError("load: give at least three rows of finite numbers t_s,fx_N,fy_N, one period of the force.")
    check_force_rows(np.column_stack([times, forces]), "load", ("t_s", "fx_N", "fy_N"))
    if not np.allclose(forces[0], forces[-1], rtol=1e-9, atol=1e-9 * float(np.abs(forces).max())):
        raise UsageError(
            f"load: begins with ({forces[0, 0]:g}, {forces[0, 1]:g}) N and ends with ({forces[-1, 0]:g}, {forces[-1, 1]:g}) N. "
            "The last row ends the period: give it the force of the first."
        )
    period = float(times[-1] - times[0])
    instants = times[0] + _instants(period)
    return PeriodicLoad(period, np.stack([np.interp(instants, times, column) for column in forces.T], axis=1))


def _instants(period: float) -> Array:
    """Even instants of a period (s), an even number of them; UsageError if it is too short or too long."""
    low, high = 0.01, 2000.0  # s: the model ends at some 100 Hz, and harmonics cost time
    if not low <= period <= high:
        raise UsageError(f"load: its period of {period:g} s must be {low:g} to {high:g} s. Give another rate.")
    count = 2 * max(INSTANTS // 2, math.ceil(HIGHEST_HARMONIC * period))
    return period * np.arange(count) / count


@dataclass(frozen=True)
class SteadyState:
    """One period of a boom's motion under a periodic load, about its equilibrium without it; n sections."""

    load: PeriodicLoad
    times: Array  # (m,), s
    tip: Array  # (m, 2), displacement from the place at rest, m
    tip_acceleration: Array  # (m, 2), m/s^2
    joints: Array  # (m, n), changes, rad
    cylinder_forces: Array  # (m, n), changes, N
    harmonics: Array  # (k,), amplitude of the tip's displacement at 1, 2, .. times the rate of the load, m

    @property
    def swing(self) -> float:
        """Peak to peak: the largest distance between two places of the tip in a period, m."""
        return swing_of(self.tip)

    def columns(self) -> dict[str, Array]:
        """All quantities by name and unit, each of shape (m,)."""
        found = {"t_s": self.times, "fx_N": self.load.forces[:, 0], "fy_N": self.load.forces[:, 1]}
        found |= {"tip_x_m": self.tip[:, 0], "tip_y_m": self.tip[:, 1]}
        found |= {f"tip_a{axis}_m_s2": column for axis, column in zip("xy", self.tip_acceleration.T, strict=True)}
        found |= {f"joint_{i + 1}_rad": column for i, column in enumerate(self.joints.T)}
        return found | {f"cylinder_force_{i + 1}_N": column for i, column in enumerate(self.cylinder_forces.T)}


def swing_of(path: Array) -> float:
    """Largest distance between two points of a `path` (m, 2): between those that lie farthest out in some direction."""
    directions = np.linspace(0.0, math.pi, 181)
    along = path @ np.stack([np.cos(directions), np.sin(directions)])
    return float(np.max(along.max(axis=0) - along.min(axis=0)))


def steady_state(scene: Scene, load: PeriodicLoad, strokes: Array | None = None, posture: str | None = None) -> SteadyState:
    """Return the motion under a periodic load when all that began with it has died away; for the rest see `statics`."""
    return steady_state_of(linearised_boom(scene, strokes, posture), load)


def steady_state_of(boom: LinearisedBoom, load: PeriodicLoad) -> SteadyState:
    """`steady_state` of a boom that is linearised already."""
    count = len(load.forces)
    series = np.fft.rfft(load.forces, axis=0)
    sizes = np.abs(series).max(axis=1)
    kept = np.flatnonzero(sizes > NEGLIGIBLE * sizes.max(initial=0.0))
    loads = np.zeros((len(kept), 2 + boom.plan.joints), complex)
    loads[:, :2] = series[kept]
    found = boom.respond(kept / load.period, loads)

    def in_time(amplitudes: ComplexArray) -> Array:
        whole = np.zeros((len(series), amplitudes.shape[1]), complex)
        whole[kept] = amplitudes
        return np.fft.irfft(whole, count, axis=0)

    harmonics = np.zeros(len(series))
    harmonics[kept] = 2.0 / count * np.linalg.norm(found.tip, axis=1)
    return SteadyState(
        load=load,
        times=load.times,
        tip=in_time(found.tip),
        tip_acceleration=in_time(found.tip_acceleration),
        joints=in_time(found.joints),
        cylinder_forces=in_time(found.cylinder_forces),
        harmonics=harmonics[1:],
    )


TOO_MUCH = 1.5  # times the median swing of a posture: such rates are to be avoided


@dataclass(frozen=True)
class RateToAvoid:
    """A band of rates at which one posture swings too much."""

    posture: str
    low: float  # Hz, lowest rate at which the swing is above `TOO_MUCH` times the posture's median
    high: float  # Hz, highest such rate
    rate: float  # Hz, of the largest swing
    swing: float  # m, the largest
    harmonic: int  # number of the harmonic of the load that moves the tip most there


@dataclass(frozen=True)
class ResonanceMap:
    """Swing of the tip, peak to peak, over p postures and r rates."""

    postures: tuple[str, ...]
    rates: Array  # (r,), rates of the load, Hz
    swing: Array  # (p, r), m
    harmonics: np.ndarray  # (p, r), number of the harmonic of the load that moves the tip most

    def to_avoid(self) -> tuple[RateToAvoid, ...]:
        """The bands to avoid, posture by posture, ascending in rate."""
        least_swing = 1e-5  # m; less is no swing, but rounding or a boom without compliance
        found = []
        for name, swing, harmonics in zip(self.postures, self.swing, self.harmonics, strict=True):
            above = np.concatenate([[False], swing > max(TOO_MUCH * float(np.median(swing)), least_swing), [False]])
            starts, stops = np.flatnonzero(above[1:] & ~above[:-1]), np.flatnonzero(above[:-1] & ~above[1:])
            for start, stop in zip(starts, stops, strict=True):
                peak = start + int(np.argmax(swing[start:stop]))
                found.append(
                    RateToAvoid(
                        name, float(self.rates[start]), float(self.rates[stop - 1]), float(self.rates[peak]),
                        float(swing[peak]), int(harmonics[peak]),
                    )
                )  # fmt: skip
        return tuple(found)


def resonance_map(
    scene: Scene, postures: Mapping[str, Array], rates: Array, load_at: Callable[[float], PeriodicLoad]
) -> ResonanceMap:
    """Return the swing of the tip in the steady state of every posture (joint angles, rad, by name) at every rate (Hz).

    UsageError for a posture out of the cylinders' travel, SolverError for one without a stable equilibrium.
    """
    loads = [load_at(float(rate)) for rate in rates]
    swing, harmonics = np.zeros((len(postures), len(rates))), np.zeros((len(postures), len(rates)), np.int64)
    for i, (name, angles) in enumerate(postures.items()):
        boom = LinearisedBoom(scene, _strokes(scene, name, angles), angles)
        for j, load in enumerate(loads):
            found = steady_state_of(boom, load)
            swing[i, j], harmonics[i, j] = found.swing, 1 + int(np.argmax(found.harmonics))
    return ResonanceMap(tuple(postures), np.asarray(rates, float), swing, harmonics)


def _strokes(scene: Scene, name: str, angles: Array) -> Array:
    try:
        return checked_strokes(scene, strokes_of_angles(scene, angles))
    except UsageError as error:
        raise UsageError(f"posture {name}: {error} Leave it out, or go another way.") from None
