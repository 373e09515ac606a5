"""Check the readings of single sensors, block by block: stuck, noisy, spikes, jumps, silence, readings out of range."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..kernels.jit import SameTypes, hold
from ..scene.schema import Scene
from ..types import Array, Mount, Stream, channels_of
from .sensor_survey import FIRST, LASTING, NOISE, ROOM, CheckWork, survey


def readings_of_frozen(sigma: float, resolution: float, false_alarm: float) -> float:
    """Equal readings in a row that white noise gives with a probability below `false_alarm`.

    Noise of standard deviation s, read out in steps of q, repeats a reading with a probability of at most

        p = erf(q / (2 sqrt(2) s)),

    reached by a sensor that stands still in the middle of a step; N equal readings have p^(N - 1). A sensor that is coarse
    against its noise needs many (q = 7 s: 4e4; q = 10 s: 4e7, for a probability of 1e-9); one without noise cannot be told
    from a frozen one.

    Parameters
    ----------
    sigma, resolution : float
        Of the sensor, in its unit; the rule is as good as these. A sensor that is filtered repeats more often.
    false_alarm : float
        Probability for each reading.

    Returns
    -------
    float
        N >= 2; infinite without noise.
    """
    if sigma == 0.0:
        return math.inf
    missed = math.erfc(resolution / (2.0 * math.sqrt(2.0) * sigma))
    if missed == 0.0:
        return math.inf
    return 2.0 if missed == 1.0 else max(2.0, 1.0 + math.ceil(math.log(false_alarm) / math.log1p(-missed)))


Flags = NDArray[np.bool_]

GIVE = math.radians(5.0)
"""What an encoder may read beyond ``range_deg``, which is of the rigid boom: at its end a joint sags and swings on."""
SPIKE = 8.0  # deviations of the noise by which a reading leaves both of its neighbours
JUMP = 10.0  # likewise, by which readings change at once and for good
NOISY, NOISY_WINDOW = 2.5, 1.0  # times the noise that is usual in its stream; time (s) over which it is taken
SWIFT = 0.1  # m/s^2, acceleration of a cylinder that is no noise of its sensor
USUAL_WINDOW = 10.0  # s over which the noise that is usual is told
NOISE_OVER = "noise_over_"  # and the name of a setting: how its figures are called
MISSTATED = 1.5  # times the noise that is stated, from which on what is usual is worth a warning
QUIET = 0.3  # of the noise that is stated: a channel with less gives clean readings, whose repetition means nothing
REPEATS_FOR = 0.4  # s, at least, of one reading again and again
REPEATS = (3, 1_000_000)  # times, at least and at most, that a reading has to repeat
FALSE_ALARM = 1e-12  # probability, for each reading, that a live sensor repeats for so long
SILENT_FOR = 0.5  # s; readings that lie farther apart are no neighbours: neither jumps nor spikes show across such a gap
MISSING = 0.1  # share of the readings
ENOUGH, MEDIAN2 = 6, 0.4549  # second differences whose median tells noise; that of the square of a standard normal value


def sensor_ranges(scene: Scene, mounts: Sequence[Mount | None]) -> dict[Stream, tuple[Array, Array]]:
    """Lowest and highest values that the sensors of every stream can measure.

    Parameters
    ----------
    scene : Scene
        Strokes are from 0 to ``max_stroke``, angles as in ``range_deg`` and `GIVE` beyond; others have no bounds.
    mounts : sequence of Mount or None
        Of the sensor of each joint; an inclinometer (not None) has no bounds either.

    Returns
    -------
    dict of Stream to (ndarray, ndarray)
        SI, shape (channels,) each; infinite where there is no bound.
    """
    joints = scene.joints
    found = {stream: (np.full(len(c), -np.inf), np.full(len(c), np.inf)) for stream, c in channels_of(len(joints)).items()}
    found[Stream.STROKES] = np.zeros(len(joints)), np.array([joint.cylinder.max_stroke for joint in joints])
    for i, (joint, mount) in enumerate(zip(joints, mounts, strict=True)):
        if mount is None:
            low, high = map(math.radians, joint.range_deg)
            for bound, end in zip(found[Stream.ANGLES], (low - GIVE, high + GIVE), strict=True):
                bound[i] = end
    return found


@dataclass(frozen=True)
class SensorFindings:
    """By channel, in one block; shape (channels,) each: findings, steps of jumps, and how far the newest readings are off."""

    stuck: Flags
    noisy: Flags
    spikes: Flags
    jumped: Array
    silent: Flags
    outside: Flags
    level: Array
    is_calm: bool = False
    """Nothing was found in any channel; `level` is not told then."""

    def by_kind(self) -> dict[str, Flags]:
        """In the words of alarms."""
        return {
            "stuck": self.stuck, "noise": self.noisy, "spikes": self.spikes, "jump": self.jumped != 0.0,
            "dropout": self.silent, "range": self.outside,
        }  # fmt: skip


class SensorCheck:
    """Looks at the readings of one stream, block by block.

    Parameters
    ----------
    sigma, resolution : float
        Noise and rounding of its sensors, in their unit.
    low, high : ndarray, shape (channels,)
        Their range.
    fastest : float
        What the quantity may change by, per s: more is a jump of the sensor. 0 where a jump is judged by the noise alone.
    """

    def __init__(self, sigma: float, resolution: float, low: Array, high: Array, fastest: float) -> None:
        self._sigma = math.sqrt(sigma**2 + resolution**2 / 12.0)
        self._fastest = fastest
        self._patience = repeats(sigma, resolution)
        count, rows = len(low), 3 + ROOM
        margin, stated2 = 5.0 * self._sigma, self._sigma**2
        limits = [
            SILENT_FOR, (4.0 * NOISY) ** 2 * stated2, stated2, NOISY_WINDOW, USUAL_WINDOW,
            SPIKE * self._sigma, NOISY**2, NOISY**2 * stated2, MISSING, self._patience,
        ]  # fmt: skip
        self._known = CheckWork(
            limits=np.array(limits, float),
            lately=np.array([math.inf, 0.0, stated2, stated2]),
            times=np.zeros(rows),
            raw=np.full((rows, count), np.nan),
            left=np.full((rows, count), np.nan),
            low=low - margin,
            high=high + margin,
            heard=np.full(count, np.nan),
            power=np.full(count, np.nan),
            run=np.zeros(count, dtype=np.int64),
            since=np.zeros(count),
            missing=np.zeros(count),
            outside=np.zeros(count),
        )
        self._held = hold(self._known)
        self._survey = SameTypes(survey)
        none, unknown = np.zeros(count, dtype=bool), np.full(count, np.nan)
        self._calm = SensorFindings(none, none, none, np.zeros(count), none, none, unknown, is_calm=True)

    @property
    def noise(self) -> float:
        """Times the noise that is stated, as it is with most channels, lately."""
        return math.sqrt(self._known.lately[LASTING]) / self._sigma

    @property
    def noise_now(self) -> float:
        """The same over `NOISY_WINDOW` where it is worth a warning; else 1."""
        times = math.sqrt(self._known.lately[NOISE]) / self._sigma
        return times if times > MISSTATED else 1.0

    def look(self, stamps: Array, raw: Array, expected: Array, now: float) -> SensorFindings:
        """Take the readings of a block.

        Parameters
        ----------
        stamps : ndarray, shape (k,)
            s.
        raw, expected : ndarray, shape (k, channels)
            As measured, NaN where not, and as the model has them.
        now : float
            End of the block, s.
        """
        rows = len(stamps)
        if not rows:
            return self._calm if self._known.lately[FIRST] == math.inf else self._nothing(raw.shape[1], now)
        self._make_room(3 + rows)
        is_calm, largest = self._survey(self._held, stamps, np.ascontiguousarray(raw), np.ascontiguousarray(expected), now)
        return self._calm if is_calm else self._findings(largest, rows, now)

    def _make_room(self, rows: int) -> None:
        """Room for so many readings, the newest three before the block among them."""
        known = self._known
        if rows > len(known.times):
            times, raw, left = (np.resize(each, (2 * rows, *each.shape[1:])) for each in (known.times, known.raw, known.left))
            self._known = known._replace(times=times, raw=raw, left=left)
            self._held = hold(self._known)

    def _findings(self, largest: float, rows: int, now: float) -> SensorFindings:
        """What is found in so many readings, whose largest step is `largest`."""
        known, count = self._known, len(self._known.power)
        times, raw, left = (column[: 3 + rows] for column in (known.times, known.raw, known.left))
        spikes, jumped = np.zeros(count, dtype=bool), np.zeros(count)
        if largest > SPIKE * self._sigma:
            steps = np.where((np.diff(times) > SILENT_FOR)[:, None], np.nan, np.diff(left, axis=0))
            noise = np.sqrt(np.fmax(np.fmax(known.power, self._sigma**2), _usual_bend2(left)))
            spikes, jumped = self._spikes(steps, noise), self._jumps(times, raw, left, steps, noise)
        interval = (times[-1] - times[2]) / rows
        is_motion = self._fastest > 0.0 and SWIFT * interval**2 > NOISY * self._sigma  # what bends readings so much
        is_known = now - known.lately[FIRST] > NOISY_WINDOW and not is_motion  # how noisy the sensors are
        loud = NOISY**2 * min(known.lately[NOISE], NOISY**2 * self._sigma**2)  # a judgement takes at most that for usual
        return SensorFindings(
            stuck=self._stuck(float(times[-1])),
            noisy=is_known & (known.power > loud),
            spikes=spikes & is_known,
            jumped=jumped,
            silent=(now - known.heard > SILENT_FOR) | (known.missing > MISSING),
            outside=known.outside > 0.5 * rows,
            level=left[-1].copy(),
        )

    def _nothing(self, count: int, now: float) -> SensorFindings:
        none, silent = np.zeros(count, dtype=bool), now - self._known.heard > SILENT_FOR
        return SensorFindings(none, none, none, np.zeros(count), silent, none, np.full(count, np.nan))

    def _spikes(self, steps: Array, noise: Array) -> Flags:
        """A reading that leaves both neighbours the same way, while these agree; `steps` from each to the next.

        The noise (channels,) is that which is measured: a sensor that has twice as much as stated gives no spikes by that.
        """
        with np.errstate(invalid="ignore"):
            out, back = steps[:-1], -steps[1:]
            lone = (np.minimum(np.abs(out), np.abs(back)) > SPIKE * noise) & (out * back > 0.0)
            lone &= np.abs(out - back) < 0.5 * np.minimum(np.abs(out), np.abs(back))
        return np.asarray(lone.any(axis=0))

    def _stuck(self, newest: float) -> Flags:
        """One reading again and again until `newest` (s), while others of the stream are alive with noise."""
        live = self._known.power > (QUIET * self._sigma) ** 2
        if len(live) < 2 or not live.any():
            return np.zeros(len(live), dtype=bool)
        return np.asarray((self._known.run >= self._patience) & (newest - self._known.since >= REPEATS_FOR))

    def _jumps(self, times: Array, raw: Array, left: Array, steps: Array, noise: Array) -> Array:
        """How far readings changed from one to the next, for good, while the model did not; 0 where they did not.

        `steps` are those of `left` from each reading to the next, NaN across a gap.
        """
        with np.errstate(invalid="ignore"):
            step, measured = steps[1:-1], raw[2:-1] - raw[1:-2]
            lasting = 0.5 * (left[2:-1] + left[3:]) - 0.5 * (left[:-3] + left[1:-2])
            least = np.maximum(JUMP * noise, self._fastest * (times[2:-1] - times[1:-2])[:, None])
            sudden = (np.abs(measured) > least) & (np.abs(step) > least) & (np.abs(lasting) > 0.7 * np.abs(step))
            calm = np.maximum(np.abs(left[3:] - left[2:-1]), np.abs(left[1:-2] - left[:-3]))
            sudden &= calm < 0.3 * np.abs(step)
        return np.where(sudden.any(axis=0), np.where(sudden, step, 0.0).sum(axis=0), 0.0)


def bends2(values: Array) -> Array:
    """Squares of second differences of neighbours, shape (k - 2, ..); their mean is the variance of white noise."""
    return np.asarray((values[2:] - 2.0 * values[1:-1] + values[:-2]) ** 2 / 6.0)


def _usual_bend2(left: Array) -> Array:
    """Variance (channels,) of the noise of readings (k, channels) by the median of their second differences.

    It does not wait for the noise to be measured, as a mean over time does, and one spike leaves it as it is.
    """
    sorted2 = np.sort(bends2(left), axis=0)  # NaN last
    known = np.isfinite(sorted2).sum(axis=0)
    middle = np.take_along_axis(sorted2, np.maximum((known - 1) // 2, 0)[None], axis=0)[0]
    return np.asarray(np.where(known >= ENOUGH, middle / MEDIAN2, 0.0))


def repeats(sigma: float, resolution: float) -> int:
    """Times that a reading repeats with a probability below `FALSE_ALARM` while the sensor lives, within `REPEATS`."""
    least, most = REPEATS
    return int(min(max(readings_of_frozen(sigma, resolution, FALSE_ALARM) - 1.0, least), most))
