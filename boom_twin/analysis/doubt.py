"""What the accelerations of a tip, step by step, give reason to doubt: a step too coarse for the motion, and ringing."""

from __future__ import annotations

COARSE = 0.01  # estimated error as a share of the tip's travel
SHORTEST = 1e-3  # m of travel that an error is measured against at least
RINGING = 1.0  # sum of the changes of acceleration over that of the accelerations: 2 if it changes sign from step to step
QUIET = 1e-3  # m/s^2, mean acceleration below which ringing is rounding


def doubt(jolt: float, shake: float, travel: float, square: float) -> str:
    """A sentence with its remedy, or nothing.

    One step of a second-order scheme errs by about h^2/12 |a' - a|.

    Parameters
    ----------
    jolt, shake : float
        Sums over all steps of h^2 |a' - a| and of h^2 |a'| (m), as `chain.step.run` returns them.
    travel : float
        How far the tip got from where it started, m.
    square : float
        Sum over all steps of h^2, s^2.
    """
    share = jolt / 12.0 / max(travel, SHORTEST)
    if jolt > RINGING * shake and shake > QUIET * square:
        return "the accelerations change sign from step to step; take more numerical damping, a rho well below 1"
    if share > COARSE:
        return f"the step is coarse: the tip may be wrong by about {min(share, 1.0):.0%} of its path; take a smaller step"
    return ""
