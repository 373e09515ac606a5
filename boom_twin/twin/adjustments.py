"""Changes of a running twin: sensor zeros, residuals that give them, requests of changes, and limits."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Mapping

import numpy as np

from ..analysis.doubts import VALID_DEFLECTION
from ..config.settings import Settings
from ..deviation.predictor import BoomPredictor
from ..errors import UsageError
from ..scene.schema import Scene
from ..types import GIVE, SECOND, SENSORS, Array, Change, Stream, StrokeReading
from .blocks import CODES
from .state import COUNT, FIRST, NOISE_REACH, NONE, ZEROS, Limits, Ring, TwinState, zeros_at

SWAY = 0.5  # rad, largest deviation of an inclinometer that drives the model from its estimate, while its section vibrates


def limits_of(scene: Scene, boom: BoomPredictor, settings: Settings, absent: Collection[str], reads: StrokeReading) -> Limits:
    """Return the limits of the compiled update for the predictor `boom` of `scene` and its sensors."""
    channels = list(boom.channels.values())
    counts = np.array([len(names) for names in channels])
    far = NOISE_REACH * settings.variance(SENSORS[reads.stream]) ** 0.5
    low, high = np.zeros(boom.plan.joints), np.array([joint.cylinder.max_stroke for joint in scene.joints])
    absolute = boom.posture.absolute
    if reads is StrokeReading.ANGLE:
        far += SWAY * boom.posture.sways.any()
        low, high = np.radians([joint.range_deg for joint in scene.joints]).T
        low, high = np.where(absolute, -np.inf, low - GIVE), np.where(absolute, np.inf, high + GIVE)
        counts[CODES[Stream.STROKES]] = 0
    return Limits(
        gap=round(settings.gap * SECOND),
        drive=CODES[reads.stream],
        far=far,
        rate=settings.rate(reads),
        shortest=low - far,
        longest=high + far,
        turns=absolute & (reads is StrokeReading.ANGLE),
        valid=VALID_DEFLECTION * scene.reach,
        gravity=np.array(boom.plan.tables.gravity),
        absolute=absolute,
        absent=np.array([name in absent for names in channels[1:] for name in names]),
        first=np.concatenate([[0], np.cumsum(counts[1:]) - counts[1:]]),
        channels=counts,
    )


class SensorZeros:
    """Zeros of all sensors, each valid from a stamp on; `values` are the newest ones by channel (m, rad, m/s^2, N).

    `state` keeps them. A sample has the zeros that are valid at its stamp.
    """

    def __init__(self, state: TwinState, channels: Mapping[Stream, tuple[str, ...]], drive: Stream) -> None:
        self._state, self._channels, self._drive = state, channels, drive
        self.values: dict[str, float] = {}

    def put(self, stamp: int, values: Mapping[str, float]) -> bool:
        """Set the zeros that hold from `stamp` (ns) on; return True if zeros of the driving sensors change.

        Samples with earlier stamps keep the zeros that held then.
        """
        before, self.values, state = self.values, dict(values), self._state
        if state.zero_sets[0] == ZEROS:
            state.zeros[:-1], state.zeros_since[:-1] = state.zeros[1:].copy(), state.zeros_since[1:].copy()
            state.zeros_since[0] = NONE
            state.zero_sets[0] -= 1
        at = int(state.zero_sets[0])
        state.zeros_since[at] = stamp
        for row, names in zip(state.zeros[at], self._channels.values(), strict=True):
            row[: len(names)] = [self.values.get(name, 0.0) for name in names]
        state.zero_sets[0] += 1
        return any(before.get(name) != values.get(name) for name in self._channels[self._drive])

    def forget_past(self) -> None:
        """Apply the newest zeros to every stamp."""
        state = self._state
        state.zeros[0], state.zeros_since[0] = state.zeros[state.zero_sets[0] - 1], NONE
        state.zero_sets[0] = 1

    def of_drive(self, stamp: int) -> Array:
        """Return the zeros of the sensors that drive the model at `stamp` (ns), m or rad, shape (n,)."""
        return self._state.zeros[zeros_at(self._state, stamp), CODES[self._drive], : len(self._channels[self._drive])]


FEWEST_RESIDUALS = 5  # least number of residuals for a mean
WHOLE = {kind.stem: kind.channels(0) for kind in SENSORS.values() if kind.ends and not (kind.beside or kind.gives)}
"""Channels of the sensors whose zeros are set together, by sensor; other sensors are set joint by joint."""


class ResidualBuffer:
    """Buffer of residuals, measured minus predicted without any zero, in the order in which they became known."""

    def __init__(self, recent: Ring, channels: Mapping[Stream, tuple[str, ...]]) -> None:
        self._recent = recent
        self._places = {name: (CODES[stream], i) for stream, names in channels.items() for i, name in enumerate(names)}

    def clear(self) -> None:
        """Discard all residuals."""
        self._recent.bounds[:] = 0

    def zeros_of(self, sensor: str, now: int, zeros: Mapping[str, float], slope: Callable[[int], float]) -> dict[str, float]:
        """Return the zeros of a sensor, by channel, estimated from the second before `now` (ns); see `Twin.rezero`.

        `zeros` are the present zeros; `slope` gives stroke over angle (m/rad) of joint i, counted from 0. UsageError if the
        sensor has too few readings in that time.
        """
        if sensor in WHOLE:
            return {name: self._mean(name, now) for name in WHOLE[sensor]}
        if self._places[sensor][0] != CODES[Stream.STROKES]:
            return {sensor: self._mean(sensor, now)}
        number = sensor.rpartition("_")[2]
        joint = f"joint_{number}"
        mean = self._mean(joint, now)
        return {sensor: zeros.get(sensor, 0.0) - (mean - zeros.get(joint, 0.0)) * slope(int(number) - 1)}

    def _mean(self, channel: str, now: int) -> float:
        own, place = self._places[channel]
        recent, count = self._recent, self._recent.bounds[COUNT]
        rows = (self._recent.bounds[FIRST] + np.arange(count)) % len(recent.stamps)
        rows = rows[(recent.streams[rows] == own) & (recent.stamps[rows] > now - SECOND)]
        values = [value for value in recent.values[rows, place].tolist() if math.isfinite(value)]
        if len(values) < FEWEST_RESIDUALS:
            told = f"{channel}: {len(values)} residuals in the last second, {FEWEST_RESIDUALS} are needed"
            raise UsageError(f"{told}. Let its sensor and the strokes run, then ask again.")
        return math.fsum(values) / len(values)


class Requests:
    """Collector of changes requested between two stroke samples; `due` is True if a change waits.

    `settings` and `zeros` are the new values. `from_rest` requests a restart from static equilibrium, and `is_new` a twin
    without knowledge of earlier samples.
    """

    def __init__(self, settings: Settings) -> None:
        self.settings = settings
        self.zeros: dict[str, float] = {}
        self.from_rest = self.is_new = self.due = False

    def tune(self, live: Mapping[str, float]) -> None:
        """Request new live settings; UsageError if a value is out of bounds or cannot change while the twin runs."""
        self.settings, self.due = self.settings.tuned(live), True

    def zero(self, values: Mapping[str, float]) -> None:
        """Request new zeros of some sensors."""
        self.zeros, self.due = {**self.zeros, **values}, True

    def rest(self) -> None:
        """Request a restart from static equilibrium."""
        self.from_rest = self.due = True

    def repeat(self, change: Change) -> None:
        """Request every change that another twin made with the sample of that stamp; UsageError as for `tune`."""
        self.tune(change.settings)
        self.zeros, self.from_rest, self.is_new, self.due = change.zeros, change.from_rest, change.is_new, True

    def take(self) -> bool:
        """Clear all requests; return True if a restart from static equilibrium was requested."""
        from_rest, self.from_rest, self.is_new, self.due = self.from_rest, False, False, False
        return from_rest
