"""Hypotheses of how each sensor is read, with costs: negative logarithm of prior times likelihood, nats.

A stream of n channels has costs (n, names, hypotheses). An entry is the cost of reading a channel by a name under one
hypothesis. Names are assigned to channels at the least total cost.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from itertools import permutations, product
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..scene.kinematics import stroke_curve
from ..scene.schema import Scene
from ..types import GIVE, SENSORS, Array, Channel, Mount, Stream
from .readings import Expected, Table

ANGLE_ERROR = math.radians(0.7)  # rad, zero error of an encoder and error of the scene
MOST = 12.0  # nats, largest cost of a block, as a reading may err for a reason without hypothesis
NEAR_ZERO = math.radians(5.0)  # tolerance of zeros (left to calibration) and of quarter and half turns
UNIT, OTHER_UNIT, SIGN, NAME, EXTRA_NAME = 4.0, 9.0, 4.0, 3.0, 6.0  # nats, prior costs of changes
REVERSED, PIN_TO_PIN, HALF_TURN, SMALL_ZERO, ANY_ZERO = 6.0, 3.0, 5.0, 6.0, 9.0  # pin to pin is likelier than inches
ABSOLUTE, TURNED, NO_GRAVITY = 4.0, 8.0, 4.0
OTHER_BOOM, OTHER_LINKAGE = 12.0, math.radians(20.0)  # nats; rad, standard deviation of an angle by the linkage of another boom
IMPOSSIBLE = 1e6  # nats
OUTSIDE = 60.0  # nats for strokes beyond the travel
SLACK = 0.02  # allowed stroke beyond the travel, relative to it
TAU = 2.0 * math.pi


class Cube(NamedTuple):
    """Costs of reading one stream, without those of unit and sign (see `common_costs`); arrays (n, names, hypotheses)."""

    costs: Array
    channels: Mapping[tuple[int, int, int], Channel]  # way to read a channel under a hypothesis
    units: NDArray[np.int64]  # indices among the units of the stream
    declared_units: NDArray[np.int64]
    reversals: NDArray[np.bool_]  # the sign is not as declared


def common_costs(cube: Cube, unit: int | None, is_reversed: bool) -> Array:
    """Return all costs if the sensors of a stream share a unit (None: as declared) and a reversal of sign."""
    free = cube.declared_units if unit is None else unit
    return np.asarray(
        cube.costs + np.where(cube.units == free, 0.0, OTHER_UNIT) + np.where(cube.reversals == is_reversed, 0.0, SIGN)
    )


def misfit(off: Array, weight: float) -> Array:
    """Return the cost of errors `off` (.., blocks) in standard deviations. NaN (no such posture) costs `MOST`."""
    if not off.shape[-1]:
        return np.zeros(off.shape[:-1])
    return np.asarray(weight * np.minimum(np.where(np.isfinite(off), 0.5 * off**2, MOST), MOST).mean(axis=-1))


def assigned(costs: Array) -> tuple[float, dict[int, tuple[int, int, int]]]:
    """Return the least total cost, and the assigned index into `costs` (n, names, hypotheses) by channel."""
    from scipy.optimize import linear_sum_assignment  # its import takes longer than the check of a sound rig

    least = costs.min(axis=2)
    rows, columns = linear_sum_assignment(least)
    places = {int(j): (int(j), int(a), int(costs[j, a].argmin())) for j, a in zip(rows, columns, strict=True)}
    return float(least[rows, columns].sum()), places


def read_alike(cube: Cube, j: int, channel: Channel) -> tuple[NDArray[np.int64], ...]:
    """Return the indices of the hypotheses that read channel j as `channel`.

    Bending is small: inclinometers at root and head are alike, and at joint 0 so are inclinometer and encoder.
    """
    places = [
        place
        for place, each in cube.channels.items()
        if place[0] == j
        and each._replace(absolute=None) == channel._replace(absolute=None)
        and (j == 0 or (each.absolute is None) == (channel.absolute is None))
    ]
    return tuple(np.array(places, np.int64).reshape(-1, 3).T)


def without(costs: Array, places: tuple[NDArray[np.int64], ...]) -> Array:
    found = costs.copy()
    found[places] = IMPOSSIBLE
    return found


def name_cost(declared: Sequence[Channel], j: int, name: str, names: Sequence[str]) -> float:
    """Return the prior cost of reading channel j by a name."""
    if name == declared[j].name:
        return 0.0
    is_extra = all(name != each.name for each in declared)
    return EXTRA_NAME if is_extra and declared[j].name in names else NAME


def settings_of(declared: Sequence[Channel], j: int, name: str) -> Channel:
    """Return the declaration of a name, or that of channel j under this name if it has none."""
    return next((each for each in declared if each.name == name), declared[j])._replace(name=name)


def si(channel: Channel, units: Mapping[str, float], readings: Array) -> Array:
    """Return readings as quantities, SI."""
    return channel.sign * channel.scale * units[channel.unit] * (readings - channel.zero)


def as_read(channel: Channel, units: Mapping[str, float], quantities: Array) -> Array:
    """Return the readings of quantities (SI), the inverse of `si`."""
    return quantities / (channel.sign * channel.scale * units[channel.unit]) + channel.zero


def ways(base: Channel, units: Mapping[str, float]) -> list[Channel]:
    """Return a sensor with every unit and sign."""
    return [base._replace(unit=unit, sign=sign) for unit in units for sign in (1, -1)]


class _Builder:
    def __init__(self, n: int, names: int, units: Mapping[str, float]) -> None:
        self._shape, self._units = (n, names), list(units)
        self._cells: dict[tuple[int, int], list[tuple[float, Channel, Channel]]] = {}

    def add(self, j: int, a: int, cost: float, channel: Channel, base: Channel) -> None:
        self._cells.setdefault((j, a), []).append((cost, channel, base))

    def cube(self) -> Cube:
        shape = (*self._shape, max(map(len, self._cells.values())))
        costs, channels = np.full(shape, IMPOSSIBLE), {}
        units, declared, reversals = np.zeros(shape, np.int64), np.zeros(shape, np.int64), np.zeros(shape, bool)
        for (j, a), cell in self._cells.items():
            for h, (cost, channel, base) in enumerate(cell):
                at = j, a, h
                costs[at], channels[at], reversals[at] = min(cost, IMPOSSIBLE), channel, channel.sign != base.sign
                units[at], declared[at] = self._units.index(channel.unit), self._units.index(base.unit)
        return Cube(costs, channels, units, declared, reversals)


def declared_costs(
    stream: Stream, table: Table, declared: Sequence[Channel], expected: Expected, weight: float
) -> list[float | None]:
    """Return the costs of angle or force readings as declared, None for a name without readings."""
    costs: list[float | None] = []
    for j, own in enumerate(declared):
        if own.name not in table.names:
            costs.append(None)
            continue
        readings = si(own, SENSORS[stream].units, table.values[:, table.names.index(own.name)])
        off = (readings - expected.forces[:, j]) / _force_error(expected, j)
        if stream is Stream.ANGLES:
            off = _angle_errors(readings, own, expected, j) / ANGLE_ERROR
        costs.append(float(misfit(off[np.isfinite(readings)], weight)))
    return costs


def _angle_errors(readings: Array, own: Channel, expected: Expected, j: int) -> Array:
    return np.remainder(readings - expected.angles[_at_rest(own.absolute)][:, j] + math.pi, TAU) - math.pi


def other_boom(table: Table, declared: Sequence[Channel], expected: Expected) -> tuple[float, Array]:
    """Return the cost of declared angles at a boom with other linkages, and the rotations of its sections, rad (blocks, n)."""
    cost, turns, turn, units = OTHER_BOOM, list[Array](), np.zeros(len(table.values)), SENSORS[Stream.ANGLES].units
    for j, own in enumerate(declared):
        off = _angle_errors(si(own, units, table.values[:, table.names.index(own.name)]), own, expected, j)
        mean = float(off[np.isfinite(off)].mean()) if np.isfinite(off).any() else math.inf  # no posture has such strokes
        cost += math.log(OTHER_LINKAGE / ANGLE_ERROR) + 0.5 * (mean / OTHER_LINKAGE) ** 2
        turn = off + (0.0 if own.absolute else turn)
        turns.append(turn)
    return cost, np.column_stack(turns)


def _at_rest(mount: Mount | None) -> Mount | None:
    """Return the mount of an inclinometer that is not compensated and reads the same at rest; None for an encoder."""
    plain: dict[Mount | None, Mount] = {"root_compensated": "root", "head_compensated": "head"}
    return plain.get(mount, mount)


def _force_error(expected: Expected, j: int) -> Array:
    force_share, force_least = 0.12, 0.04  # force error by loads, relative to the force and to the largest
    return np.asarray(
        force_share * np.abs(expected.forces[:, j]) + force_least * np.nanmax(np.abs(expected.forces), initial=1.0)
    )


def angle_cube(table: Table, declared: Sequence[Channel], expected: Expected, weight: float) -> Cube:
    units = SENSORS[Stream.ANGLES].units
    found = _Builder(len(declared), len(table.names), units)
    for a, name in enumerate(table.names):
        readings = table.values[:, a][np.isfinite(table.values[:, a])]
        is_read = np.isfinite(table.values[:, a])
        for j in range(len(declared)):
            base = settings_of(declared, j, name)
            own = ways(base, units)
            tracks = np.array([si(channel, units, readings) for channel in own])
            before = name_cost(declared, j, name, table.names)
            for kind, angles in expected.angles.items():
                mount = base.absolute if kind == _at_rest(base.absolute) else kind
                cost = before + (ABSOLUTE if mount != base.absolute else 0.0)
                for more, zeros, costs in _zeros(tracks - angles[is_read, j], kind is None, weight):
                    for channel, zero, misfits in zip(own, zeros.tolist(), costs.tolist(), strict=True):
                        size = channel.sign * channel.scale * units[channel.unit]
                        moved = channel._replace(absolute=mount, zero=channel.zero + zero / size)
                        found.add(j, a, cost + more + misfits, moved, base)
    return found.cube()


def _zeros(off: Array, is_encoder: bool, weight: float) -> Iterator[tuple[float, Array, Array]]:
    """Yield prior cost, zeros (ways,) in rad and misfits (ways,) of angle errors (ways, blocks); decoders remove a turn."""
    turns = np.round(off / TAU)
    wrapped = off - TAU * turns
    known = np.isfinite(wrapped)
    first = np.where(known.any(axis=1), turns[np.arange(len(off)), known.argmax(axis=1)], 0.0)
    is_steady = np.where(known, np.abs(turns - first[:, None]) < 0.5, True).all(axis=1) & is_encoder & (np.abs(first) > 1.5)
    yield 0.0, np.where(is_steady, TAU * first, 0.0), misfit(wrapped / ANGLE_ERROR, weight)
    half = np.remainder(wrapped, TAU) - math.pi
    yield HALF_TURN, np.copysign(math.pi, np.nansum(wrapped, axis=1)), misfit(half / ANGLE_ERROR, weight)
    middle = np.angle(np.where(known, np.exp(1j * np.where(known, wrapped, 0.0)), 0.0).sum(axis=1))
    rest = np.remainder(wrapped - middle[:, None] + math.pi, TAU) - math.pi
    misfits, size = misfit(rest / ANGLE_ERROR, weight), np.abs(middle)
    yield SMALL_ZERO, np.zeros(len(off)), np.where(size <= NEAR_ZERO, misfits, IMPOSSIBLE)
    yield ANY_ZERO, middle, np.where((size > NEAR_ZERO) & (size < math.pi - NEAR_ZERO), misfits, IMPOSSIBLE)


def force_cube(table: Table, declared: Sequence[Channel], expected: Expected, weight: float) -> Cube:
    units = SENSORS[Stream.FORCES].units
    found = _Builder(len(declared), len(table.names), units)
    for a, name in enumerate(table.names):
        readings = table.values[:, a]
        is_read = np.isfinite(readings)
        for j in range(len(declared)):
            base, right = settings_of(declared, j, name), expected.forces[is_read, j]
            sigma = _force_error(expected, j)[is_read]
            for channel in ways(base, units):
                off = (si(channel, units, readings[is_read]) - right) / sigma
                found.add(j, a, name_cost(declared, j, name, table.names) + float(misfit(off, weight)), channel, base)
    return found.cube()


class GravityHypothesis(NamedTuple):
    """Way to read an IMU: its cost, the channels of x and z, and True if its driver removes gravity."""

    cost: float
    channels: tuple[Channel, Channel]
    has_no_gravity: bool = False


def gravity_hypotheses(table: Table, declared: Sequence[Channel], gravity: Array, weight: float) -> list[GravityHypothesis]:
    """Return all ways to read an IMU if `gravity` (blocks,) is expected, the declared one first."""
    gravity_error = 0.6  # m/s^2, bias of an IMU and mean acceleration of the tip
    rest_error = 0.3  # m/s^2, the same if the driver removes gravity
    units = SENSORS[Stream.IMU].units
    places = {name: a for a, name in enumerate(table.names)}
    is_read = np.isfinite(table.values[:, [places[each.name] for each in declared]]).all(axis=1)
    right, found = gravity[is_read], list[GravityHypothesis]()
    signs = (1, 1), (-1, 1), (1, -1), (-1, -1)
    for (x, z), unit, (flip_x, flip_z) in product(permutations(table.names, 2), units, signs):
        one = declared[0]._replace(name=x, unit=unit, sign=flip_x * declared[0].sign)
        two = declared[1]._replace(name=z, unit=unit, sign=flip_z * declared[1].sign)
        f = si(one, units, table.values[is_read, places[x]]) + 1j * si(two, units, table.values[is_read, places[z]])
        spread = np.hypot(table.spreads[is_read, places[x]], table.spreads[is_read, places[z]]) * units[unit]
        sigma = np.hypot(gravity_error, spread)
        f = f * np.exp(1j * one.turned)
        cost = (UNIT if unit != declared[0].unit else 0.0) + (SIGN if min(flip_x, flip_z) < 0 else 0.0)
        cost += NAME if (x, z) != (declared[0].name, declared[1].name) else 0.0
        found.append(GravityHypothesis(cost + float(misfit(np.abs(f - right) / sigma, weight)), (one, two)))
        if flip_z < 0 or places[x] > places[z]:  # equals a rotation of another pair
            continue
        turn = float(np.angle(np.nansum(right * f.conj())))
        if abs(math.remainder(turn, math.pi / 2.0)) > NEAR_ZERO:
            off = np.abs(f * np.exp(1j * turn) - right) / sigma
            pair = one._replace(turned=one.turned + turn), two._replace(turned=two.turned + turn)
            found.append(GravityHypothesis(cost + TURNED + float(misfit(off, weight)), pair))
    rest = np.hypot.reduce([table.values[is_read, a] for a in range(len(table.names))], axis=0)
    found.append(GravityHypothesis(NO_GRAVITY + float(misfit(rest / rest_error, weight)), (declared[0], declared[1]), True))
    first = next(i for i, each in enumerate(found) if each.channels == tuple(declared))
    return [found[first], *found[:first], *found[first + 1 :]]


def stroke_cube(strokes: Table, declared: Sequence[Channel], scene: Scene, encoders: Encoders | None, weight: float) -> Cube:
    """Return the costs of stroke readings by the cylinders' travels and by encoders."""
    units = SENSORS[Stream.STROKES].units
    found = _Builder(len(declared), len(strokes.names), units)
    for j, joint in enumerate(scene.joints):
        closed, longest = joint.cylinder.closed_length, joint.cylinder.max_stroke
        curves = None if encoders is None else _curves(scene, j, encoders)
        for c, name in enumerate(strokes.names):
            base = settings_of(declared, j, name)
            before = name_cost(declared, j, name, strokes.names)
            for unit in units:
                same = base._replace(unit=unit)
                size = base.sign * base.scale * units[unit]
                for way_cost, channel in (
                    (0.0, same),
                    (0.0, same._replace(sign=-base.sign)),
                    (REVERSED, same._replace(sign=-base.sign, zero=base.zero + longest / size)),
                    (PIN_TO_PIN, same._replace(zero=base.zero + closed / size)),
                ):
                    track = si(channel, units, strokes.values[:, c])
                    slack = SLACK * longest
                    outside = float(((track < -slack) | (track > longest + slack)).mean())
                    # a larger unit that fits the travel is more likely
                    cost = before + way_cost + OUTSIDE * outside - math.log(units[unit])
                    if curves is not None and len(curves.strokes) and outside < 0.5:
                        off = (curves.strokes - track) / curves.sigmas
                        cost += float((misfit(off, weight) + curves.costs).min())
                    elif curves is not None and len(curves.strokes):
                        cost += MOST * weight
                    found.add(j, c, cost, channel, base)
    return found.cube()


class Encoders(NamedTuple):
    """Readings and declaration of encoders. `is_in_order` is True if names are as declared. Unit and sign are free."""

    table: Table
    declared: Sequence[Channel]
    is_in_order: bool


class _Curves(NamedTuple):
    """Strokes (hypotheses, blocks) by encoders, m, their standard deviations, and prior costs (hypotheses,)."""

    strokes: Array
    sigmas: Array
    costs: Array


def _curves(scene: Scene, j: int, encoders: Encoders) -> _Curves:
    loose = 3.0  # factor on the angle error if encoders select stroke explanations
    least_slope = 0.02  # m/rad, of a cylinder at a dead centre
    tracks, costs = list[Array](), list[float]()
    units, (table, declared, is_in_order) = SENSORS[Stream.ANGLES].units, encoders
    low, high = np.radians(scene.joints[j].range_deg)
    middle, half = 0.5 * (low + high), 0.5 * (high - low) + GIVE
    for a, name in enumerate(table.names):
        if is_in_order and name != declared[j].name:
            continue
        base = settings_of(declared, j, name)
        for channel in ways(base, units):
            is_other = channel.unit != base.unit
            for turn_cost, turn in ((0.0, 0.0), (HALF_TURN, math.pi)):
                track = np.remainder(si(channel, units, table.values[:, a]) + turn - middle + math.pi, TAU) - math.pi
                tracks.append(np.where(np.abs(track) < half, track + middle, np.nan))
                cost = turn_cost + (UNIT if is_other else 0.0) + (SIGN if channel.sign != base.sign else 0.0)
                costs.append(name_cost(declared, j, name, table.names) + cost)
    angles, step = np.array(tracks).reshape(len(costs), len(table.values)), 1e-3
    before, after = (stroke_curve(scene, j, (angles + each).ravel()).reshape(angles.shape) for each in (-step, step))
    sigmas = np.maximum(np.abs(after - before) / (2.0 * step), least_slope) * loose * ANGLE_ERROR
    return _Curves(0.5 * (before + after), sigmas, np.array(costs))
