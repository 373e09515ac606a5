"""External loads at the tip of the virtual rig, which no twin knows of: pump pulses and gusts of wind.

Pulses are VERTICAL, up: concrete that leaves the hanging hose pushes it back by rho Q v (2400 kg/m^3, 70 m^3/h, a pipe of
125 mm: 74 N), while what flow and pressure do at bends acts along the pipe on both ends of every section, as tension. A piston
pump turns its valve over at the end of every stroke, 0.2 to 0.6 times a second, within about 0.1 s; so a pulse is rectangular
with steep flanks. Form and magnitudes are surrogates; for pumps and booms see Cazzulani et al. 2011, Automation in
Construction 20.

Gusts are HORIZONTAL, forward and back: drag follows the speed of the wind about its mean, whose spectrum is von Karman's,
S(f) = 4 T s^2 / (1 + 70.8 (T f)^2)^(5/6), s the standard deviation, T the length scale of turbulence over the mean speed.
The mean drag is left out.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline

from ...errors import UsageError
from ...scene.pump_pulses import CHANGE_OVER, ease, pump_pulses, upward
from ...scene.schema import Scene
from ...types import Array
from .solve import TipLoad

FORM = "pump:FREQUENCY:HEIGHT[:CHANGE_OVER][@ONSET] or wind:DEVIATION[:TIME_SCALE][@ONSET]"
COARSE = 0.02  # s between points of the wind, splined; it has no part above 25 Hz
SPREAD = 4.0  # times the duration: the period of the wind's Fourier series, and the number of time scales it has at least


def _bounded(load: str, name: str, value: float, low: float, high: float, unit: str) -> None:
    if not low <= value <= high:
        raise UsageError(f"load {load}: {name} = {value:g}, must be from {low:g} to {high:g} {unit}. Write {FORM}.")


@dataclass(frozen=True, slots=True)
class PumpLoad:
    """Rectangular pulses, on for half of each period, with eased flanks; UsageError for a number out of bounds."""

    frequency: float  # Hz, of pulses
    height: float  # N
    change_over: float = CHANGE_OVER  # s, from 0 to the full height, and back
    onset: float = 0.0  # s, of the first pulse

    def __post_init__(self) -> None:
        _bounded(str(self), "frequency", self.frequency, 0.05, 2.0, "Hz")
        _bounded(str(self), "height", self.height, 1.0, 2000.0, "N")
        _bounded(str(self), "change-over", self.change_over, 0.01, round(0.5 / self.frequency, 3), "s, half a period")

    def __str__(self) -> str:
        return f"pump:{self.frequency:g}:{self.height:g}:{self.change_over:g}" + _onset(self.onset)

    def force(self, times: Array, _duration: float, _seed: Sequence[int]) -> Array:
        """Return the force (m,) in N, upward, at `times` (m,) in s."""
        return self.height * pump_pulses(times - self.onset, self.frequency, self.change_over)

    def direction(self, inclination: float) -> Array:
        """Return the unit vector (2,) in the axes of a base that is inclined so (rad): vertical, up."""
        return upward(inclination)


@dataclass(frozen=True, slots=True)
class WindLoad:
    """Gusts about the mean wind, normally distributed, of von Karman's spectrum, eased in over 1 s; see `PumpLoad`."""

    deviation: float  # N, standard deviation
    time_scale: float = 5.0  # s, length scale of the turbulence over the mean speed: 75 m at 15 m/s
    onset: float = 0.0  # s

    def __post_init__(self) -> None:
        _bounded(str(self), "deviation", self.deviation, 0.1, 500.0, "N")
        _bounded(str(self), "time scale", self.time_scale, 0.1, 60.0, "s")

    def __str__(self) -> str:
        return f"wind:{self.deviation:g}:{self.time_scale:g}" + _onset(self.onset)

    def spectrum(self, frequencies: Array) -> Array:
        """Return the one-sided power spectral density (N^2/Hz) at `frequencies` (Hz)."""
        scaled = 1.0 + 70.8 * (self.time_scale * frequencies) ** 2
        return np.asarray(4.0 * self.time_scale * self.deviation**2 / scaled ** (5.0 / 6.0))

    def force(self, times: Array, duration: float, seed: Sequence[int]) -> Array:
        """Return the force (m,) in N, forward, at `times` (m,) in s up to `duration`, by Fourier terms drawn by `seed`."""
        period = SPREAD * max(duration, SPREAD * self.time_scale)
        count = math.ceil(period / COARSE)
        lines = np.arange(1, count // 2) / (count * COARSE)
        real, imaginary = np.random.default_rng([*seed, 3]).standard_normal((2, len(lines)))
        series = np.concatenate([[0.0], np.sqrt(self.spectrum(lines) * lines[0]) * (real + 1j * imaginary) / 2.0])
        gusts = np.fft.irfft(series, count) * count
        end = math.ceil(duration / COARSE) + 1
        wind = CubicSpline(COARSE * np.arange(end + 1), gusts[: end + 1])(times)
        return np.asarray(wind * ease(times - self.onset))

    def direction(self, inclination: float) -> Array:
        """Return the unit vector (2,) in the axes of a base that is inclined so (rad): horizontal, forward."""
        return np.array([math.cos(inclination), -math.sin(inclination)])


RigLoad = PumpLoad | WindLoad
KINDS: dict[str, tuple[Callable[..., RigLoad], int, int]] = {"pump": (PumpLoad, 2, 3), "wind": (WindLoad, 1, 2)}
"""Kinds of load by the word that a load begins with: class, and least and greatest count of its numbers."""


def _onset(onset: float) -> str:
    return f"@{onset:g}" if onset else ""


def parse(text: str) -> RigLoad:
    """Parse a load that is written as `FORM` says; UsageError for another form or a number out of bounds."""
    words, _, onset = text.partition("@")
    kind, *sizes = words.split(":")
    if kind not in KINDS:
        raise UsageError(f"load {text}: {kind or 'nothing'} is no kind of load. Write {FORM}.")
    make, least, most = KINDS[kind]
    if not least <= len(sizes) <= most:
        raise UsageError(f"load {text}: {len(sizes)} numbers, must be {least} to {most}. Write {FORM}.")
    try:
        numbers, begin = [float(size) for size in sizes], float(onset or 0.0)
    except ValueError:
        raise UsageError(f"load {text}: sizes and onset must be numbers. Write {FORM}.") from None
    if not 0.0 <= begin < math.inf:
        raise UsageError(f"load {text}: onset = {begin:g} s, must be finite and at least 0. Write {FORM}.")
    return make(*numbers, onset=begin)


def check(loads: Sequence[RigLoad], duration: float) -> None:
    """Raise UsageError if a load begins after `duration` (s)."""
    for load in loads:
        if load.onset >= duration:
            raise UsageError(f"load {load}: begins at {load.onset:g} s, must be before the end at {duration:g} s.")


def tip_load(scene: Scene, loads: Sequence[RigLoad], duration: float, seed: int) -> TipLoad:
    """Return the sum of `loads` in the axes of the scene's base, up to `duration` (s); the wind is drawn by `seed`."""
    inclination = scene.base.inclination
    directed = [(load, load.direction(inclination), [seed, number]) for number, load in enumerate(loads)]

    def force(times: Array) -> Array:
        found = np.zeros((len(times), 2))
        for load, direction, drawn in directed:
            found += load.force(times, duration, drawn)[:, None] * direction
        return found

    return force
