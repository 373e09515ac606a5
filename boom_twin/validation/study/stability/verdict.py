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
        What the motion itself gave reason to doubt, see `analysis.error_estimate`.
    error : float
        Largest error of the tip, as a share of the tip's path.
    acceleration, force : float
        Error of the tip's acceleration, rms over its own rms; of the cylinder forces, rms over the largest.
    ringing, force_ringing : float
        Part that changes sign from step to step, rms after the drives hold, as a share of the peak: of the tip's acceleration;
        of the cylinder forces.
    growth : float
        Vibration in the last quarter of the hold over that in the first, as a multiple of what is right.
    drift : float
        From the equilibrium, or of the mean, at the end of a long hold, as a share of the tip's path.
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
    """`silent`: the numbers are wrong, the status says "ok" and nothing is doubted."""

    word: Word
    symptom: str
    silent: bool = False


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
    """The verdict on `facts`, by `BOUNDS`."""
    if facts.status != "ok":
        return CaseVerdict("fails" if facts.solvable else "refuses", facts.status)
    told = f" (it says: {facts.doubt})" if facts.doubt else ""
    if not facts.solvable:
        return CaseVerdict("fails", "gives numbers where there is no solution" + told, silent=not facts.doubt)
    beyond = {name: _grade(name, getattr(facts, name)) for name in BOUNDS}
    symptoms = {
        grade: [BOUNDS[name][2].format(_shown(getattr(facts, name))) for name, own in beyond.items() if own == grade]
        for grade in ("fails", "degrades")
    }
    if symptoms["fails"]:
        return CaseVerdict("fails", "; ".join(symptoms["fails"] + symptoms["degrades"]) + told, silent=not facts.doubt)
    if symptoms["degrades"]:
        return CaseVerdict("degrades", "; ".join(symptoms["degrades"]) + told)
    return CaseVerdict("holds", "")


def _grade(name: str, value: float) -> Word:
    """Return the grade of a value. Infinite is beyond every bound; NaN is a quantity without meaning here."""
    degrades, fails, _ = BOUNDS[name]
    if value > fails or math.isinf(value):
        return "fails"
    return "degrades" if value > degrades else "holds"


def _shown(value: float) -> str:
    return f"{float(f'{value:.2g}'):g}"


Mask = NDArray[np.bool_]

QUIET = 1e-3  # share of the peak acceleration below which vibration is not followed
IMPULSE = 0.05  # s after a jump of speed
WRONG = 0.05  # of the largest cylinder force, above which an impulse still rings
SHORTEST_PATH = 1e-9  # m


def against_motion(found: MethodRun, right: MethodRun, still: float, jump: float = math.nan) -> Facts:
    """Compare with a motion at the same rows; the drives hold from `still` (s) on.

    Accelerations and forces are not compared right after a `jump` (s) of speed, where they are impulses.
    """
    path, late = _path(right), right.times > still
    smooth = ~(np.abs(right.times - jump - 0.5 * IMPULSE) <= 0.5 * IMPULSE + 1e-9)
    shares = _rings(found, right, late & smooth)
    return Facts(
        found.status,
        doubt=found.doubt,
        error=_largest(found.tip - right.tip) / path,
        acceleration=_rms((found.tip_acceleration - right.tip_acceleration)[smooth])
        / max(_rms(right.tip_acceleration[smooth]), 1e-12),
        force=_rms((found.cylinder_forces - right.cylinder_forces)[smooth])
        / max(_largest(right.cylinder_forces[smooth]), 1e-12),
        ringing=shares[0],
        force_ringing=shares[1],
        growth=growth(found, still) / max(growth(right, still), 1e-3),
        lasting=_lasting(found, right, jump, smooth),
        passes=found.passes,
    )


def _lasting(found: MethodRun, right: MethodRun, jump: float, smooth: Mask) -> float:
    """Rows from a jump of speed to the last one where cylinder forces are wrong; NaN without a jump."""
    if math.isnan(jump):
        return math.nan
    wrong = np.linalg.norm(found.cylinder_forces - right.cylinder_forces, axis=1)
    beyond = (wrong > WRONG * _largest(right.cylinder_forces[smooth])) & (right.times >= jump - 1e-9)
    return float((right.times[beyond].max() - jump) / right.times[1]) if beyond.any() else 0.0


def against_rest(found: MethodRun, equilibrium: Array | None, still: float, every: int = 1) -> Facts:
    """Compare the end of a long hold with the `equilibrium` of the tip (m), shape (2,), or without one the mean with itself.

    `every` steps lie between rows; ringing is seen only where there is a row for each.
    """
    late = np.flatnonzero(found.times > still)
    first, last = late[: len(late) // 4], late[-(len(late) // 4) :]
    away = found.tip[-1] - equilibrium if equilibrium is not None else found.tip[last].mean(0) - found.tip[first].mean(0)
    shares = _rings(found, None, found.times > still) if every == 1 else (math.nan, math.nan)
    return Facts(
        found.status,
        doubt=found.doubt,
        drift=float(np.linalg.norm(away)) / _path(found),
        ringing=shares[0],
        force_ringing=shares[1],
        growth=growth(found, still),
        passes=found.passes,
    )


def growth(motion: MethodRun, still: float) -> float:
    """Vibration of the tip's acceleration in the last quarter of the hold over that in the first; 1 where it is still."""
    late = np.flatnonzero(motion.times > still)
    quarter = max(len(late) // 4, 1)
    first, last = (_spread(motion.tip_acceleration[rows]) for rows in (late[:quarter], late[-quarter:]))
    if last <= QUIET * _largest(motion.tip_acceleration):
        return 1.0
    return last / first if first > 0.0 else math.inf


def alternating(values: Array) -> Array:
    """The part of rows (m, c) that changes sign from row to row, (m - 2, c); a smooth curve leaves next to nothing."""
    return np.asarray(0.25 * (2.0 * values[1:-1] - values[2:] - values[:-2]))


def _rings(found: MethodRun, right: MethodRun | None, late: Mask) -> tuple[float, float]:
    """Ringing of tip acceleration and cylinder forces in the rows `late`, beyond that of what is right."""
    shares = []
    for name in ("tip_acceleration", "cylinder_forces"):
        own = getattr(found, name)
        other = np.zeros_like(own) if right is None else getattr(right, name)
        peak = _largest(other if right is not None else own)
        ring = alternating((own - other)[late])
        shares.append(_rms(ring) / max(peak, 1e-12))
    return shares[0], shares[1]


def _spread(values: Array) -> float:
    return _rms(values - values.mean(0))


def _rms(values: Array) -> float:
    """Return the rms length of the rows (m, c); infinite if any is not finite, 0 without rows."""
    if not values.size:
        return 0.0
    return float(np.sqrt(np.mean(np.sum(values**2, axis=-1)))) if np.isfinite(values).all() else math.inf


def _path(motion: MethodRun) -> float:
    """Return the largest distance of the tip from where it starts, m."""
    return max(_largest(motion.tip - motion.tip[0]), SHORTEST_PATH)


def _largest(values: Array) -> float:
    """Largest length of the rows; infinite if any is not finite."""
    sizes = np.linalg.norm(values, axis=-1)
    return float(sizes.max()) if np.isfinite(sizes).all() else math.inf
