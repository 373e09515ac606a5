"""Verdict of the stability study on a method (holds, degrades, fails or refuses), with the symptom."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from ...analysis.methods import MethodRun
from ...types import Array

Word = Literal["holds", "degrades", "fails", "refuses"]
Mask = NDArray[np.bool_]
IMPULSE = 0.05  # s after a speed jump in which accelerations and forces are not compared
TINY = 1e-12  # m/s^2 or N, least divisor


@dataclass(frozen=True)
class Facts:
    """Deviations of a motion from its reference. A quantity that does not apply to the case is NaN."""

    status: str  # "ok", or the reason for an early end of the motion
    solvable: bool = True  # True if a solution exists
    doubt: str = ""  # warning of the simulation, see `analysis.doubts`
    error: float = math.nan  # largest tip error, relative to the tip's path
    acceleration: float = math.nan  # rms error of the tip acceleration, relative to its rms
    force: float = math.nan  # rms error of the cylinder forces, relative to the largest
    ringing: float = math.nan  # rms of what alternates from step to step while the drives hold, relative to the peak
    force_ringing: float = math.nan  # likewise of the cylinder forces
    growth: float = math.nan  # ratio of vibration in the last quarter of the hold to the first, relative to the reference's
    drift: float = math.nan  # distance from equilibrium, or shift of the mean, after a long hold, over the path
    lasting: float = math.nan  # steps after a speed jump until cylinder forces are correct again
    passes: float = math.nan  # of Newton's method per step

    @property
    def verdict(self) -> CaseVerdict:
        """Return the verdict by `BOUNDS`. Infinite values exceed every bound; NaN exceeds none."""
        if self.status != "ok":
            return CaseVerdict("fails" if self.solvable else "refuses", self.status)
        warned = f" (it says: {self.doubt})" if self.doubt else ""
        if not self.solvable:
            return CaseVerdict("fails", "gives numbers where there is no solution" + warned, silent=not self.doubt)
        failing, degrading = list[str](), list[str]()
        for name, (degrades, fails, symptom) in BOUNDS.items():
            value = getattr(self, name)
            beyond = failing if value > fails or math.isinf(value) else degrading if value > degrades else None
            if beyond is not None:
                beyond.append(symptom.format(f"{float(f'{value:.2g}'):g}"))
        if not failing and not degrading:
            return CaseVerdict("holds", "")
        return CaseVerdict(
            "fails" if failing else "degrades", "; ".join(failing + degrading) + warned, bool(failing) and not self.doubt
        )


@dataclass(frozen=True)
class CaseVerdict:
    """Verdict with its symptom. `silent` is True if the numbers are wrong without a bad status or a warning."""

    word: Word
    symptom: str
    silent: bool = False

    @property
    def mark(self) -> str:
        return "silent" if self.silent else self.word


# quantity: (degrades above, fails above, symptom)
BOUNDS: dict[str, tuple[float, float, str]] = {
    "error": (1e-2, 1e-1, "tip wrong by {} of its path"),
    "acceleration": (5e-2, 1.0, "tip acceleration wrong by {} of its rms"),
    "force": (1e-2, 1e-1, "cylinder forces wrong by {} of the largest"),
    "drift": (1e-4, 1e-2, "tip drifts by {} of its path"),
    "growth": (1.2, 3.0, "vibration grows {}-fold while the drives hold"),
    "ringing": (2e-2, 0.5, "tip acceleration rings from step to step, {} of its peak"),
    "force_ringing": (2e-2, 0.5, "cylinder forces ring from step to step, {} of their peak"),
    "lasting": (10.0, math.inf, "cylinder forces are wrong for {} steps after the jump of speed"),
    "passes": (6.0, math.inf, "slow Newton: {} passes a step"),
}


def against_motion(found: MethodRun, right: MethodRun, still: float, jump: float = math.nan) -> Facts:
    """Return the deviations from the reference motion `right` at the same rows; the drives hold from `still` (s) on.

    Accelerations and forces are not compared just after a speed jump at time `jump` (s), because they are impulses there.
    """
    smooth = ~(np.abs(right.times - jump - 0.5 * IMPULSE) <= 0.5 * IMPULSE + 1e-9)
    acceleration, force = right.tip_acceleration[smooth], right.cylinder_forces[smooth]
    ringing = _rings(found, right, (right.times > still) & smooth)
    return Facts(
        found.status,
        doubt=found.doubt,
        error=_largest(found.tip - right.tip) / _path(right),
        acceleration=_rms(found.tip_acceleration[smooth] - acceleration) / max(_rms(acceleration), TINY),
        force=_rms(found.cylinder_forces[smooth] - force) / max(_largest(force), TINY),
        ringing=ringing[0],
        force_ringing=ringing[1],
        growth=growth(found, still) / max(growth(right, still), 1e-3),
        lasting=_lasting(found, right, jump, _largest(force)),
        passes=found.passes,
    )


def _lasting(found: MethodRun, right: MethodRun, jump: float, largest: float) -> float:
    """Return the rows from a speed jump to the last cylinder force wrong by 5 % of the largest; NaN without a jump."""
    if math.isnan(jump):
        return math.nan
    wrong = np.linalg.norm(found.cylinder_forces - right.cylinder_forces, axis=1) > 0.05 * largest
    late = right.times[wrong & (right.times >= jump - 1e-9)]
    return float((late.max() - jump) / right.times[1]) if late.size else 0.0


def against_rest(found: MethodRun, equilibrium: Array | None, still: float) -> Facts:
    """Return the deviations at the end of a long hold from the tip's `equilibrium` (m), shape (2,).

    If that is None, drift is the shift of the mean over the hold.
    """
    late = np.flatnonzero(found.times > still)
    first, last = late[: len(late) // 4], late[-(len(late) // 4) :]
    away = found.tip[-1] - equilibrium if equilibrium is not None else found.tip[last].mean(0) - found.tip[first].mean(0)
    ringing = _rings(found, None, found.times > still)
    return Facts(
        found.status,
        doubt=found.doubt,
        drift=float(np.linalg.norm(away)) / _path(found),
        ringing=ringing[0],
        force_ringing=ringing[1],
        growth=growth(found, still),
        passes=found.passes,
    )


def growth(motion: MethodRun, still: float) -> float:
    """Return the ratio of tip acceleration vibration in the last quarter of the hold to the first.

    It is 1 for a boom that is still: below a thousandth of the largest acceleration.
    """
    late = np.flatnonzero(motion.times > still)
    quarter = max(len(late) // 4, 1)
    first, last = (motion.tip_acceleration[rows] for rows in (late[:quarter], late[-quarter:]))
    before, after = (_rms(values - values.mean(0)) for values in (first, last))
    if after <= 1e-3 * _largest(motion.tip_acceleration):
        return 1.0
    return after / before if before > 0.0 else math.inf


def alternating(values: Array) -> Array:
    """Return the row-to-row alternating part of `values` (m, c), shape (m - 2, c); nearly zero for a smooth curve."""
    return np.asarray(0.25 * (2.0 * values[1:-1] - values[2:] - values[:-2]))


def _rings(found: MethodRun, right: MethodRun | None, late: Mask) -> tuple[float, float]:
    """Return the ringing of tip acceleration and cylinder forces in rows `late`, after subtraction of the reference."""

    def ring(own: Array, other: Array | None) -> float:
        more = own if other is None else own - other
        return _rms(alternating(more[late])) / max(_largest(own if other is None else other), TINY)

    return (
        ring(found.tip_acceleration, None if right is None else right.tip_acceleration),
        ring(found.cylinder_forces, None if right is None else right.cylinder_forces),
    )


def _rms(values: Array) -> float:
    """Return the rms norm of the rows (m, c); infinite if any value is not finite, 0 without rows."""
    if not values.size:
        return 0.0
    return float(np.sqrt(np.mean(np.sum(values**2, axis=-1)))) if np.isfinite(values).all() else math.inf


def _path(motion: MethodRun) -> float:
    """Return the largest distance of the tip from its start, m."""
    return max(_largest(motion.tip - motion.tip[0]), 1e-9)


def _largest(values: Array) -> float:
    """Return the largest norm of the rows; infinite if any value is not finite."""
    sizes = np.linalg.norm(values, axis=-1)
    return float(sizes.max()) if np.isfinite(sizes).all() else math.inf
