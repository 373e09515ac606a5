"""Quantities of a session with standard deviations; two sessions compared by them; also bending moments and stresses."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass, fields
from hashlib import sha256
from math import hypot, sqrt
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ..analysis.bending_stress import BendingStressModel, Station, stations
from ..bag.session_file import WHOLE, TimeWindow
from ..bag.session_model import incompleteness
from ..bag.writer import FILE_NAME as RESULT
from ..errors import BagError, UsageError
from ..offline.recording import alarm_as_text
from ..plots import History
from ..scene.schema import Scene
from ..system.files import holds_file, open_received, sha256_of, write_atomic
from ..types import Array, Stream, sensor_kind, stream_of
from .vibration import RestPeriod

FILE_NAME = "quantities.json"
BATCHES = 10  # number of batches for the standard deviation of a mean (method of batch means)
MODEL_ERROR: dict[Stream | None, float] = {Stream.ANGLES: 5e-5, Stream.IMU: 0.02}
"""Standard deviation of the model error of a reading in one posture, by stream; rad, m/s^2."""
FREQUENCY_ERROR = 0.01  # relative standard deviation of the model's natural frequencies in one posture


@dataclass(frozen=True, slots=True)
class Quantity:
    """Quantity of a session in SI units; `sigma` is its standard deviation, None if unknown."""

    name: str
    value: float
    sigma: float | None
    unit: str


class QuantityBuilder:
    """Accumulator of a session's quantities, block by block."""

    def __init__(self, scene: Scene) -> None:
        self._scene = scene
        self._channels: dict[str, tuple[BatchMeans, BatchMeans]] = {}  # means of values and of squares
        self._displacement = self._acceleration = 0.0
        self.loads = SectionLoads(scene)

    def add(self, history: History, load: Array, variance: Array) -> None:
        """Add the next block of rows; `load` and `variance` as for `SectionLoads.add`."""
        for name, trace in history.residuals.items():
            values = trace.values[np.isfinite(trace.values)]
            means, squares = self._channels.setdefault(name, (BatchMeans(), BatchMeans()))
            means.add(values)
            squares.add(values**2)
        self._displacement = max(self._displacement, float(np.hypot(*history.tip_displacement.T).max()))
        self._acceleration = max(self._acceleration, float(np.hypot(*history.tip_acceleration.T).max()))
        self.loads.add(history, load, variance)

    def quantities(self, tip_sigma: float | None, rests: list[RestPeriod]) -> list[Quantity]:
        """Return all quantities; `tip_sigma` is the largest standard deviation of the predicted tip, m, or None."""
        return [
            *self._residuals(),
            *_frequencies(rests),
            Quantity("tip_displacement_max", self._displacement, tip_sigma, "m"),
            Quantity("tip_acceleration_max", self._acceleration, None, "m/s^2"),
            *(
                Quantity(f"bending_moment_max_section_{section + 1}", moment, None, "N m")
                for section, moment in self.loads.moments.items()
            ),
        ]

    def _residuals(self) -> Iterator[Quantity]:
        """Yield mean and root mean square of every channel's residual.

        Their standard deviations include `MODEL_ERROR`, and are None for streams without one.
        """
        for name, (values, squares) in self._channels.items():
            unit = sensor_kind(name).unit
            if values.count < BATCHES:
                continue
            (mean, mean_sigma), (square, square_sigma) = values.mean, squares.mean
            rms, mean_error, rms_error = sqrt(square), None, None
            if (error := MODEL_ERROR.get(stream_of(name))) is not None:
                mean_error = hypot(mean_sigma, error)
                rms_error = hypot(square_sigma, 2.0 * mean * error) / (2.0 * rms) if rms else 0.0
            yield Quantity(f"residual_mean_{name}", mean, mean_error, unit)
            yield Quantity(f"residual_rms_{name}", rms, rms_error, unit)


class BatchMeans:
    """Mean of values added in parts, and its standard deviation by the method of batch means."""

    def __init__(self) -> None:
        self.count = 0  # values so far
        self._sums: list[tuple[float, int]] = []  # sum and count of each piece; every part has `BATCHES` pieces

    def add(self, values: Array) -> None:
        self.count += len(values)
        self._sums += [(float(piece.sum()), len(piece)) for piece in np.array_split(values, BATCHES)]

    @property
    def mean(self) -> tuple[float, float]:
        """Mean, and its standard deviation from `BATCHES` batches. At least `BATCHES` values are needed."""
        parts = [part.sum(axis=0) for part in np.array_split(np.array(self._sums), BATCHES)]
        means = np.array([total / count for total, count in parts if count])
        total = sum(total for total, _ in self._sums)
        return total / self.count, float(means.std(ddof=1) / sqrt(len(means))) if len(means) > 1 else 0.0


def _frequencies(rests: list[RestPeriod]) -> Iterator[Quantity]:
    for mode in sorted({mode for rest in rests for mode in rest.measured}):
        seen = [(rest.model[mode], rest.measured[mode]) for rest in rests if mode in rest.measured]
        ratios = np.array([(each.frequency / model, each.frequency_sigma / model) for model, each in seen])
        dampings = np.array([(each.damping, each.damping_sigma) for _, each in seen])
        yield _weighted(f"frequency_ratio_mode_{mode + 1}", ratios, FREQUENCY_ERROR)
        yield _weighted(f"damping_mode_{mode + 1}", dampings, 0.0)


def _weighted(name: str, rows: Array, error: float) -> Quantity:
    """Return the weighted mean of `rows` (k, 2): values and standard deviations.

    Its standard deviation is the larger of those from weights and from scatter, combined with `error`.
    """
    weights = rows[:, 1] ** -2.0
    mean = float(weights @ rows[:, 0] / weights.sum())
    scatter = float(weights @ (rows[:, 0] - mean) ** 2 / max(len(rows) - 1, 1))
    return Quantity(name, mean, hypot(sqrt(max(1.0, scatter) / weights.sum()), error), "1")


def write(folder: Path, scene: Scene, found: list[Quantity]) -> Path:
    """Write the quantities beside ``summary.json``; return the file."""
    path = folder / FILE_NAME
    rows = ",\n".join(f"  {json.dumps(asdict(each))}" for each in found)
    write_atomic(path, f'{{\n "scene_sha256": "{digest(scene)}",\n "quantities": [\n{rows}\n ]\n}}\n')
    return path


@contextmanager
def _content(path: Path) -> Iterator[Any]:
    """Yield the content of a JSON file of a replay. If it cannot be read or used, raise BagError."""
    try:
        with open_received(path) as file:
            yield json.load(file)
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise BagError(f"{path}: {error}. Replay the session again with `boom_twin replay`.") from None


def read(folder: Path) -> tuple[str, list[Quantity]]:
    """Return scene digest and quantities of a replay folder; raise BagError if they cannot be read."""
    with _content(folder / FILE_NAME) as content:
        return str(content["scene_sha256"]), [Quantity(**row) for row in content["quantities"]]


def digest(scene: Scene) -> str:
    return sha256(scene.model_dump_json(exclude_none=True).encode()).hexdigest()


@dataclass(frozen=True, slots=True)
class Load:
    """Largest bending moment of a station in a session."""

    station: Station
    column: int  # column of `History.moments`
    moment: float  # N m, the largest in magnitude
    time: float  # s, of that moment
    static: float  # N m, its static part
    unknown: float  # N m, static moment of the estimated load at the tip; NaN if there is no estimate
    sigma: float  # N m, standard deviation of `unknown`
    modulus: float  # m^3, section modulus

    @property
    def stress(self) -> float:
        """Bending stress of the outermost fibre, Pa."""
        return abs(self.moment) / self.modulus


class SectionLoads:
    """Largest bending moment of every station over the blocks of a session."""

    def __init__(self, scene: Scene) -> None:
        self._scene, self._places = scene, stations(scene)
        self._largest: dict[int, _Largest] = {}  # by column

    def add(self, history: History, load: Array, variance: Array) -> None:
        """Add the next block of m rows; `load` (N) at the tip, estimated, and its `variance` (N^2), each (m, 2)."""
        if not self._places:
            return
        for column, row in enumerate(np.abs(history.moments).argmax(axis=0).tolist()):
            moment = float(history.moments[row, column])
            if column not in self._largest or abs(moment) > abs(self._largest[column].moment):
                when, static = float(history.stamps_s[row]), float(history.slow_moments[row, column])
                about = (each[row].copy() for each in (history.strokes, history.joints, load, variance))
                self._largest[column] = _Largest(moment, when, static, *about)

    @property
    def moments(self) -> dict[int, float]:
        """Size (N m) of the largest moment so far by section, counted from 0."""
        found: dict[int, float] = {}
        for column, own in self._largest.items():
            section = self._places[column].section
            found[section] = max(found.get(section, 0.0), abs(own.moment))
        return found

    def most_loaded(self) -> list[Load]:
        """Return the load of every station, that of the largest stress first; see `BendingStressModel`."""
        if not self._largest:
            return []
        model, found = BendingStressModel(self._scene), []
        for column, own in self._largest.items():
            unknown = sigma = math.nan
            if own.load.any():
                influence = model.influence(own.strokes, own.joints)[column]
                unknown, sigma = float(influence @ own.load), math.sqrt(float(influence**2 @ own.variance))
            place, modulus = self._places[column], float(model.moduli[column])
            found.append(Load(place, column, own.moment, own.time, own.static, unknown, sigma, modulus))
        return sorted(found, key=lambda load: -load.stress)


class _Largest(NamedTuple):
    """Largest moment of a station so far (fields as in `Load`), and the state at that time."""

    moment: float
    time: float
    static: float
    strokes: Array  # m
    joints: Array  # rad
    load: Array  # N, estimated at the tip
    variance: Array  # N^2, of `load`


@dataclass(frozen=True)
class ComparedSession:
    """Figures and alarms of one session, for a comparison."""

    name: str
    scene: str  # digest of its scene
    quantities: list[Quantity]
    alarms: list[dict[str, Any]]  # as in ``summary.json``
    incomplete: str = ""  # why the session is not whole, in words


def side_of(path: Path, replayed: Callable[[Path], Path], window: TimeWindow = WHOLE) -> ComparedSession:
    """Return one side from a replay folder, or from a session that `replayed` makes one of, for the `window`.

    BagError if the session cannot be replayed, or the folder is incomplete or without figures that can be read. UsageError
    for a window of a replay folder, which has its own.
    """
    is_replay = holds_file(path / "summary.json")
    if is_replay and (told := incompleteness(path)):
        raise BagError(f"{path}: {told}")
    if is_replay and window != WHOLE:
        raise UsageError(f"{path}: a replay folder has its own window. Give the session itself with --start and --duration.")
    folder = path if is_replay else replayed(path)
    scene, found = read(folder)
    with _content(folder / "summary.json") as summary:
        alarms, told = list(summary["alarms"]), summary["output_sha256"]
        incomplete = str(summary.get("session_incomplete", ""))
    bag = folder / "bag" / RESULT
    if bag.is_file() and sha256_of(bag) != told:
        raise BagError(f"{folder}: summary.json is not of the bag beside it. Replay the session again with `boom_twin replay`.")
    return ComparedSession(path.resolve().name, scene, found, alarms, incomplete)


SIGNIFICANT = 4.0
"""Standard deviations from which a difference is no chance: one in a thousand for means of ten batches (t distribution)."""


@dataclass(frozen=True, slots=True)
class ComparisonRow:
    """One figure of both sessions, None where a session has none of it."""

    name: str
    unit: str
    a: float | None
    b: float | None
    difference: float | None = None  # b minus a
    sigma: float | None = None  # standard deviation of the difference; None where that of a or b is not known
    is_significant: bool | None = None  # None where that is not known


def rows_of(one: ComparedSession, other: ComparedSession) -> list[ComparisonRow]:
    """Return all figures that either session has, in the order of the first."""
    left, right = ({each.name: each for each in side.quantities} for side in (one, other))
    return [_row(name, left.get(name), right.get(name)) for name in dict.fromkeys([*left, *right])]


def _row(name: str, a: Quantity | None, b: Quantity | None) -> ComparisonRow:
    if a is None or b is None:
        known = a or b
        assert known is not None
        return ComparisonRow(name, known.unit, a.value if a else None, b.value if b else None)
    difference = b.value - a.value
    if a.sigma is None or b.sigma is None:
        return ComparisonRow(name, a.unit, a.value, b.value, difference)
    sigma = hypot(a.sigma, b.sigma)
    return ComparisonRow(name, a.unit, a.value, b.value, difference, sigma, abs(difference) > SIGNIFICANT * sigma)


def flat(one: ComparedSession, other: ComparedSession, rows: list[ComparisonRow]) -> dict[str, Any]:
    """Return a comparison as one flat object: every column of the table as a list, and the alarms in words."""
    return {
        "session_a": one.name,
        "session_b": other.name,
        "incomplete_a": one.incomplete or None,
        "incomplete_b": other.incomplete or None,
        "same_scene": one.scene == other.scene,
        **{each.name: [getattr(row, each.name) for row in rows] for each in fields(ComparisonRow)},
        "alarms_a": [alarm_as_text(alarm) for alarm in one.alarms],
        "alarms_b": [alarm_as_text(alarm) for alarm in other.alarms],
    }


def as_text(one: ComparedSession, other: ComparedSession, rows: list[ComparisonRow]) -> list[str]:
    """Return the lines of a table, then of the alarms."""
    lines = [f"{'':32s} {'A':>12s} {'B':>12s} {'B - A':>12s} {'+-':>10s}"]
    for row in rows:
        numbers = "".join(f" {_number(value):>12s}" for value in (row.a, row.b, row.difference))
        mark = {True: "differs", False: "", None: "?"}[row.is_significant]
        lines.append(f"{row.name:32s}{numbers} {_number(row.sigma):>10s}  {row.unit:6s} {mark}".rstrip())
    lines += ["", f"differs: by more than {SIGNIFICANT:g} standard deviations; ?: the uncertainty is unknown"]
    lines.append("damping, peaks and moments also differ where postures and moves do")
    for letter, side in (("A", one), ("B", other)):
        lines.append(f"alarms of {letter}, {side.name}: {len(side.alarms) or 'none'}")
        lines += [f"  {alarm_as_text(alarm)}" for alarm in side.alarms]
    return lines


def _number(value: float | None) -> str:
    return "-" if value is None else f"{value:.4g}"
