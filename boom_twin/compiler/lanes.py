"""Booms of one structure side by side in memory: in the place of every number one of each boom, see `kernels.lanes`."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ..kernels.jit import LANES
from ..kernels.tables import State, Work
from .plan import Plan

WIDTH = 4  # booms in a group: one register of AVX2
LANE = np.dtype([(LANES, float, (WIDTH,))])
ALIGNED = 64  # bytes, a line of the cache


def groups_of(booms: int) -> int:
    """Return the number of groups that hold so many booms; the last group may have fewer."""
    return -(-booms // WIDTH)


def room_for(shape: tuple[int, ...], dtype: np.dtype = LANE) -> np.ndarray:
    """Zeros that begin at a line of the cache."""
    size = int(np.prod(shape)) * dtype.itemsize
    room = np.zeros(size + ALIGNED, np.uint8)
    first = -room.ctypes.data % ALIGNED
    return room[first : first + size].view(dtype).reshape(shape)


def lanes_of(values: np.ndarray) -> np.ndarray:
    """Numbers of booms, shape (booms, ..), as lanes of groups, shape (groups, ..).

    A last group is filled with its last boom. Integers are those of a group's first boom: the others have the same.
    """
    groups = groups_of(len(values))
    booms = np.minimum(np.arange(groups * WIDTH), len(values) - 1).reshape(groups, WIDTH)
    if values.dtype.names:
        rows = room_for((groups, *values.shape[1:]), _laned(values.dtype))
        for name in values.dtype.names:
            rows[name] = lanes_of(values[name])
        return rows.view(np.recarray)
    if values.dtype.kind != "f":
        return np.ascontiguousarray(values[booms[:, 0]])
    found = room_for((groups, *values.shape[1:]))
    found[LANES] = np.moveaxis(values[booms], 1, -1)
    return found


def _laned(dtype: np.dtype) -> np.dtype:
    """The record with lanes for its numbers; lanes first, and whole lines of the cache."""
    names = sorted(dtype.names or (), key=lambda name: dtype[name].kind)
    kinds = [LANE if dtype[name].kind == "f" else dtype[name] for name in names]
    *offsets, size = np.cumsum([0, *(kind.itemsize for kind in kinds)]).tolist()
    return np.dtype({"names": names, "formats": kinds, "offsets": offsets, "itemsize": -(-size // ALIGNED) * ALIGNED})


def numbers_of(lanes: np.ndarray, booms: int) -> np.ndarray:
    """Lanes of groups, shape (groups, ..), as numbers of so many booms, shape (booms, ..)."""
    if lanes.dtype != LANE:
        return np.repeat(lanes, WIDTH, axis=0)[:booms]
    apart = np.moveaxis(lanes[LANES], -1, 1)
    return apart.reshape(len(lanes) * WIDTH, *lanes.shape[1:])[:booms]


def side_by_side(stack: Any) -> Any:
    """A stack of named tuples (see `plan.stacked`) as one of groups."""
    return type(stack)(*(lanes_of(column) if isinstance(column, np.ndarray) else column for column in stack))


def write_back(groups: State, stack: State, good: np.ndarray) -> None:
    """Write the states of groups into those of their booms, where these are `good`, shape (booms,)."""
    for lanes, column in zip(groups, stack, strict=True):
        column[good] = numbers_of(lanes, len(good))[good]


def work_of_lanes(plan: Plan) -> tuple[Work, np.ndarray]:
    """Scratch of a group, and its tangents, see `kernels.transfer.lane_steps.LaneCourse.kept`."""
    work = plan.work()
    condensed = work.condensed
    tangents: Sequence[np.ndarray] = (work.drho, condensed.gains, condensed.factors, condensed.order)
    ends = np.cumsum([each.size for each in tangents])
    kept = room_for((2, int(ends[-1]) + len(plan.names)))
    drho, gains, factors, order = (kept[0, end - a.size : end].reshape(a.shape) for a, end in zip(tangents, ends, strict=True))
    condensed = type(condensed)(*(room_for(each.shape) for each in condensed))
    condensed = condensed._replace(gains=gains, factors=factors, order=order)
    common = ("weights", "finer", "condensed", "drho")
    own: dict[str, Any] = {name: room_for(each.shape) for name, each in work._asdict().items() if name not in common}
    return work._replace(condensed=condensed, drho=drho, **own), kept
