"""Verdict of the stability study: whether a method holds, degrades, fails or refuses, with the symptom."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from ....analysis.methods import MethodRun
from ....types import Array

Word = Literal["holds", "degrades", "fails", "refuses"]
Mask = NDArray[np.bool_]
QUIET = 1e-3  # share of the peak acceleration below which vibration is not followed
IMPULSE = 0.05  # s after a jump of speed
WRONG = 0.05  # of the largest cylinder force, above which an impulse still rings
SHORTEST_PATH = 1e-9  # m
TINY = 1e-12  # m/s^2 or N, instead of a zero to divide by


@dataclass(frozen=True)
class Facts:
    """Deviations of a motion from its reference. NaN where a quantity has no meaning in the case.

    Attributes
    ----------
    status : str
        "ok", or why the motion did not start or ended.
    solvable : bool
        Whether there is a solution at all.
    doubt : str
        Warning of the motion itself, see `analysis.error_estimate`.
    error : float
        Largest error of the tip, as a share of the tip's path.
    acceleration, force : float
        Error of the tip's acceleration, rms over its own rms; of the cylinder forces, rms over the largest.
    ringing, force_ringing : float
        Part that changes sign from step to step, rms after the drives hold, as a share of the peak.
    growth : float
        Vibration in the last quarter of the hold over that in the first, as a multiple of the reference's.
    drift : float
        Distance from the equilibrium, or way of the mean, at the end of a long hold, as a share of the tip's path.
    lasting : float
        Steps after a jump of speed until cylinder forces are right again.
    passes : float
        Newton passes per step.
    """

    status: str
    solvable: bool = True
    doubt: str = ""
    error: float = math.nan
    acceleration: float = math.nan
    force: float = math.nan
    ringing: float = math.nan
    force_ringing: float = math.nan
    growth: float = math.nan
    drift: float = math.nan
    lasting: float = math.nan
    passes: float = math.nan


@dataclass(frozen=True)
class CaseVerdict:
    """Verdict with its symptom; `silent`: the numbers are wrong, the status is "ok" and there is no warning."""

    word: Word
    symptom: str
    silent: bool = False

    @property
    def mark(self) -> str:
        """Return the word of the verdict, or "silent"."""
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


def verdict(facts: Facts) -> CaseVerdict:
    """Return the verdict on `facts` by `BOUNDS`; an infinite value is beyond every bound, NaN within."""
    if facts.status != "ok":
        return CaseVerdict("fails" if facts.solvable else "refuses", facts.status)
    warned = f" (it says: {facts.doubt})" if facts.doubt else ""
    if not facts.solvable:
        return CaseVerdict("fails", "gives numbers where there is no solution" + warned, silent=not facts.doubt)
    failing, degrading = list[str](), list[str]()
    for name, (degrades, fails, symptom) in BOUNDS.items():
        value = getattr(facts, name)
        beyond = failing if value > fails or math.isinf(value) else degrading if value > degrades else None
        if beyond is not None:
            beyond.append(symptom.format(f"{float(f'{value:.2g}'):g}"))
    if not failing and not degrading:
        return CaseVerdict("holds", "")
    return CaseVerdict(
        "fails" if failing else "degrades", "; ".join(failing + degrading) + warned, bool(failing) and not facts.doubt
    )


def against_motion(found: MethodRun, right: MethodRun, still: float, jump: float = math.nan) -> Facts:
    """Compare with a motion at the same rows; the drives hold from `still` (s) on.

    Accelerations and forces are not compared right after a `jump` (s) of speed, where they are impulses.
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
    """Return the rows from a jump of speed to the last one where cylinder forces are wrong; NaN without a jump."""
    if math.isnan(jump):
        return math.nan
    wrong = np.linalg.norm(found.cylinder_forces - right.cylinder_forces, axis=1) > WRONG * largest
    late = right.times[wrong & (right.times >= jump - 1e-9)]
    return float((late.max() - jump) / right.times[1]) if late.size else 0.0


def against_rest(found: MethodRun, equilibrium: Array | None, still: float, every: int = 1) -> Facts:
    """Compare the end of a long hold with the `equilibrium` of the tip (m), shape (2,), or without one the mean with itself.

    `every` steps lie between rows; ringing is seen only where there is a row for each.
    """
    late = np.flatnonzero(found.times > still)
    first, last = late[: len(late) // 4], late[-(len(late) // 4) :]
    away = found.tip[-1] - equilibrium if equilibrium is not None else found.tip[last].mean(0) - found.tip[first].mean(0)
    ringing = _rings(found, None, found.times > still) if every == 1 else (math.nan, math.nan)
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
    """Return the vibration of the tip's acceleration in the last quarter of the hold over that in the first; 1 where still."""
    late = np.flatnonzero(motion.times > still)
    quarter = max(len(late) // 4, 1)
    first, last = (motion.tip_acceleration[rows] for rows in (late[:quarter], late[-quarter:]))
    before, after = (_rms(values - values.mean(0)) for values in (first, last))
    if after <= QUIET * _largest(motion.tip_acceleration):
        return 1.0
    return after / before if before > 0.0 else math.inf


def alternating(values: Array) -> Array:
    """Return the part of rows (m, c) that changes sign from row to row, (m - 2, c); nearly zero for a smooth curve."""
    return np.asarray(0.25 * (2.0 * values[1:-1] - values[2:] - values[:-2]))


def _rings(found: MethodRun, right: MethodRun | None, late: Mask) -> tuple[float, float]:
    """Return the ringing of tip acceleration and cylinder forces in the rows `late`, beyond that of the reference."""

    def ring(own: Array, other: Array | None) -> float:
        more = own if other is None else own - other
        return _rms(alternating(more[late])) / max(_largest(own if other is None else other), TINY)

    return (
        ring(found.tip_acceleration, None if right is None else right.tip_acceleration),
        ring(found.cylinder_forces, None if right is None else right.cylinder_forces),
    )


def _rms(values: Array) -> float:
    """Return the rms length of the rows (m, c); infinite if any is not finite, 0 without rows."""
    if not values.size:
        return 0.0
    return float(np.sqrt(np.mean(np.sum(values**2, axis=-1)))) if np.isfinite(values).all() else math.inf


def _path(motion: MethodRun) -> float:
    """Return the largest distance of the tip from where it starts, m."""
    return max(_largest(motion.tip - motion.tip[0]), SHORTEST_PATH)


def _largest(values: Array) -> float:
    """Return the largest length of the rows; infinite if any is not finite."""
    sizes = np.linalg.norm(values, axis=-1)
    return float(sizes.max()) if np.isfinite(sizes).all() else math.inf
