"""Check of the readings of a stream, block by block: stuck, noise, spikes, jumps, dropout, range; means and motion."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..scene.schema import Scene
from ..types import GIVE, Array, Mount, Stream, channels_of
from .blocks import MeasuredRows
from .sensor_findings import NOISY as IS_NOISY
from .sensor_findings import OUTSIDE, SILENT, SPIKES, STUCK, find
from .sensor_survey import BEFORE, LATELY, NOISY, NOISY_WINDOW, SILENT_FOR, CheckWork, SlowMeans, summarise, survey

Flags = NDArray[np.bool_]

JERK = 3.0  # m/s^3 of a cylinder in haste, which is no noise of its sensor: 0.2 m in 1.6 s
NOISE_OVER = "noise_over_"  # and the name of a setting: how its figures are called
MISSTATED = 1.5  # times the noise that is stated, from which on what is usual is worth a warning
WINDOW = 2.0  # s, time constant of the slow means
CAME_BACK = 0.3  # remaining share of the change of a sensor's zero, or of its jump, below which that has ended
ENOUGH = 0.6  # weight of slow means that are judged: after 1.8 s


def sensor_ranges(scene: Scene, mounts: Sequence[Mount | None]) -> dict[Stream, tuple[Array, Array]]:
    """Return the lowest and highest values (SI, shape (channels,) each) that the sensors of every stream can measure.

    Strokes are from 0 to ``max_stroke``, angles as in ``range_deg`` and `GIVE` beyond. Others are unbounded, and so are
    inclinometers, the joints with a mount.
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


class SensorFindings(NamedTuple):
    """Findings in one block, shape (channels,) each.

    flags : findings by kind of alarm; empty if there are none. jumped : steps of jumps. level : newest readings minus expected
    readings.
    """

    flags: Mapping[str, Flags]
    jumped: Array
    level: Array


class StreamReadings(NamedTuple):
    """A block of k readings.

    means : (4, channels) means of readings with a prediction, of these predictions, of the variance of their difference, and of
    all readings; NaN without readings. is_bent : True if trusted sensors show a motion that is fast against their rate. Noise
    gives the same variance by second and by third differences; motion gives much less by third differences.
    """

    rows: MeasuredRows
    means: Array
    slow: SlowMeans
    is_bent: bool


Readings = Mapping[Stream, StreamReadings]


class SensorCheck:
    """Check of the readings of one stream, block by block.

    Parameters
    ----------
    sigma, resolution : float
        Standard deviation of the noise and step of the rounding, in the unit of the sensors.
    low, high : ndarray, shape (channels,)
        Range of the sensors.
    fastest : float
        Largest rate of the quantity, per s. A faster change is a jump of the sensor. 0: the noise alone decides about jumps.
    """

    def __init__(self, sigma: float, resolution: float, low: Array, high: Array, fastest: float) -> None:
        self._sigma = math.sqrt(sigma**2 + resolution**2 / 12.0)
        self._fastest = fastest
        count, margin, stated2 = len(low), 5.0 * self._sigma, self._sigma**2
        self.slow, unknown = SlowMeans(*np.zeros((5, count))), np.full((4, count), np.nan)
        self._known = CheckWork(
            stated=stated2,
            sigma=sigma,
            steps=np.full(count, math.inf),
            resolution=resolution,
            lately=np.array([(math.inf, stated2, stated2)], LATELY),
            low=low - margin,
            high=high + margin,
            heard=np.full(count, np.nan),
            power=np.full(count, np.nan),
            run=np.zeros(count, dtype=np.int64),
            since=np.zeros(count),
            missing=np.zeros(count),
            outside=np.zeros(count),
            means=unknown.copy(),
            slow=self.slow,
        )
        self._newest = np.zeros(BEFORE), *np.full((2, BEFORE, count), np.nan)  # stamps (s), readings, residuals
        self._calm = SensorFindings({}, np.zeros(count), np.full(count, np.nan))
        self._nothing = StreamReadings(MeasuredRows(np.empty(0, np.int64), *np.empty((3, 0, count))), unknown, self.slow, False)

    @property
    def noise(self) -> float:
        """Present noise of most channels, in multiples of the stated noise."""
        return math.sqrt(self._known.lately["lasting"][0]) / self._sigma

    def summary(self, rows: MeasuredRows | None, masked: NDArray[np.bool_], span: float) -> StreamReadings:
        """Return the numbers of a block, and take it into the slow means.

        `rows` has NaN for a missing reading or prediction. Slow means of `masked` channels (channels,) restart. `span` is the
        length (s) of the block for the slow means; 0 leaves it out.
        """
        if rows is None or not len(rows.stamps):
            return self._nothing
        columns = map(np.ascontiguousarray, rows)
        is_bent = summarise(self._known, *columns, masked, min(1.0, span / WINDOW))
        return StreamReadings(rows, self._known.means.copy(), self.slow, bool(is_bent))

    def look(self, stamps: Array, raw: Array, expected: Array, now: float) -> SensorFindings:
        """Return the findings in a block that ends at `now` (s): stamps (k,) in s, readings and expected ones (k, channels).

        A reading that is missing is NaN.
        """
        if not len(stamps):
            silent = now - self._known.heard > SILENT_FOR
            return self._calm._replace(flags={"dropout": silent}) if silent.any() else self._calm
        pairs = zip(self._newest, (stamps, raw, raw - expected), strict=True)
        times, raw, left = rows = tuple(np.ascontiguousarray(np.concatenate(pair)) for pair in pairs)
        self._newest = tuple(each[-BEFORE:] for each in rows)
        known, largest = self._known, survey(self._known, *rows)
        interval = (times[-1] - times[BEFORE - 1]) / len(stamps)
        is_motion = self._fastest > 0.0 and JERK * interval**3 > NOISY * self._sigma  # what bends readings so much
        is_known = bool(now - known.lately["first"][0] > NOISY_WINDOW and not is_motion)  # how noisy the sensors are
        flags, jumped = np.empty((5, len(known.power)), dtype=bool), np.empty(len(known.power))
        if not find(self._known, *rows, largest, now, is_known, self._fastest, np.empty_like(times), flags, jumped):
            return self._calm
        by_kind = {
            "stuck": flags[STUCK], "noise": flags[IS_NOISY], "spikes": flags[SPIKES], "jump": jumped != 0.0,
            "dropout": flags[SILENT], "range": flags[OUTSIDE],
        }  # fmt: skip
        return SensorFindings(by_kind, jumped, left[-1].copy())
