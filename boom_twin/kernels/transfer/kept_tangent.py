"""Tangents that are kept from step to step: modified Newton with a monitor of its convergence.

A pass with the tangent of an earlier place leaves a share of the error that it finds, about as large as the boom has turned
and bent since (Deuflhard, Newton Methods for Nonlinear Problems, 2011, section 2.1). So the error after a pass is

    share times size,    share = lead times travel,

size being the pass's largest increment, travel the largest change of a coordinate since the tangent was made, both as angles,
and `lead` a number that is raised whenever two passes of a step show more. Passes follow until that is below a tenth of the
square of the tolerance, which is what a pass with a new tangent would leave, or below a share of what the step itself is off
by: solving the equations of a long step more exactly makes nothing better. At the usual tolerance of 1e-6 rad that share is a
thousandth from 14 ms on, and 5e-6 at 1 ms, where no number moves by more than 1e-9 of its range. After a step with more than
one pass the next begins with a new tangent, and so does a pass where the share would be above 0.15.

Steps of nearly the same length share a tangent, too, so that stamps need not be even: what another gain leaves counts as so
much more travel.

A second-order step takes the acceleration as changing little within it; what its change a' - a moves in the step, (a' - a)/gain
with 1/gain about a quarter of the step's square, is of the size of the step's own error (Hairer, Norsett and Wanner, Solving
Ordinary Differential Equations I, 1993, section II.4).

That one pass nearly always suffices is because a step's guess is corrected as the last ones had to be, by the parabola through
the corrections of three steps. Without it an error of one sign was left in every step, 1e-12 rad of which the tip collects to
0.1 um.
"""

from __future__ import annotations

from ..integrators import A
from ..jit import inner
from ..tables import CORRECTIONS

LEAD = 4.0  # at first
LONG_GAIN = 2e4  # 1/s^2, of a long step: one of 14 ms. Of shorter ones less may be left, by the square of the step

# Of `Work.kept`: gain that the tangent is for, or 0; lead; how many corrections are known; travel after the newest pass.
GAIN, SHARE_LEAD, CORRECTED, TRAVEL = range(4)


@inner
def forget_all(work):
    """Forget tangent and corrections, for another boom or another motion begins."""
    work.kept[GAIN], work.kept[SHARE_LEAD], work.kept[CORRECTED] = 0.0, LEAD, 0.0


@inner
def forget_tangent(work):
    """Forget the tangent, so that the next step begins with a new one."""
    work.kept[GAIN] = 0.0


@inner
def may_keep(work, gain):
    """Return True if the kept tangent is good enough for a step of a scheme with `gain`."""
    near = work.kept[SHARE_LEAD] * (work.kept[TRAVEL] + detuning(work, gain)) < 0.15  # of an error that a pass may leave
    return near & (work.kept[GAIN] != 0.0)


@inner
def detuning(work, gain):
    """Return how far the gain of the kept tangent is off `gain`, as the travel (rad) that at first counts as much."""
    return abs(work.kept[GAIN] - gain) / gain / LEAD


@inner
def keep_tangent(state, work, gain):
    """Note that tangents are made here, for `gain`."""
    work.kept[GAIN], work.kept[TRAVEL] = gain, 0.0
    for i in range(state.z.shape[0]):
        work.kept_z[i] = state.z[i]


@inner
def travel(t, state, work):
    """Largest change of a coordinate since tangents were made, as an angle (rad)."""
    most = 0.0
    for i in range(state.z.shape[0]):
        most = max(most, t.scale[i] * abs(state.z[i] - work.kept_z[i]))
    return most


@inner
def step_error(t, state, work, gain):
    """About how far a step of a scheme with `gain` (1/s^2) is off by itself (rad), see above."""
    most, a = 0.0, state.history[A]
    for i in range(state.z.shape[0]):
        most = max(most, t.scale[i] * abs(state.z[i] - work.hat[i] - a[i] / gain))
    return most


@inner
def is_converged(t, state, work, size, before, renewed, tolerance, gain):
    """Return True if a pass with an increment of `size` (rad) was the last of a step.

    before : increment of the pass before it in this step, or 0. renewed : whether the tangent was new, so that what is left is
    about the square of `size`. Below the tolerance an increment that does not get smaller is rounding. gain : of the scheme.
    """
    way = work.kept[TRAVEL] = travel(t, state, work)
    way += detuning(work, gain)
    if before > 1e-7 and way > 0.0:  # rad; below it a share is rounding
        work.kept[SHARE_LEAD] = max(work.kept[SHARE_LEAD], size / before / way)
    rounding = (size > 0.5 * before) & (before > 0.0)
    share = 1e3 * tolerance * min(1.0, LONG_GAIN / gain)  # of the step's own error
    left = max(0.1 * tolerance * tolerance, 1e-15, share * step_error(t, state, work, gain))
    return (work.kept[SHARE_LEAD] * way * size < left) | ((size < tolerance) & (rounding | renewed))


@inner
def correct_guess(state, work):
    """Correct the guess in `state` as the last ones had to be; before the first pass of a step."""
    known, c = work.kept[CORRECTED], work.corrections
    for i in range(state.z.shape[0]):
        work.guess[i] = state.z[i]
        if known == 1.0:
            state.z[i] += c[0, i]
        elif known == 2.0:
            state.z[i] += 2.0 * c[0, i] - c[1, i]
        elif known == 3.0:
            state.z[i] += 3.0 * (c[0, i] - c[1, i]) + c[2, i]


@inner
def note_correction(state, work):
    """Note by how much the guess was off, after the last pass of a step."""
    for i in range(state.z.shape[0]):
        work.corrections[2, i], work.corrections[1, i] = work.corrections[1, i], work.corrections[0, i]
        work.corrections[0, i] = state.z[i] - work.guess[i]
    work.kept[CORRECTED] = min(work.kept[CORRECTED] + 1.0, 1.0 * CORRECTIONS)
