"""Excitation of the virtual rig: programmes of its cylinders, hand-made and random, and loads at the tip unknown to the twin.

Pump pulses are VERTICAL, up: concrete that leaves the hanging hose pushes it back by rho Q v (2400 kg/m^3, 70 m^3/h, a pipe of
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
from itertools import pairwise

import numpy as np
from scipy.interpolate import CubicSpline

from ...errors import UsageError
from ...scene.kinematics import stroke_range, strokes_of_posture
from ...scene.load import load_scene
from ...scene.pump_pulses import CHANGE_OVER, ease, pump_pulses, upward
from ...scene.schema import Scene
from ...types import Array
from .solve import TipLoad
from .system import section_frames


def ease_rate(x: Array) -> Array:
    x = np.clip(x, 0.0, 1.0)
    return np.asarray(30.0 * (x * (1.0 - x)) ** 2)


@dataclass(frozen=True, slots=True)
class Move:
    """One cylinder (0-based) goes to an absolute stroke `target` (m), from `start` (s) for `duration` (s)."""

    cylinder: int
    start: float
    duration: float
    target: float

    @property
    def end(self) -> float:
        return self.start + self.duration


@dataclass(frozen=True)
class Programme:
    """Moves of all cylinders, which do not overlap for one; between them they hold.

    Strokes are twice continuously differentiable.
    """

    first: tuple[float, ...]  # strokes (m) at the start
    moves: tuple[Move, ...]  # in any order

    def __post_init__(self) -> None:
        for cylinder in range(len(self.first)):
            own = self._moves_of(cylinder)
            for before, after in pairwise(own):
                if after.start < before.end:
                    raise UsageError(
                        f"moves of cylinder_{cylinder + 1}: the one at {after.start:g} s starts before the end "
                        f"of the one before it, {before.end:g} s. Start it later."
                    )

    def __call__(self, times: Array) -> tuple[Array, Array]:
        """Return strokes (m) and rates (m/s), each (m, n), at `times` (m,) in s."""
        times = np.asarray(times, float)
        strokes = np.tile(np.array(self.first), (len(times), 1))
        rates = np.zeros_like(strokes)
        for cylinder, at in enumerate(self.first):
            for move in self._moves_of(cylinder):
                x = (times - move.start) / move.duration
                strokes[:, cylinder] += (move.target - at) * ease(x)
                rates[:, cylinder] += (move.target - at) / move.duration * ease_rate(x)
                at = move.target
        return strokes, rates

    def _moves_of(self, cylinder: int) -> list[Move]:
        return sorted((move for move in self.moves if move.cylinder == cylinder), key=lambda move: move.start)


BUNDLED_DURATION = 60.0  # seconds of the bundled session

BUNDLED_MOVES = (
    Move(0, 3.0, 1.5, 0.665),
    Move(2, 8.5, 3.0, 0.200),
    Move(3, 8.5, 3.0, 0.160),
    Move(0, 15.5, 5.0, 0.580),
    Move(1, 15.5, 4.0, 0.150),
    Move(2, 16.0, 4.5, 0.225),
    Move(3, 26.0, 1.5, 0.185),
    Move(1, 30.5, 2.5, 0.170),
    Move(0, 38.0, 6.0, 0.500),
    Move(2, 38.0, 5.0, 0.170),
    Move(3, 38.5, 5.5, 0.120),
    Move(0, 48.0, 2.5, 0.530),
    Move(1, 48.5, 2.0, 0.160),
    Move(0, 53.0, 3.0, 0.590),
    Move(2, 53.0, 3.0, 0.200),
)
"""Cylinder (0-based), start (s), duration (s), target (m): for the default scene from its posture arch."""

TIP_SPEED = 1.2  # m/s, bound of random programmes, by rigid kinematics
RANGE_SAMPLES = 91  # of a joint's range
HOLD, DURATION = (3.0, 8.0), (1.5, 6.0)  # s
FIRST_HOLD = 3.0  # s


def bundled(scene: Scene) -> Programme:
    """Return the programme of the bundled session, 60 s that end in a hold: from posture arch, or else the scene's first.

    A boom with other joints than the default scene's makes random moves. UsageError if the scene has no posture.
    """
    usual = load_scene()
    if not scene.postures:
        raise UsageError("the scene has no posture to start from. Add one under postures, as in `boom_twin scene`.")
    posture = "arch" if "arch" in scene.postures else next(iter(scene.postures))
    first = strokes_of_posture(scene, posture)
    if scene.joints == usual.joints and scene.base == usual.base and scene.postures[posture] == usual.postures["arch"]:
        return Programme(tuple(first.tolist()), BUNDLED_MOVES)
    return random_programme(scene, posture, BUNDLED_DURATION, 0)


def random_programme(
    scene: Scene,
    posture: str,
    duration: float,
    seed: int,
    holds: tuple[float, float] = HOLD,
    spans: tuple[float, float] = DURATION,
) -> Programme:
    """Draw moves from `posture` of one to three cylinders at once, in range and slower than `TIP_SPEED` at the tip.

    There are holds between, and one after the last move, within `duration` (s). Bounds of their times are `holds` and of those
    of moves `spans`, s.
    """
    rng = np.random.default_rng(seed)
    first = strokes_of_posture(scene, posture)
    now, time, moves = first.copy(), FIRST_HOLD, list[Move]()
    while True:
        span = rng.uniform(*spans)
        if time + span + holds[0] > duration:
            return Programme(tuple(first.tolist()), tuple(moves))
        count = int(rng.integers(1, 1 + min(3, len(now))))
        aim = _reachable(scene, now, rng.choice(len(now), count, replace=False).tolist(), span, rng)
        moves += [Move(int(i), time, span, float(aim[i])) for i in np.flatnonzero(aim != now)]
        now, time = aim, time + span + rng.uniform(*holds)


def through_postures(scene: Scene, postures: Sequence[str], duration: float, acceleration: float) -> Programme:
    """Return moves of all cylinders at once from posture to posture, with rest periods of one length in each.

    The undeformed boom's tip accelerates by at most `acceleration` (m/s^2). A single posture gives a boom that stands still.
    UsageError if moves and rest periods take longer than `duration` (s).
    """
    if unknown := [posture for posture in postures if posture not in scene.postures]:
        raise UsageError(f"--through: {unknown[0]!r} is no posture of the scene. Give names, of {', '.join(scene.postures)}.")
    stops = [strokes_of_posture(scene, posture) for posture in postures]
    spans = [_span(scene, one, other, acceleration) for one, other in pairwise(stops)]
    rest = (duration - sum(spans)) / len(stops)
    if rest < FIRST_HOLD:
        needed = sum(spans) + FIRST_HOLD * len(stops)
        raise UsageError(
            f"duration = {duration:g} s: moves and rest periods of {FIRST_HOLD:g} s take {needed:.0f} s. Give that."
        )
    moves, time = list[Move](), rest
    for span, before, target in zip(spans, stops, stops[1:], strict=False):
        moves += [Move(int(i), time, span, float(target[i])) for i in np.flatnonzero(target != before)]
        time += span + rest
    return Programme(tuple(stops[0].tolist()), tuple(moves))


def _span(scene: Scene, first: Array, target: Array, acceleration: float) -> float:
    """Return the seconds that a move takes whose tip accelerates by `acceleration` (m/s^2) at most."""
    times = np.linspace(0.0, 1.0, 201)
    moves = tuple(Move(i, 0.0, 1.0, float(stroke)) for i, stroke in enumerate(target) if stroke != first[i])
    path = _tip_path(scene, Programme(tuple(first.tolist()), moves), times)
    largest = float(np.hypot(*np.diff(path, 2, axis=0).T).max()) / times[1] ** 2
    return math.sqrt(largest / acceleration)


def _tip_path(scene: Scene, programme: Programme, times: Array) -> Array:
    """Return the places (m, 2) of the undeformed boom's tip, m."""
    end = (scene.sections[-1].length, 0.0)
    return np.array([section_frames(scene, strokes)[-1].point(end) for strokes in programme(times)[0]])


def tip_speed(scene: Scene, programme: Programme, times: Array) -> Array:
    """Return the speed of the undeformed boom's tip (m/s) between successive `times` (m,), shape (m - 1,)."""
    return np.asarray(np.hypot(*np.diff(_tip_path(scene, programme, times), axis=0).T) / np.diff(times))


def _reachable(scene: Scene, now: Array, cylinders: list[int], span: float, rng: np.random.Generator) -> Array:
    """Draw targets of some cylinders, and draw them nearer until the tip is slow enough."""
    aim = now.copy()
    for i in cylinders:
        low, high = stroke_range(scene, i, RANGE_SAMPLES)
        if low >= high:
            raise UsageError(f"cylinder_{i + 1}: no stroke is within both max_stroke and range_deg. Widen one.")
        free = 0.08 * (high - low)  # kept free at both ends
        aim[i] = rng.uniform(low + free, high - free)
    while True:
        trial = Programme(tuple(now.tolist()), tuple(Move(i, 0.0, span, float(aim[i])) for i in cylinders))
        fastest = float(tip_speed(scene, trial, np.linspace(0.0, span, 21)).max())
        if fastest <= TIP_SPEED:
            return aim
        aim = now + 0.95 * min(1.0, TIP_SPEED / fastest) * (aim - now)


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


def parse_load(text: str) -> RigLoad:
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


def check_loads(loads: Sequence[RigLoad], duration: float) -> None:
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
