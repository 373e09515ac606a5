"""One case of the stability study."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

from .stability_motions import Setup

Truth = Literal["fine steps", "equilibrium", "swing", "none"]
"""What is right: the default method at an eighth of the step; the equilibrium of the last strokes; a vibration that does not
grow about a mean that stays; nothing, because there is no solution."""


@dataclass(frozen=True)
class Case:
    """One row of the matrix.

    Attributes
    ----------
    group, name : str
    varied : str
        How scene, motion or step are derived.
    make : callable
        Returns the `Setup`.
    truth : Truth
    quick : bool
        Whether it belongs to the quick subset.
    """

    group: str
    name: str
    varied: str
    make: Callable[[], Setup]
    truth: Truth = "fine steps"
    quick: bool = False


def short(value: float) -> str:
    """A power of ten times a digit: 1e-6, 5e-2, 1e13."""
    digit, _, power = f"{value:.0e}".partition("e")
    return f"{digit}e{int(power)}"
