"""Check of the readings of a stream, block by block: stuck, noise, spikes, jumps, dropout, range; means and motion."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..scene.schema import Scene
from ..types import GIVE, NANO, Array, Integers, Mount, Stream, channels_of
from .sensor_findings import HAS_FINDING, IS_BENT, collect, examine
from .sensor_survey import BEFORE, IS_NOISY, LATELY, OUTSIDE, ROWS, SILENT, SPIKES, STUCK, TAKEN, CheckWork, SlowMeans

Flags = NDArray[np.bool_]

BLOCK = 100_000_000  # ns; a block waits as long for late samples
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


class Block(NamedTuple):
    """Block of time by its number."""

    number: int

    @property
    def start(self) -> int:
        """Stamp (ns) at which it begins."""
        return self.number * BLOCK

    @property
    def end(self) -> int:
        """Stamp (ns) at which it ends."""
        return self.start + BLOCK


class SensorFindings(NamedTuple):
    """Findings in one block, shape (channels,) each.

    flags : findings by kind of alarm; empty if there are none. jumped : steps of jumps. level : newest residuals.
    """

    flags: Mapping[str, Flags]
    jumped: Array
    level: Array


class SensorCheck:
    """Check of the readings of one stream, block by block.

    Parameters
    ----------
    sigma, resolution : float
        Standard deviation of the noise and step of the rounding, in the unit of the sensors.
    low, high : ndarray, shape (channels,)
        Range of the sensors.
    fastest : float
        See `boom_twin.health.sensor_findings.examine`.

    Attributes
    ----------
    means : ndarray, shape (4, channels)
        Of the newest block: means of readings with a prediction, of these predictions, of the variance of their difference, and
        of all readings; NaN without readings. Written anew with every block.
    slow : SlowMeans
    is_bent : bool
        True if trusted sensors show a motion in the newest block that is fast against their rate. Noise gives the same variance
        by second and by third differences; motion gives much less by third differences.
    """

    def __init__(self, sigma: float, resolution: float, low: Array, high: Array, fastest: float) -> None:
        self._sigma = math.sqrt(sigma**2 + resolution**2 / 12.0)
        self._fastest, self.is_bent = fastest, False
        count, margin, stated2 = len(low), 5.0 * self._sigma, self._sigma**2
        self.slow, self.means = SlowMeans(*np.zeros((5, count))), np.full((4, count), np.nan)
        self._work = CheckWork(
            counts=np.array([BEFORE, 0]),
            stamps=np.zeros(BEFORE, dtype=np.int64),
            raw=np.full((BEFORE, count), np.nan),
            left=np.full((BEFORE, count), np.nan),
            sigmas=np.full((BEFORE, count), np.nan),
            column=np.zeros(BEFORE),
            stated=stated2,
            sigma=sigma,
            steps=np.full(count, math.inf),
            resolution=resolution,
            lately=np.array([(math.inf, stated2, stated2, False)], LATELY),
            low=low - margin,
            high=high + margin,
            heard=np.full(count, np.nan),
            power=np.full(count, np.nan),
            run=np.zeros(count, dtype=np.int64),
            since=np.zeros(count),
            missing=np.zeros(count),
            outside=np.zeros(count),
            means=self.means,
            slow=self.slow,
            flags=np.zeros((5, count), dtype=bool),
            jumped=np.zeros(count),
        )
        self._calm = SensorFindings({}, np.zeros(count), np.full(count, np.nan))

    @property
    def noise(self) -> float:
        """Present noise of most channels, in multiples of the stated noise."""
        return math.sqrt(self._work.lately["lasting"][0]) / self._sigma

    @property
    def has_readings(self) -> bool:
        """Return True if the newest block had readings."""
        return bool(self._work.counts[TAKEN])

    @property
    def newest(self) -> tuple[Array, Array]:
        """Newest readings and residuals, shape (channels,) each."""
        return self._work.raw[BEFORE - 1], self._work.left[BEFORE - 1]

    def collect(self, rows: Integers, stamps: Integers, raw: Array, left: Array, sigmas: Array, since: int = 0) -> None:
        """Keep the chosen `rows` of a table for the blocks to come, without those before `since` (ns).

        `stamps` (k,) in ns; readings, residuals, and expected standard deviations of these: (k, channels) each, or more behind.
        NaN for a missing reading or prediction.
        """
        needed, size = int(self._work.counts[ROWS]) + len(rows), len(self._work.stamps)
        if needed > size:
            old, shape = self._work, (2 * needed, self._work.raw.shape[1])
            larger = [np.resize(each, shape) for each in (old.raw, old.left, old.sigmas)]
            self._work = old._replace(
                stamps=np.resize(old.stamps, shape[0]),
                raw=larger[0],
                left=larger[1],
                sigmas=larger[2],
                column=np.zeros(shape[0]),
            )
        collect(self._work, rows, stamps, raw, left, sigmas, since)

    @property
    def first_kept(self) -> float:
        """Stamp (ns) of the earliest kept reading; infinite without one."""
        return int(self._work.stamps[BEFORE]) if self._work.counts[ROWS] > BEFORE else math.inf

    def largest_sigma(self, end: int) -> float:
        """Return the largest expected standard deviation of the kept readings before `end` (ns); there is at least one."""
        own = slice(BEFORE, int(self._work.counts[ROWS]))
        return float(self._work.sigmas[own][self._work.stamps[own] < end].max())

    def take(self, block: Block, masked: Flags, is_predicted: bool = True) -> SensorFindings:
        """Take the kept readings in a block, and drop earlier ones; return the findings.

        Slow means of `masked` channels (channels,) restart. Without `is_predicted`, residuals and slow means are left out.
        """
        share = BLOCK * NANO / WINDOW if is_predicted else 0.0
        state = examine(self._work, block.start, block.end, masked, share, is_predicted, self._fastest)
        self.is_bent = bool(state & IS_BENT)
        if not state & HAS_FINDING:
            return self._calm
        flags, jumped = self._work.flags.copy(), self._work.jumped.copy()
        by_kind = {
            "stuck": flags[STUCK], "noise": flags[IS_NOISY], "spikes": flags[SPIKES], "jump": jumped != 0.0,
            "dropout": flags[SILENT], "range": flags[OUTSIDE],
        }  # fmt: skip
        return SensorFindings(by_kind, jumped, self.newest[1].copy())


Readings = Mapping[Stream, SensorCheck]
