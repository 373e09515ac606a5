"""Commissioning check of a window of readings: channels that are not wired as declared, and their corrected declaration.

An explanation gives each stroke a name, unit, sign and zero. So it determines the boom at rest, and the expected readings of
all other sensors. The explanation with the least cost is chosen. A channel is determined if every explanation and hypothesis
with another reading of it costs `SURE` nats more.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from typing import NamedTuple

import numpy as np

from ..types import SENSORS, Channel, Stream, channels_of
from .hypotheses import (
    ANY_ZERO,
    MOST,
    SIGN,
    UNIT,
    Cube,
    Encoders,
    GravityHypothesis,
    angle_cube,
    assigned,
    common_costs,
    declared_costs,
    force_cube,
    gravity_hypotheses,
    other_boom,
    read_alike,
    si,
    stroke_cube,
    without,
)
from .readings import Expected, RestModel, Table, Window, tables_of

SURE = 7.0  # nats to the next hypothesis, least margin that determines a channel
WRONG = 4.0  # nats per block (2.8 standard deviations) above which a channel is not as declared
KEPT = 8  # stroke explanations compared with all sensors
MOVED = 0.03  # least change of a stroke that is a move, relative to the largest stroke
Declared = Mapping[Stream, Sequence[Channel]]
CubeBuilder = Callable[[Table, Sequence[Channel], Expected, float], Cube]  # such as `angle_cube`


class Verdict(NamedTuple):
    """Result about one channel."""

    stream: Stream
    channel: str
    declared: Channel
    best: Channel | None  # most likely reading, None if no name is left for the channel
    margin: float  # nats by which every other way is less likely
    is_wrong: bool  # the declaration is wrong
    is_explained: bool = True  # `best` explains the readings
    has_no_gravity: bool = False  # the driver of an IMU removes gravity

    @property
    def is_sure(self) -> bool:
        """Return True if the correction `best` is certain."""
        return self.is_wrong and self.is_explained and self.best is not None and self.margin >= SURE


class Checked(NamedTuple):
    """Result of a check. `moved` is False if the boom stood still."""

    verdicts: tuple[Verdict, ...]
    moved: bool
    tables: Mapping[Stream, Table]
    is_other_boom: bool  # the scene's linkages contradict angles and IMUs, which agree

    def lacks(self, verdict: Verdict) -> bool:
        """Return True if a channel is in no message, while others of its stream are read as declared."""
        own = [each for each in self.verdicts if each.stream is verdict.stream]
        names = self.tables[verdict.stream].names
        return verdict.declared.name not in names and not any(each.is_wrong for each in own)

    @property
    def wrong_angles(self) -> list[str]:
        return [each.channel for each in self.verdicts if each.is_wrong and each.stream is Stream.ANGLES]

    @property
    def has_strokes_alone(self) -> bool:
        """Return True if no other sensor was read. Strokes swapped or shifted within the travels are then not found."""
        return set(self.tables) == {Stream.STROKES}


class _Part(NamedTuple):
    """Best readings of one stream under an explanation, by channel as in `Verdict`; `cost` is in nats."""

    cost: float
    best: tuple[Channel | None, ...]
    wrong: tuple[bool, ...]
    explained: tuple[bool, ...]
    margin: Callable[[int], float]
    has_no_gravity: bool = False


@dataclass(frozen=True)
class _Explanation:
    strokes: tuple[Channel, ...]
    parts: Mapping[Stream, _Part]
    cost: float


def check(model: RestModel, declared: Declared, window: Window, is_quick: bool = False) -> Checked | None:
    """Check the declaration of a rig's sensors against readings; None if no block has all strokes, or nothing explains them.

    `declared` has every channel in their order. `window` has readings by name (IMU: by axis); strokes are required.
    `is_quick` only flags channels that are not read as declared.
    """
    still_weight, moved_weight = 1.0, 4.0  # effective number of independent postures: boom at rest; boom moved
    tables = {stream: table for stream, table in tables_of(window).items() if len(table.names)}
    strokes = tables.get(Stream.STROKES)
    if strokes is None or not len(strokes.values) or len(strokes.names) < len(model.scene.joints):
        return None
    moved = bool((np.ptp(strokes.values, axis=0) > MOVED * np.abs(strokes.values).max()).any())
    checker = _Checker(model, declared, tables, moved_weight if moved else still_weight, is_quick)
    return Checked(checker.verdicts(), moved, tables, checker.is_other_boom) if checker.found else None


class _Checker:
    """Comparison of explanations."""

    def __init__(
        self, model: RestModel, declared: Declared, tables: Mapping[Stream, Table], weight: float, is_quick: bool
    ) -> None:
        self._model, self._scene, self._declared, self._tables, self._weight = model, model.scene, declared, tables, weight
        self._limit = weight * (MOST - WRONG) + ANY_ZERO  # nats, largest cost of explained readings
        self._is_quick, self._to_other_boom, self.is_other_boom = is_quick, np.inf, False
        usual, cost = tuple(declared[Stream.STROKES]), self._declared_cost()
        self.found = [] if cost is None else [self._explained(usual, cost)]
        wrong = [any(part.wrong) for each in self.found for part in each.parts.values()]
        if not is_quick and (cost is None or cost > WRONG or any(wrong)):
            found = [self._explained(strokes, prior) for strokes, prior in self._stroke_explanations().items()]
            self.found = sorted(found, key=lambda each: each.cost)
            self._compare_other_boom()

    def _declared_cost(self) -> float | None:
        """Return the prior cost of the declared strokes, None if a name has no readings."""
        table, declared = self._tables[Stream.STROKES], self._declared[Stream.STROKES]
        if any(each.name not in table.names for each in declared):
            return None
        if self._is_quick:
            return 0.0  # no other explanation is compared with it
        plain = stroke_cube(table, declared, self._scene, None, self._weight)
        costs = common_costs(plain, None, False)
        own = {j: (j, table.names.index(each.name)) for j, each in enumerate(declared)}
        return sum(float(costs[at]) for at, each in plain.channels.items() if own[at[0]] == at[:2] and each == declared[at[0]])

    def _common(self, stream: Stream) -> list[tuple[float, int | None, bool]]:
        units, own = list(SENSORS[stream].units), self._declared[stream][0].unit
        ways = product((None, *range(len(units))), (False,) if stream is Stream.STROKES else (False, True))
        return [
            ((0.0 if unit is None or units[unit] == own else UNIT) + (SIGN if is_reversed else 0.0), unit, is_reversed)
            for unit, is_reversed in ways
        ]

    def _stroke_explanations(self) -> dict[tuple[Channel, ...], float]:
        """Return the stroke explanations that fit travels and encoders best, with their prior costs."""
        table, declared = self._tables[Stream.STROKES], self._declared[Stream.STROKES]
        angles, encoders = self._tables.get(Stream.ANGLES), self._declared[Stream.ANGLES]
        if any(each.absolute for each in encoders):
            angles = None
        found = dict[tuple[Channel, ...], tuple[float, float]]()
        if (prior := self._declared_cost()) is not None:
            found[tuple(declared)] = -np.inf, prior
        plain = stroke_cube(table, declared, self._scene, None, self._weight)
        cubes = [plain]
        if angles is not None:
            order = (Encoders(angles, encoders, is_in_order) for is_in_order in (True, False))
            cubes += [stroke_cube(table, declared, self._scene, each, self._weight) for each in order]
        for extra, unit, _ in self._common(Stream.STROKES):
            priors = common_costs(plain, unit, False)
            for cube in cubes:
                costs = common_costs(cube, unit, False)
                best = assigned(costs)
                others = (assigned(without(costs, read_alike(cube, j, cube.channels[at]))) for j, at in best[1].items())
                for total, chosen in (best, *others):
                    if len(chosen) < len(declared) or not all(at in cube.channels for at in chosen.values()):
                        continue
                    strokes = tuple(cube.channels[chosen[j]] for j in range(len(declared)))
                    if total + extra < found.get(strokes, (np.inf, 0.0))[0]:
                        found[strokes] = total + extra, extra + sum(float(priors[at]) for at in chosen.values())
        kept = sorted(found.items(), key=lambda item: item[1][0])[: KEPT + 1]
        return {strokes: prior for strokes, (_, prior) in kept}

    def _explained(self, strokes: tuple[Channel, ...], prior: float) -> _Explanation:
        expected = self._expected(strokes)
        parts: dict[Stream, _Part] = {}
        for stream, cube_of in ((Stream.ANGLES, angle_cube), (Stream.FORCES, force_cube)):
            if stream in self._tables:
                parts[stream] = self._part(stream, expected, cube_of)
        for stream, gravity in expected.gravity.items():
            imu, axes = self._tables.get(stream), self._declared[stream]
            if imu is not None and axes and all(each.name in imu.names for each in axes):
                parts[stream] = self._gravity_part(gravity_hypotheses(imu, axes, gravity, self._weight))
        return _Explanation(strokes, parts, prior + sum(part.cost for part in parts.values()))

    def _expected(self, strokes: tuple[Channel, ...]) -> Expected:
        table, units = self._tables[Stream.STROKES], SENSORS[Stream.STROKES].units
        columns = [si(each, units, table.values[:, table.names.index(each.name)]) for each in strokes]
        return self._model.expected(np.column_stack(columns))

    def _compare_other_boom(self) -> None:
        """Compare the best explanation with another boom, whose sensors are as declared, and whose angles and IMUs agree.

        Without an IMU, another boom is not told from encoders whose zeros nobody set.
        """
        table, declared = self._tables.get(Stream.ANGLES), self._declared[Stream.ANGLES]
        own = next((each for each in self.found if each.strokes == tuple(self._declared[Stream.STROKES])), None)
        if own is None or table is None or any(each.name not in table.names for each in declared):
            return
        expected = self._expected(own.strokes)
        cost, turns = other_boom(table, declared, expected)
        unset = other = cost + own.cost - own.parts[Stream.ANGLES].cost
        for stream in own.parts.keys() & expected.gravity.keys():
            gravity = expected.gravity[stream] * np.exp(-1j * turns[:, self._model.sections[stream]])
            ways = gravity_hypotheses(self._tables[stream], self._declared[stream], gravity, self._weight)
            other += ways[0].cost - own.parts[stream].cost
        best = self.found[0].cost
        self._to_other_boom = other - best
        self.is_other_boom = min(best, unset) - other >= SURE

    def _part(self, stream: Stream, expected: Expected, cube_of: CubeBuilder) -> _Part:
        doubtful = 1.0  # nats per block above which other ways are compared, as an error may show in few postures
        declared, table = self._declared[stream], self._tables[stream]
        costs = declared_costs(stream, table, declared, expected, self._weight)
        is_known = {each.name for each in declared}.issuperset(table.names)
        wrong = [not is_known if cost is None else cost > WRONG * self._weight for cost in costs]
        if self._is_quick or not any(cost is None or cost > doubtful * self._weight for cost in costs):
            total = sum(cost or 0.0 for cost in costs)
            return _Part(total, tuple(declared), tuple(wrong), tuple(not each for each in wrong), lambda j: np.inf)
        cube = cube_of(table, declared, expected, self._weight)
        cases = [(extra, common_costs(cube, unit, is_reversed)) for extra, unit, is_reversed in self._common(stream)]
        solved = [(extra + (found := assigned(each))[0], number, found[1]) for number, (extra, each) in enumerate(cases)]
        cost, number, places = min(solved, key=lambda each: each[:2])
        is_common = cases[number][0] > 0.0
        best = [cube.channels[places[j]] if j in places else None for j in range(len(declared))]
        explained = [not wrong[j] if j not in places else float(cube.costs[places[j]]) < self._limit for j in range(len(best))]
        for j, (read, own) in enumerate(zip(best, declared, strict=True)):
            wrong[j] |= read is not None and is_common and (read.unit, read.sign) != (own.unit, own.sign)
            wrong[j] &= not (read == own and explained[j])  # misfit by a zero error or a recent fault

        def margin(j: int) -> float:
            if (read := best[j]) is None:
                return 0.0
            alike = read_alike(cube, j, read)
            return min(extra + assigned(without(each, alike))[0] for extra, each in cases) - cost

        for j, (read, own) in enumerate(zip(best, declared, strict=True)):
            wrong[j] |= read not in (None, own) and explained[j] and margin(j) >= SURE
        return _Part(cost, tuple(best), tuple(wrong), tuple(explained), margin)

    def _gravity_part(self, ways: list[GravityHypothesis]) -> _Part:
        best = min(ways, key=lambda way: way.cost)
        others = [way.cost for way in ways if way.channels != best.channels or way.has_no_gravity != best.has_no_gravity]
        margin, is_wrong, is_explained = min(others) - best.cost, ways[0].cost > WRONG * self._weight, best.cost < self._limit
        is_sure = margin >= SURE and is_explained and not best.has_no_gravity
        pairs = zip(best.channels, ways[0].channels, strict=True)
        wrong = tuple(is_wrong and not (is_sure and read == own) for read, own in pairs)
        return _Part(best.cost, best.channels, wrong, (is_explained,) * 2, lambda _: margin, best.has_no_gravity)

    def verdicts(self) -> tuple[Verdict, ...]:
        """Return the results for all channels that have readings."""
        best, names, found = self.found[0], channels_of(len(self._scene.joints)), list[Verdict]()
        for j, (own, read) in enumerate(zip(self._declared[Stream.STROKES], best.strokes, strict=True)):
            others = [each.cost - best.cost for each in self.found[1:] if each.strokes[j] != read]
            found.append(Verdict(Stream.STROKES, names[Stream.STROKES][j], own, read, min(others, default=np.inf), read != own))
        unsettled = list[float]()  # margins of undetermined angles, which confirm the strokes
        for stream, part in best.parts.items():
            for j, own in enumerate(self._declared[stream]):
                rivals = [
                    each.cost - best.cost for each in self.found[1:]
                    if each.parts[stream].best[j] != part.best[j] and part.best[j] is not None
                ]  # fmt: skip
                rivals += [self._to_other_boom] if stream is not Stream.FORCES and part.best[j] != own else []
                margin = min([part.margin(j), *rivals, *(unsettled if stream is not Stream.ANGLES else ())])
                flags = part.wrong[j], part.explained[j], part.has_no_gravity
                found.append(Verdict(stream, names[stream][j], own, part.best[j], margin, *flags))
            unsettled += [
                each.margin for each in found if each.stream is stream is Stream.ANGLES and each.is_wrong and not each.is_sure
            ]
        return tuple(found)


UNEXPLAINED = "no name, unit, sign or zero explains its readings"
ABSENT = "in no message: no such sensor, or it is broken"
STROKES_ALONE = "strokes are within the travels; swapped or shifted ones show only beside angles, forces or an IMU"


def reading(way: Channel) -> str:
    """Return name, unit and all unusual values of a sensor as its mapping has them."""
    parts = [way.name, way.unit]
    parts += ["sign -1"] if way.sign < 0 else []
    parts += [f"zero {way.zero:.6g} {way.unit}"] if way.zero else []
    parts += [f"scale {way.scale:g}"] if way.scale != 1.0 else []
    parts += [f"absolute at the {way.absolute}"] if way.absolute else []
    parts += [f"turned by {math.degrees(way.turned):+.1f} deg"] if way.turned else []
    return ", ".join(parts)


def finding(verdict: Verdict, checked: Checked) -> str:
    """Return the finding about a channel."""
    if checked.lacks(verdict):
        return ABSENT
    if not verdict.is_wrong:
        return "within the travel" if checked.has_strokes_alone else "as declared"
    if not verdict.is_explained or verdict.best is None:
        return f"not as declared: {UNEXPLAINED}"
    if verdict.is_sure:
        return likely(verdict)
    why = "several ways explain it" if checked.moved else "the boom stood still"
    return f"not as declared; not determined: {why}; {likely(verdict)}"


def likely(verdict: Verdict) -> str:
    """Return the most likely way in which a wrong channel is read."""
    way = "gravity taken out" if verdict.has_no_gravity or verdict.best is None else reading(verdict.best)
    return way if verdict.is_sure else f"perhaps {way}"


def channel_name(verdict: Verdict) -> str:
    """Return the name that alarms give the sensor."""
    kind = SENSORS[verdict.stream]
    return kind.stem if kind.is_accelerometer else verdict.channel
