"""Readings of a session by name in the blocks that a commissioning check compares, their expected values, and their lags."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..analysis.equilibrium import settle
from ..compiler.compile import compile_scene
from ..config.settings import Settings
from ..deviation.channels import READS_ACCELERATION, measurement_of
from ..deviation.posture import locate
from ..deviation.sensor_model import mounting_of
from ..errors import BoomTwinError
from ..scene.edit import with_rigid_cylinders
from ..scene.kinematics import RigidJoints, gravity_in_base
from ..scene.schema import Scene
from ..types import NANO, NO_PLACES, SENSORS, Array, Mount, Place, Stream, StrokeReading

BLOCK = 100_000_000  # ns, averaging time of readings


def is_checked(stream: Stream) -> bool:
    """Return True if a commissioning check covers the stream."""
    return stream in (Stream.STROKES, Stream.ANGLES, Stream.FORCES) or SENSORS[stream].is_accelerometer


class Series(NamedTuple):
    """Readings of one name: stamps (k,) in ns, values (k,) in the unit of its messages."""

    stamps: NDArray[np.int64]
    values: Array


Window = Mapping[Stream, Mapping[str, Series]]
"""Readings of every stream by name."""


class Table(NamedTuple):
    """Readings of one stream in the blocks that are compared."""

    names: tuple[str, ...]
    values: Array  # (blocks, names), means, NaN without readings
    spreads: Array  # their standard errors by vibration


def tables_of(window: Window) -> dict[Stream, Table]:
    """Return the readings in selected blocks with all strokes, or empty tables without such a block.

    Names without readings there are left out.
    """
    mean = 10  # blocks on each side in the mean of forces and accelerations, which removes vibration
    strokes = [_means(series) for series in window[Stream.STROKES].values()]
    common = strokes[0][0] if strokes else np.zeros(0, np.int64)
    for numbers, _ in strokes[1:]:
        common = np.intersect1d(common, numbers)
    chosen = _chosen(common, [means[np.searchsorted(numbers, common)] for numbers, means in strokes])
    found = {}
    for stream, by_name in window.items():
        reach = mean if stream is Stream.FORCES or SENSORS[stream].is_accelerometer else 0
        columns = [_at(chosen, *_means(series), reach) for series in by_name.values()]
        values, spreads = np.moveaxis(np.array(columns).reshape(len(columns), 2, len(chosen)), 0, 2)
        there = np.flatnonzero(np.isfinite(values).any(axis=0))
        names = list(by_name)
        found[stream] = Table(tuple(names[i] for i in there.tolist()), values[:, there], spreads[:, there])
    return found


def _means(series: Series) -> tuple[NDArray[np.int64], Array]:
    is_read = np.isfinite(series.values)
    numbers, places, counts = np.unique(series.stamps[is_read] // BLOCK, return_inverse=True, return_counts=True)
    return numbers, np.bincount(places, series.values[is_read], len(numbers)) / np.maximum(counts, 1)


def _chosen(common: NDArray[np.int64], strokes: list[Array]) -> NDArray[np.int64]:
    evenly = 12  # compared blocks evenly in time, besides the extremes of every stroke
    if not len(common):
        return common
    rows = set(np.linspace(0, len(common) - 1, evenly).round().astype(int).tolist())
    rows |= {int(pick(values)) for values in strokes for pick in (np.argmin, np.argmax)}
    return common[sorted(rows)]


def _at(chosen: NDArray[np.int64], numbers: NDArray[np.int64], means: Array, reach: int) -> Array:
    """Return mean and standard error (2, blocks) over `reach` blocks before and after each chosen block."""
    correlated = 5.0  # blocks with correlated vibration
    first, end = np.searchsorted(numbers, chosen - reach), np.searchsorted(numbers, chosen + reach, "right")
    middle = means.mean() if len(means) else 0.0
    sums = [np.concatenate([[0.0], np.cumsum(each)]) for each in (means - middle, (means - middle) ** 2)]
    with np.errstate(invalid="ignore", divide="ignore"):
        mean, square = ((each[end] - each[first]) / (end - first) for each in sums)
    share = np.minimum(correlated / np.maximum(end - first, 1), 1.0)
    return np.array([mean + middle, np.sqrt(np.maximum(square - mean**2, 0.0) * share)])


SPAN = 2.0  # s, span whose mean is removed, so that zeros and slow model errors are no lag
LONGEST, COARSE = 1.0, 0.05  # s, largest lag of the search; spacing of the first guesses, and largest step of Gauss-Newton
FEWEST = 2.0  # least effective number of moving spans
CLEAR = 0.4  # largest squared residual with the lag, relative to that without, both beside the expected variance
FLOOR = 1e-3  # s, standard deviation of a lag by model errors


class Lag(NamedTuple):
    """Lag of a stream and standard deviation, s. `sigma` is infinite if no lag is found.

    left : squared residual with the lag, relative to that without, both beside the expected variance. since : stamp (ns) of
    the first reading that it was found from.
    """

    lag: float
    sigma: float
    left: float = 1.0
    since: int = 0


def lag_of(stamps: NDArray[np.int64], read: Array, expected: Array, variances: Array) -> Lag:
    """Return the lag of readings behind expected ones at `stamps` (k,) in ns: near the best guess.

    Readings, expected ones, and the expected variances of their differences: (k, channels) each.
    """
    guesses, residuals = np.arange(-LONGEST, LONGEST + COARSE, COARSE), _Residuals(stamps, read, expected, variances)
    sizes = np.array([residuals.sizes(residuals.left(lag)[0]) for lag in guesses])
    return lag_near(stamps, read, expected, variances, float(guesses[int((sizes / sizes.min(axis=0)).sum(axis=1).argmin())]))


def lag_near(stamps: NDArray[np.int64], read: Array, expected: Array, variances: Array, guess: float = 0.0) -> Lag:
    """Return the lag of readings behind expected ones, as `lag_of`, by Gauss-Newton from a guess (s).

    The weight of a channel falls with its residual and its expected variance, so the stated error of the prediction is not
    taken for a lag. The scatter among spans gives the deviation.
    """
    if (stamps[-1] - stamps[0]) * NANO < FEWEST * SPAN:
        return Lag(0.0, math.inf)
    residuals, lag = _Residuals(stamps, read, expected, variances), guess
    at_zero = residuals.left(0.0)
    for _ in range(round(2.0 * LONGEST / COARSE)):
        left, slopes = at_zero if lag == 0.0 else residuals.left(lag)
        sizes = residuals.sizes(left)
        by, weight = residuals.summed(np.array([-left * slopes, slopes**2]) / sizes).sum(axis=-1)
        if not weight.sum() > 0.0 or weight.sum() ** 2 < FEWEST * (weight**2).sum():
            return Lag(0.0, math.inf)
        change = float(by.sum() / weight.sum())
        lag += min(max(change, -COARSE), COARSE)
        if abs(change) < FLOOR:
            break
    else:
        return Lag(0.0, math.inf)
    share = left.shape[1] / float((residuals.sizes(at_zero[0]) / sizes).sum())
    if abs(lag) > LONGEST or (abs(lag) > COARSE and share > CLEAR):
        return Lag(0.0, math.inf)
    scatter = math.sqrt(float(((by - change * weight) ** 2).sum())) / float(weight.sum())
    return Lag(lag, math.hypot(scatter, FLOOR), share, int(stamps[0]))


class _Residuals:
    """Residuals of readings to those expected at another time, less their means in spans of `SPAN`; see `lag_of`."""

    def __init__(self, stamps: NDArray[np.int64], read: Array, expected: Array, variances: Array) -> None:
        self._least = variances.sum(axis=0) + 1e-300
        self._times, self._read = (stamps - stamps[0]) * NANO, read
        self._starts = np.flatnonzero(np.diff(self._times // SPAN, prepend=-1.0))
        self._sizes = np.diff(self._starts, append=len(stamps))
        self._expected = np.stack([expected, np.gradient(expected, self._times, axis=0)])

    def sizes(self, left: Array) -> Array:
        """Return the sum of squares of each channel, and of its expected variances."""
        return np.asarray((left**2).sum(axis=0) + self._least)

    def summed(self, values: Array) -> Array:
        """Return the sums of values (.., k, channels) over every span."""
        return np.asarray(np.add.reduceat(values, self._starts, axis=-2))

    def left(self, lag: float) -> Array:
        """Return residuals to the readings expected `lag` s before, and their rates, shape (2, k, channels); 0 if unknown."""
        both, times, then = self._expected.copy(), self._times, self._times - lag
        if lag:
            before = np.clip(np.searchsorted(times, then) - 1, 0, len(times) - 2)
            share = ((then - times[before]) / (times[before + 1] - times[before]))[:, None]
            both = both[:, before] + share * (both[:, before + 1] - both[:, before])
        both[0] = self._read - both[0]
        both[0, (then < 0.0) | (then > times[-1])] = np.nan
        known = np.isfinite(both[0])
        means = self.summed(np.where(known, both, 0.0)) / np.maximum(self.summed(known.astype(float)), 1.0)
        return np.asarray(np.where(known, both - np.repeat(means, self._sizes, axis=1), 0.0))


class Expected(NamedTuple):
    """Expected readings in every block, NaN if no posture has its strokes."""

    angles: dict[Mount | None, Array]  # (blocks, n), encoders (None), inclinometers at root and head of each section, rad
    forces: Array  # (blocks, n), N
    gravity: dict[Stream, Array]  # (blocks,), at rest at every IMU, along its section and (imaginary) across, m/s^2


class RestModel:
    """Model at rest of a scene with its load; `reads` is the quantity of the strokes. For `places` see `boom_twin.Twin`."""

    def __init__(self, scene: Scene, reads: StrokeReading, places: Mapping[str, Place] = NO_PLACES) -> None:
        self.scene, self._joints = scene, RigidJoints(scene)
        self._plan = compile_scene(with_rigid_cylinders(scene) if reads is StrokeReading.LENGTH else scene)
        self._state, self._work = self._plan.state(), self._plan.work()
        joints = self._plan.joints
        kinds: tuple[Mount, ...] = "root", "head"
        self._frames = {kind: mounting_of(self._plan, [kind] * joints).frames for kind in kinds}
        self._measured = measurement_of(self._plan, Settings(), mounting_of(self._plan, ()), places)
        streams, channels = tuple(Stream), self._measured.channels
        self._imus = {streams[row.stream]: int(row.site) for row in channels[channels.kind == READS_ACCELERATION]}
        self.sections = {stream: int(self._measured.sites[site].section) for stream, site in self._imus.items()}
        self._known: dict[bytes, Array] = {}  # rows of `_at_rest`, by strokes

    def expected(self, strokes: Array) -> Expected:
        """Return the expected readings for strokes (blocks, n), m; those of earlier calls are looked up."""
        blocks, n = strokes.shape
        keys = [row.tobytes() for row in strokes]
        for key, row in zip(keys, strokes, strict=True):
            if key not in self._known:
                self._known[key] = self._at_rest(row)
        found = np.array([self._known[key] for key in keys]).reshape(blocks, 4 * n + len(self._imus))
        joints, root, head, forces = found[:, : 4 * n].reshape(blocks, 4, n).swapaxes(0, 1)
        angles: dict[Mount | None, Array] = {None: joints, "root": root, "head": head}
        up = -complex(*gravity_in_base(self.scene))
        gravity = {stream: up * np.exp(-1j * angle) for stream, angle in zip(self._imus, found[:, 4 * n :].T, strict=True)}
        return Expected(angles, forces, gravity)

    def _at_rest(self, strokes: Array) -> Array:
        """Return joint angles, inclinations (root, head), forces, and angles of IMUs; NaN if there is no posture."""
        try:
            near = self._joints.angles(strokes)
            settle(self._plan, self._state, self._work, strokes, near)
        except BoomTwinError:
            return np.full(4 * len(strokes) + len(self._imus), np.nan)
        found, frames = self._plan.observed(self._state), self._state.frames
        mounted = [frames[places, 2] + self.scene.base.inclination for places in self._frames.values()]
        imus = [locate(self._plan.tables, self._state, self._measured, site)[2] for site in self._imus.values()]
        return np.concatenate([found.joints, *mounted, found.cylinder_forces, imus])
