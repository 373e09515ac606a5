"""Blocks of 0.1 s of residuals as linear problems: residuals, sensitivities, noise, and modes at the block's posture."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator
from typing import Any, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from ...analysis.modal import StrokeNoise
from ...config.settings import Settings
from ...errors import BoomTwinError
from ...kernels.jit import SameTypes
from ...scene.schema import Scene
from ...types import NANO, Array, Mount, Stream, channels_of, sensor_kind
from ..baseline import JUDGED, judged_channels
from .block_kernels import first_and_last, largest_step, write_table
from .fault_catalogue import Form, Parameter
from .holds import HoldCollector, HoldProblem
from .innovation_filter import CALM, ModalStates, modes_of, read_modes, shaken_by
from .sensitivities import HoldInWork, Signature, Signatures

BLOCK = 100_000_000  # ns
GRACE = 100_000_000  # ns that a block waits for late samples


class PredictionRows(NamedTuple):
    """Predictions with the strokes that they followed.

    Attributes
    ----------
    stamps : ndarray of int64, shape (k,)
        ns.
    measured, strokes : ndarray, shape (k, n)
        Strokes as measured and as estimated, m.
    variances : ndarray, shape (k, n)
        Of these estimates, m^2.
    joints : ndarray, shape (k, n)
        Predicted angles, rad.
    accelerations : ndarray, shape (k, 2)
        Of the tip, m/s^2.
    """

    stamps: NDArray[np.int64]
    measured: Array
    strokes: Array
    variances: Array
    joints: Array
    accelerations: Array

    @classmethod
    def room(cls, rows: int, joints: int) -> PredictionRows:
        """For so many rows, not filled."""
        measured, strokes, variances, predicted = np.empty((4, rows, joints))
        return cls(np.empty(rows, np.int64), measured, strokes, variances, predicted, np.empty((rows, 2)))


class MeasuredRows(NamedTuple):
    """Measured samples of one stream.

    Attributes
    ----------
    stamps : ndarray of int64, shape (k,)
        ns.
    raw, left : ndarray, shape (k, channels)
        As measured, and the residuals; in the unit of the sensor.
    """

    stamps: NDArray[np.int64]
    raw: Array
    left: Array

    @classmethod
    def room(cls, rows: int, channels: int) -> MeasuredRows:
        """For so many rows, not filled."""
        raw, left = np.empty((2, rows, channels))
        return cls(np.empty(rows, np.int64), raw, left)


Rows = TypeVar("Rows", PredictionRows, MeasuredRows)

_first_and_last, _largest_step = SameTypes(first_and_last), SameTypes(largest_step)


class Block:
    """What came within one block.

    Attributes
    ----------
    number : int
        Its stamps over `BLOCK`.
    end : int
        Stamp (ns) at which it ends.
    """

    def __init__(self, number: int) -> None:
        self.number, self.end = number, (number + 1) * BLOCK
        self.followed: list[PredictionRows] = []
        self.compared: dict[Stream, list[MeasuredRows]] = {}

    def predictions(self) -> PredictionRows:
        """All of them; there is at least one."""
        return joined(self.followed)

    def readings(self, stream: Stream) -> MeasuredRows | None:
        """All samples of a stream; None without any."""
        rows = self.compared.get(stream)
        return None if rows is None else joined(rows)


def joined(parts: list[Rows]) -> Rows:
    """The rows of all parts, one after the other."""
    if len(parts) == 1:
        return parts[0]
    return type(parts[0])(*(np.concatenate(columns) for columns in zip(*parts, strict=True)))


def by_block(rows: Rows) -> Iterator[tuple[int, Rows]]:
    """The rows of every block that they are of, with its number."""
    first, last = _first_and_last(rows.stamps, BLOCK)
    if first == last:
        yield first, rows
        return
    numbers = rows.stamps // BLOCK
    steps: NDArray[np.int64] = np.diff(numbers)
    is_sorted, edges = bool((steps > -1).all()), [0, *(np.flatnonzero(steps) + 1).tolist(), len(numbers)]
    for k, number in enumerate(numbers[edges[:-1]].tolist() if is_sorted else sorted(set(numbers.tolist()))):
        own: Any = slice(edges[k], edges[k + 1]) if is_sorted else numbers == number
        yield number, type(rows)(*(column[own] for column in rows))


class BlockBuilder:
    """Open blocks, in the order of time."""

    def __init__(self) -> None:
        self._open: deque[Block] = deque()
        self._closed = -1

    def predicted(self, followed: PredictionRows) -> None:
        """Predictions, at least one."""
        for number, rows in by_block(followed):
            if (block := self._at(number)) is not None:
                block.followed.append(rows)

    def measured(self, stream: Stream, compared: MeasuredRows) -> None:
        """Samples of a stream with their residuals, at least one."""
        for number, rows in by_block(compared):
            if (block := self._at(number)) is not None:
                block.compared.setdefault(stream, []).append(rows)

    def close(self, stamp: int) -> list[Block]:
        """Blocks that nothing is waited for any more once a stroke has come with `stamp` (ns); they may be empty."""
        done = []
        while self._open and self._open[0].end + GRACE <= stamp:
            done.append(self._open.popleft())
            self._closed = done[-1].number
        return done

    def _at(self, number: int) -> Block | None:
        """The block of a number, with those in between opened; None if it is closed already."""
        if number <= self._closed:
            return None
        if not self._open:
            self._open.append(Block(number))
        while self._open[-1].number < number:
            self._open.append(Block(self._open[-1].number + 1))
        while self._open[0].number > number:
            self._open.appendleft(Block(self._open[0].number - 1))
        return self._open[number - self._open[0].number]


STEP = 0.01  # m of stroke after which signatures are made anew
LASTING = float(np.exp(-BLOCK * NANO / CALM))  # share of the mean square of vibration that counts in the next block
SMOOTHED = 0.5  # of the variance of a stroke's estimate, what is left of it in the mean of a block


class BlockMeans(NamedTuple):
    """One block as residuals have it.

    Attributes
    ----------
    start : int
        ns.
    left : ndarray, shape (channels,)
        Means of the residuals, NaN where nothing was measured or the sensor is not to be trusted.
    counts : ndarray, shape (channels,)
        Of the values in each mean.
    strokes, variances : ndarray, shape (n,)
        As estimated, m; variance of these estimates, m^2.
    rates : ndarray, shape (channels,)
        Of what was predicted, in their units per s; 0 of a stream without readings.
    shaking : float
        Mean square of the predicted tip acceleration, (m/s^2)^2.
    motion : MeasuredRows
        Readings of the sensor that shows vibration best: the IMU, or without it the angles.
    is_felt : bool
        Whether that is the IMU.
    """

    start: int
    left: Array
    counts: Array
    strokes: Array
    variances: Array
    rates: Array
    shaking: float
    motion: MeasuredRows
    is_felt: bool


class BlockProblem(NamedTuple):
    """One block, linearised; c channels.

    Attributes
    ----------
    start : int
        ns.
    table : ndarray, shape (c, 1 + parameters)
        Residuals, and signatures of the parameters.
    own, strokes : ndarray, shape (c,), (c, c)
        Covariance of the residuals: by the noise of the sensors themselves (its diagonal), and by that of the strokes.
    shaking, travel : float
        Mean square of the predicted tip acceleration lately, (m/s^2)^2; travel of the strokes since the block before, m.
    modes : ModalStates
    hold : HoldProblem or None
        That ended with the block before, or since then if derivatives of frequencies had to be made.
    """

    start: int
    table: Array
    own: Array
    strokes: Array
    shaking: float
    travel: float
    modes: ModalStates
    hold: HoldProblem | None = None

    def noise(self, factors2: Array) -> Array:
        """Covariance (c, c) of the residuals where the sensors' own noise is `factors2` (c,) times as strong in power."""
        found = self.strokes.copy()
        found.reshape(-1)[:: len(found) + 1] += self.own * factors2
        return found


class LinearModel:
    """Follows the posture.

    Parameters
    ----------
    scene : Scene
        With its load.
    settings : Settings
    mounts : tuple of Mount or None
    known : tuple of Parameter

    Attributes
    ----------
    signatures : Signatures
    signature : Signature or None
        At the newest block; None before the first.
    """

    def __init__(
        self, scene: Scene, settings: Settings, mounts: tuple[Mount | None, ...], known: tuple[Parameter, ...]
    ) -> None:
        n, self._reach = len(scene.joints), scene.reach
        self.signatures = Signatures(scene, known, mounts)
        self._sensor2 = np.array([settings.variance(sensor_kind(name)) for name in judged_channels(n)])
        late = [(1 + i, *self._channels_of(each.index, n)) for i, each in enumerate(known) if each.form is Form.DELAY]
        turns = [(1 + i, each.index) for i, each in enumerate(known) if each.form is Form.ANGLE_SCALE]
        lengths = [(1 + i, each.index) for i, each in enumerate(known) if each.form is Form.SCALE]
        self._late, self._turns, self._lengths = (
            np.array(places, np.int64).reshape(-1, width) for places, width in ((late, 3), (turns, 2), (lengths, 2))
        )
        self._write_table = SameTypes(write_table)
        self.begin()

    @staticmethod
    def _channels_of(index: int, joints: int) -> tuple[int, int]:
        """The first of the stream of this index, and the one behind its last."""
        counts = [len(channels_of(joints)[stream]) for stream in JUDGED]
        return sum(counts[:index]), sum(counts[: index + 1])

    def begin(self) -> None:
        """The boom starts from rest."""
        self.signature: Signature | None = None
        self._tuned: StrokeNoise | None = None
        self._modes: ModalStates | None = None
        self._before: Array | None = None
        self._shaking = 0.0
        self._holds = HoldCollector(self._reach)
        self._in_work: deque[HoldInWork] = deque()

    def take(self, block: BlockMeans, noise: StrokeNoise) -> BlockProblem | None:
        """One block; None while there is no equilibrium to linearise about."""
        decay = float(noise.decay.min()) if len(noise.decay) else 0.0
        held = self._holds.take(block.start, block.left, block.strokes, block.motion[:2], block.is_felt, BLOCK, decay)
        if held is not None and (begun := self.signatures.hold(held)) is not None:
            self._in_work.append(begun)
        hold = self._hold()
        if self.signature is None or _largest_step(block.strokes, self.signature.strokes) > STEP:
            self.signature = self.signatures.at(block.strokes) or self.signature
        if self.signature is None:
            return None
        if noise is not self._tuned:
            if self._tuned is None or self._modes is None or noise.modes is not self._tuned.modes:
                boom = self.signatures.nominal
                read = read_modes(noise.modes, boom.plan, boom.state, boom.work, boom.reading)
                self._modes = modes_of(noise, read, BLOCK * NANO, self._modes)
            else:
                self._modes = shaken_by(noise, self._modes)
            self._tuned = noise
        travel = 0.0 if self._before is None else _largest_step(block.strokes, self._before)
        shaking, self._before = self._shaking, block.strokes
        self._shaking = max(self._shaking * LASTING, block.shaking)
        own = self._sensor2 / np.maximum(block.counts, 1.0)
        by = self.signature.by_stroke
        spread = (by * (SMOOTHED * block.variances)) @ by.T
        assert self._modes is not None
        return BlockProblem(block.start, self._table(block, self.signature), own, spread, shaking, travel, self._modes, hold)

    def _hold(self) -> HoldProblem | None:
        """Go on with the hold in work, by one parameter a block; gives it when it is done."""
        if not self._in_work:
            return None
        work = self._in_work[0]
        try:
            if self.signatures.go_on(work):
                return None
        except BoomTwinError:
            self._in_work.popleft()
            return None
        return self._in_work.popleft().problem

    def _table(self, block: BlockMeans, signature: Signature) -> Array:
        table = np.empty((len(block.left), 1 + signature.channels.shape[1]))
        by_stroke, moved = signature.by_stroke, block.strokes - signature.strokes  # since signatures were made
        scales = self._turns, by_stroke @ moved, self._lengths, by_stroke, moved
        self._write_table(table, block.left, signature.channels, self._late, block.rates, *scales)
        return table


def warm_up_blocks() -> None:
    """Compile the kernels by which blocks become linear problems, on made-up numbers of two channels."""
    _first_and_last(np.zeros(2, np.int64), BLOCK)
    two, pairs = np.zeros((2, 2)), np.zeros((0, 2), np.int64)
    _largest_step(two[0], two[1])
    late = np.zeros((0, 3), np.int64)
    SameTypes(write_table)(np.zeros((2, 3)), two[0], two, late, two[0], pairs, two[0], pairs, two, two[0])
