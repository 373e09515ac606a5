"""Tangents that are kept from step to step: modified Newton with a monitor of its convergence.

A pass with an old tangent leaves a fraction of the error, which grows with how far the boom has moved since (Deuflhard, Newton
Methods for Nonlinear Problems, 2011, section 2.1). The error after a pass is taken as

    lead * travel * size.

`size` is the largest increment of the pass. `travel` is the largest change of a coordinate since the tangent was made, plus an
equivalent of the change of the gain, so that steps of nearly equal length share a tangent. Both are angles. `lead` rises
whenever two passes of a step converge more slowly than it says.

A step ends when that error is below the larger of two bounds. The first is a tenth of the square of the tolerance, which a pass
with a new tangent would leave. The second is a fraction of the step's own error, because more exact equations make a long step
no better. At the usual tolerance of 1e-6 rad the fraction is 1e-3 from steps of 14 ms on, and 5e-6 at 1 ms. There no number
moves by more than 1e-9 of its range. The step's own error is (a' - a)/gain: a second-order scheme assumes that the acceleration
changes little within a step (Hairer, Norsett and Wanner, Solving Ordinary Differential Equations I, 1993, section II.4).

A new tangent is made after a step with more than one pass, and where `lead * travel` would exceed 0.15.

One pass nearly always suffices, because the first guess of a step is corrected by the parabola through the last three
corrections. Without it every step left an error of one sign, 1e-12 rad, which added up to 0.1 um at the tip.
"""

from __future__ import annotations

from ..integrators import A
from ..jit import inner
from ..tables import CORRECTIONS

LEAD = 4.0  # first value of `lead`
LONG_GAIN = 2e4  # 1/s^2, gain of a step of 14 ms; shorter steps may leave less, by the square of the step

# Places in `Work.kept`: gain of the tangent, or 0; lead; number of known corrections; travel after the newest pass.
GAIN, SHARE_LEAD, CORRECTED, TRAVEL = range(4)


@inner
def forget_all(work):
    """Forget tangent and corrections, because another boom or another motion begins."""
    work.kept[GAIN], work.kept[SHARE_LEAD], work.kept[CORRECTED] = 0.0, LEAD, 0.0


@inner
def forget_tangent(work):
    """Forget the tangent, so that the next step begins with a new one."""
    work.kept[GAIN] = 0.0


@inner
def may_keep(work, gain):
    """Return True if the kept tangent is good enough for a step of a scheme with `gain`."""
    near = work.kept[SHARE_LEAD] * (work.kept[TRAVEL] + detuning(work, gain)) < 0.15  # fraction of an error left by a pass
    return near & (work.kept[GAIN] != 0.0)


@inner
def detuning(work, gain):
    """Return the relative difference of the kept tangent's gain from `gain`, as travel (rad)."""
    return abs(work.kept[GAIN] - gain) / gain / LEAD


@inner
def keep_tangent(state, work, gain):
    """Store where, and for which gain, the new tangent is made."""
    work.kept[GAIN], work.kept[TRAVEL] = gain, 0.0
    for i in range(state.z.shape[0]):
        work.kept_z[i] = state.z[i]


@inner
def travel(t, state, work):
    """Return the largest change of a coordinate since the tangent was made, as an angle (rad)."""
    most = 0.0
    for i in range(state.z.shape[0]):
        most = max(most, t.scale[i] * abs(state.z[i] - work.kept_z[i]))
    return most


@inner
def step_error(t, state, work, gain):
    """Return the estimated error (rad) of a step of a scheme with `gain` (1/s^2) itself."""
    most, a = 0.0, state.history[A]
    for i in range(state.z.shape[0]):
        most = max(most, t.scale[i] * abs(state.z[i] - work.hat[i] - a[i] / gain))
    return most


@inner
def is_converged(t, state, work, size, before, renewed, tolerance, gain):
    """Return True if a pass with an increment of `size` (rad) was the last of a step.

    `before` is the increment of the pass before in this step, or 0. A new tangent (`renewed`) leaves about the square of
    `size`. Below the tolerance, an increment that does not get smaller is rounding. `gain` is that of the scheme.
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
    """Add the extrapolated correction to the guess in `state`, before the first pass of a step."""
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
    """Store the correction of the guess, after the last pass of a step."""
    for i in range(state.z.shape[0]):
        work.corrections[2, i], work.corrections[1, i] = work.corrections[1, i], work.corrections[0, i]
        work.corrections[0, i] = state.z[i] - work.guess[i]
    work.kept[CORRECTED] = min(work.kept[CORRECTED] + 1.0, 1.0 * CORRECTIONS)
