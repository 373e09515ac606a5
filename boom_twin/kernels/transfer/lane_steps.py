"""Steps of several booms side by side, one a lane: ideal pins, Riccati form, kept tangents.

Numbers are `kernels.lanes`; places, forces and tangents come from the functions that step a single boom, and each boom gets
what it gets alone, to the bit. What differs is the loop of Newton passes: it goes on until all lanes are done, and a lane that
is done, or that keeps its tangent while others make theirs anew, is left as it is. A lane that fails is left out from there.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ..integrators import finish_step, prepare, start_step
from ..jit import by_reference, inner, kernel, referenced, select, some
from ..tables import OK, Motion
from .forward_kinematics import place
from .kept_tangent import (
    GAIN,
    SHARE_LEAD,
    TRAVEL,
    correct_guess,
    forget_all,
    is_converged,
    is_rough,
    may_keep,
    note_correction,
)
from .riccati_sweep import FREE, ROOT, clear_cut, sweep_in, sweep_out
from .time_step import LONGEST_INCREMENT, TICKS, add_increments, observe_boom, predict, state_of, tables_of

FAILED, PASSES = 0, 1  # columns of `ends`


@by_reference
class LaneCourse(NamedTuple):
    """Drive motions of groups of booms and the rows that result; all are lanes.

    drives, rates : (groups, steps in all, n), m and m/s. out : (groups, rows, row_width), see `time_step.run`.
    ends : (groups, 2): 1 for a boom that failed, which is to be stepped alone; its passes.
    kept : (2, size): all tangents of the work, which has views of the first row; room for as many, and for increments.
    """

    drives: np.ndarray
    rates: np.ndarray
    out: np.ndarray
    ends: np.ndarray
    kept: np.ndarray


@inner
def solve(t, state, work, scheme, renew):
    """Solve one Newton pass: increments into `work.dz`; return False if a system was singular in all lanes."""
    motion = Motion(scheme.gain, scheme.rate, work.hat, work.offset, renew)
    clear_cut(work, FREE)
    solved, _, _ = sweep_in(
        t, state, work, motion, work.drive, work.drive_rate, ROOT, t.operations.shape[0], FREE, work.condensed
    )
    if solved == OK:
        sweep_out(t, state, work, work.condensed, ROOT, t.operations.shape[0], FREE)
    return solved == OK


@inner
def solve_renewing(t, state, work, kept, scheme, renew, going):
    """Solve like `solve`, with new tangents in the lanes that `renew` them; the others keep theirs."""
    work.kept[GAIN] = select(renew, scheme.gain, work.kept[GAIN])
    work.kept[TRAVEL] = select(renew, 0.0, work.kept[TRAVEL])
    for i in range(state.z.shape[0]):
        work.kept_z[i] = select(renew, state.z[i], work.kept_z[i])
    if not some(~renew):
        return solve(t, state, work, scheme, True)
    size, tangent = kept.shape[1] - state.z.shape[0], kept[0]
    for i in range(size):
        kept[1, i] = tangent[i]
    solved = solve(t, state, work, scheme, True)
    for i in range(size):
        tangent[i] = select(renew, tangent[i], kept[1, i])
    if solved and some(going & ~renew):
        for i in range(state.z.shape[0]):
            kept[1, size + i] = work.dz[i]
        solved = solve(t, state, work, scheme, False)
        for i in range(state.z.shape[0]):
            work.dz[i] = select(renew, kept[1, size + i], work.dz[i])
    return solved


@inner
def advance_lanes(t, state, work, kept, scheme, drive, drive_rate, tolerance, passes, ends):
    """Step the booms in all lanes that have not failed, as `time_step.advance` steps one with `keep`."""
    for i in range(drive.shape[0]):
        work.drive[i], work.drive_rate[i] = drive[i], drive_rate[i]
    start_step(scheme, state.history, work.hat, work.offset)
    predict(t, state, scheme.reach)
    correct_guess(state, work)
    place(t, state, work)
    going, left, spent, before = ends[FAILED] == 0.0, passes, 0.0, 0.0
    while left > 0 and some(going):
        renew = going & ~may_keep(work, scheme.gain)
        if some(renew):
            solved = solve_renewing(t, state, work, kept, scheme, renew, going)
        else:
            solved = solve(t, state, work, scheme, False)
        if not solved:
            break
        lead, travel = work.kept[SHARE_LEAD], work.kept[TRAVEL]
        size = add_increments(t, state, work, LONGEST_INCREMENT, going)
        place(t, state, work)
        done = is_converged(t, state, work, size, before, renew, tolerance, scheme.gain)
        work.kept[SHARE_LEAD] = select(going, work.kept[SHARE_LEAD], lead)
        work.kept[TRAVEL] = select(going, work.kept[TRAVEL], travel)
        spent = select(going, spent + 1.0, spent)
        ends[FAILED] = select(going & ~math.isfinite(size), 1.0, ends[FAILED])
        going = going & ~done & math.isfinite(size)
        before = size
        left -= 1
    ends[FAILED] = select(going, 1.0, ends[FAILED])
    ends[PASSES] += spent
    note_correction(state, work)
    work.kept[GAIN] = select(spent > (2.0 if is_rough(tolerance) else 1.0), 0.0, work.kept[GAIN])
    finish_step(scheme, work.position, work.hat, work.offset, work.velocity, work.acceleration, state.history)
    state.pace[0] = TICKS
    for i in range(drive.shape[0]):
        state.drives[0, i], state.drives[1, i] = drive[i], drive_rate[i]


@kernel
def run_lanes(tables, states, work, course, first, last, steps, counts, family, parameter, tolerance, passes):
    """`time_step.run_each` for groups `first` .. `last - 1` of a stack, the booms of a group side by side."""
    for group in range(first, last):
        t, state = referenced(tables_of(tables, group)), referenced(state_of(states, group))
        at, drives, rates, ends = 0, course.drives[group], course.rates[group], course.ends[group]
        forget_all(work)
        for row in range(steps.shape[0]):
            if row == 0 or steps[row] != steps[row - 1]:
                scheme = prepare(family, parameter, steps[row], work.weights)
            for _ in range(counts[row]):
                advance_lanes(t, state, work, course.kept, scheme, drives[at], rates[at], tolerance, passes, ends)
                at += 1
            observe_boom(t, state, course.out[group, row])
