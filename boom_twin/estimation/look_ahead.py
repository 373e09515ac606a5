"""Step the boom along smoothed strokes to an anchor in the past, and from there ahead to the present.

Strokes estimated at the instant they are measured carry noise that the boom's lightly damped modes collect. The same strokes
seen 45 ms later are far quieter. So the boom that is remembered, the anchor, is stepped only as far as the smoother's
window reaches back, with strokes that will not change much any more; for every new sample a copy of it runs through the
window to now, in few long steps, and is the prediction. Nothing is delayed, and an error made in the window is forgotten with
the copy. The steps ahead of the anchor, each a little later than for the sample before, keep their tangents and the corrections
of their guesses from sample to sample.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ..compiler.plan import Plan
from ..kernels.elements.linkage import angle_of_length
from ..kernels.integrators import GENERALISED_ALPHA, REST, prepare
from ..kernels.jit import by_reference, inner, kernel, referenced
from ..kernels.result_row import estimates_in
from ..kernels.tables import OK
from ..kernels.transfer.kept_tangent import condensed_of, forget_all, keep_corrections, work_of
from ..kernels.transfer.time_step import ANEW, LONGEST_INCREMENT, advance, advance_again, observe
from ..types import Array
from .stroke_filter import FilterTuning, StrokeFilter, drive_between, lag_of, new_filter, start_filter, take_strokes

TOLERANCE = 1e-4  # rad in the last pass of a step of the anchor; what is left is about a fiftieth of its square
LOOK_TOLERANCE = 1e-3  # rad, likewise ahead of it, where an error is not remembered: nearly always a single pass
LOOK_SHARE = 0.58  # of the lag, longest step ahead of the anchor: two steps
ROUNDING = 1e-9  # s, by which stamps that are a step apart may be further apart
PASSES = np.int64(20)  # typed, because numba compiles once more for every literal
NODES = 256  # most nodes of a window; beyond 4 kHz the window gets shorter than its lag
STEPS = np.int64(4)  # ahead of the anchor, that keep tangents of their own; the last for all behind it
AHEAD_ORDER = 1.0  # corrections that a guess ahead of the anchor is corrected by: noise of the strokes is in them
REST_PASSES, REST_INCREMENT = np.int64(60), 0.1
WIDEST = math.pi  # rad, how far a rigid joint is followed beyond its range


class Tuning(NamedTuple):
    """Numbers of the estimator; see `boom_twin.config.settings`.

    strokes : of their filter. least_lag : s, that they are smoothed for at least.
    """

    strokes: FilterTuning
    least_lag: float
    step: float
    look_step: float
    rho: float


@by_reference
class Track(NamedTuple):
    """What the follower remembers besides the anchor's state.

    nodes : (1,) number of nodes in the window. passes : (1,) Newton passes for the newest sample.
    moved : (1,) whether the anchor has left its first equilibrium.
    times : (NODES,) s. bank : smoothers of the strokes. anchor : (n, 3) drive where the anchor stands.
    angles : (n,) of the rigid boom, rad. drive, rate : (n,) scratch.
    """

    nodes: np.ndarray
    passes: np.ndarray
    moved: np.ndarray
    times: Array
    bank: StrokeFilter
    anchor: Array
    angles: Array
    drive: Array
    rate: Array
    closed: Array
    lengths: Array


def new_track(plan: Plan, lengths: Array) -> Track:
    """An empty track for a compiled boom whose sections are `lengths` (m), shape (n,), long."""
    n = plan.joints
    return Track(
        nodes=np.zeros(1, np.int64), passes=np.zeros(1, np.int64), moved=np.zeros(1, np.int64), times=np.zeros(NODES),
        bank=new_filter(n, NODES), anchor=np.zeros((n, 3)), angles=np.zeros(n),
        drive=np.zeros(n), rate=np.zeros(n), closed=plan.closed_lengths, lengths=lengths,
    )  # fmt: skip


@kernel
def follow(t, anchor, live, work, tangents, track, tuning, time, y, out):
    """Take strokes y (m; NaN = missing) measured at `time` (s) and write the prediction for it.

    The first sample of a track without nodes is taken as rest, in equilibrium; `anchor` holds a first guess of it.

    out : ndarray, shape (prediction_width,): results and estimates, see `kernels.result_row`.

    Returns a status of `kernels.tables`.
    """
    add_sample(track, tuning, time, y)
    track.passes[0] = 0
    ahead, old, nodes = False, track.nodes[0] - 1, track.bank.nodes
    lag = lag_of(track.bank, tuning.strokes)
    look_step, lag = min(tuning.look_step, LOOK_SHARE * lag), max(lag, tuning.least_lag)
    boom, start, longest, tolerance, at = anchor, track.anchor, tuning.step, TOLERANCE, np.int64(0)
    may_keep = t.clearances.shape[0] == 0
    while True:
        if not ahead and not anchor_must_advance(track, lag, old, longest):
            track.nodes[0] = old + 1
            if track.moved[0] == 0:
                hold(track, nodes[old])
                for k in range(STEPS):
                    forget_all(work_of(work, tangents, k, work.condensed))
                scheme = prepare(REST, tuning.rho, tuning.step, work.weights)
                status, count, _ = advance(
                    t, anchor, work, scheme, track.drive, track.rate, TOLERANCE, REST_PASSES, REST_INCREMENT, None, ANEW
                )
                track.passes[0] += count
                if status != OK:
                    return status
            copy_state(anchor, live)
            ahead, boom, longest, tolerance, at = True, live, look_step, LOOK_TOLERANCE, np.int64(0)
        if old == 0:
            report(t, live, track, out)
            return OK
        new = next_node(track, old, longest)
        span = track.times[new] - track.times[old]
        steps = max(1, math.ceil(span / longest - 1e-6))
        scheme = prepare(GENERALISED_ALPHA, tuning.rho, span / steps, work.weights)
        for k in range(steps):
            drive_to(track, start, nodes[new], span, (k + 1) / steps)
            own = work
            if ahead:
                condensed = referenced(condensed_of(tangents, at))
                own = referenced(work_of(work, tangents, at, condensed))
                keep_corrections(own, AHEAD_ORDER)
                at = min(at + 1, STEPS - 1)
            status, count = advance_again(
                t, boom, own, scheme, track.drive, track.rate, tolerance, PASSES, LONGEST_INCREMENT, None, may_keep and ahead
            )
            track.passes[0] += count
            if status != OK:
                return status
        if not ahead:
            copy_node(nodes[new], track.anchor)
            track.moved[0] = 1
        else:
            start = nodes[new]
        old = new


@inner
def anchor_must_advance(track, lag, old, longest):
    """Whether the anchor, at the oldest node, has to go on: all of its next step is older than the lag, or room runs out."""
    return old > 1 and (track.times[0] - track.times[next_node(track, old, longest)] >= lag or old == NODES - 1)


@inner
def next_node(track, old, longest):
    """The youngest node within one step of at most `longest` ahead of `old`, at least the next one."""
    new = old - 1
    while new > 0 and track.times[new - 1] - track.times[old] <= longest + ROUNDING:
        new -= 1
    return new


@inner
def hold(track, node):
    """Take a node (n, 3) as rest: the anchor's drive, without rates."""
    for i in range(track.drive.shape[0]):
        track.anchor[i, 0], track.anchor[i, 1], track.anchor[i, 2] = node[i, 0], 0.0, 0.0
        track.drive[i], track.rate[i] = track.closed[i] + node[i, 0], 0.0


@inner
def drive_to(track, old, new, span, share):
    """Drive on the quintic between two nodes (n, 3), `span` s apart; share in [0, 1]."""
    for i in range(track.drive.shape[0]):
        position, velocity = drive_between(old[i], new[i], span, share)
        track.drive[i], track.rate[i] = track.closed[i] + position, velocity


@inner
def add_sample(track, tuning, time, y):
    """Take the sample into the smoother's window."""
    for j in range(track.nodes[0], 0, -1):
        track.times[j] = track.times[j - 1]
    track.times[0] = time
    if track.nodes[0] == 0:
        track.moved[0] = 0
        start_filter(track.bank, tuning.strokes, y)
    else:
        take_strokes(track.bank, tuning.strokes, track.nodes[0], time - track.times[1], y)
    track.nodes[0] += 1


@inner
def report(t, live, track, out):
    """Write what is predicted now; see `follow`."""
    n = t.joints.shape[0]
    observe(t, live, out)
    found = estimates_in(out, n, t.clearances.shape[0])
    for i in range(n):
        found.strokes[i], found.variances[i] = track.bank.nodes[0, i, 0], track.bank.covariance[i, 0, 0]
    found.rigid_tip[0], found.rigid_tip[1] = rigid_tip(t, track)


@inner
def copy_node(source, target):
    """Copy position, velocity and acceleration of all strokes, (n, 3)."""
    for i in range(target.shape[0]):
        for a in range(3):
            target[i, a] = source[i, a]


@kernel
def copy_state(source, target):
    """Copy everything a boom remembers."""
    for i in range(source.z.shape[0]):
        target.z[i] = source.z[i]
    copy_rows(source.history, target.history)
    copy_rows(source.frames, target.frames)
    copy_rows(source.turns, target.turns)
    copy_rows(source.pins, target.pins)
    copy_rows(source.contacts, target.contacts)
    copy_rows(source.drives, target.drives)
    target.pace[0] = source.pace[0]


@inner
def copy_rows(source, target):
    """Copy an array of two dimensions."""
    for i in range(source.shape[0]):
        for j in range(source.shape[1]):
            target[i, j] = source[i, j]


@inner
def rigid_tip(t, track):
    """Tip (m) of the undeformed boom at the newest strokes; a stroke out of reach leaves its joint where it was."""
    x, y, heading = t.joints[0].x, t.joints[0].y, 0.0
    for i in range(track.angles.shape[0]):
        length = track.closed[i] + track.bank.nodes[0, i, 0]
        angle = angle_of_length(t.linkages[i], length, track.angles[i], -WIDEST, WIDEST)
        if math.isfinite(angle):
            track.angles[i] = angle
        heading += track.angles[i]
        x += track.lengths[i] * math.cos(heading)
        y += track.lengths[i] * math.sin(heading)
    return x, y
