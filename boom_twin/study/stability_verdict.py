"""Verdict on a method in a case: holds, degrades, fails or refuses, with the symptom in words."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

Word = Literal["holds", "degrades", "fails", "refuses"]


@dataclass(frozen=True)
class Facts:
    """What a motion shows against what is right. NaN where a quantity has no meaning in the case.

    Attributes
    ----------
    status : str
        "ok", or why the motion did not start or ended.
    solvable : bool
        Whether there is a solution at all.
    doubt : str
        What the motion itself gave reason to doubt, see `analysis.doubt`.
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
class Verdict:
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


def verdict(facts: Facts) -> Verdict:
    """The verdict on `facts`, by `BOUNDS`."""
    if facts.status != "ok":
        return Verdict("fails" if facts.solvable else "refuses", facts.status)
    told = f" (it says: {facts.doubt})" if facts.doubt else ""
    if not facts.solvable:
        return Verdict("fails", "gives numbers where there is no solution" + told, silent=not facts.doubt)
    beyond = {name: _grade(name, getattr(facts, name)) for name in BOUNDS}
    symptoms = {
        grade: [BOUNDS[name][2].format(_shown(getattr(facts, name))) for name, own in beyond.items() if own == grade]
        for grade in ("fails", "degrades")
    }
    if symptoms["fails"]:
        return Verdict("fails", "; ".join(symptoms["fails"] + symptoms["degrades"]) + told, silent=not facts.doubt)
    if symptoms["degrades"]:
        return Verdict("degrades", "; ".join(symptoms["degrades"]) + told)
    return Verdict("holds", "")


def _grade(name: str, value: float) -> Word:
    """Infinite is beyond every bound; NaN is a quantity without meaning here."""
    degrades, fails, _ = BOUNDS[name]
    if value > fails or math.isinf(value):
        return "fails"
    return "degrades" if value > degrades else "holds"


def _shown(value: float) -> str:
    return f"{float(f'{value:.2g}'):g}"
