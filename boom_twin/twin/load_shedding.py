"""Load shedding of a twin whose samples queue up: it skips shapes first, then the judgement of health.

Predictions, estimates and residuals are never skipped, and do not depend on what is. A sensor that fails meanwhile is detected
late: until then the estimate still uses it.
"""

from __future__ import annotations

SHAPES_ABOVE, HEALTH_ABOVE = 0.5, 0.75
"""Share of the queue of samples that is filled, above which shapes and then health too are left out; at 1 samples are lost."""


class LoadShedding:
    """Decision, by the fill level of the sample queue, what to skip; `shapes` and `health` count what was left out.

    A replay has no queue and skips nothing.
    """

    def __init__(self) -> None:
        self.shapes = self.health = 0
        self._share = 0.0

    def filled(self, share: float) -> None:
        """Set the fill level of the queue, 0 to 1, when the next sample is taken."""
        self._share = share

    def leaves_out_shape(self) -> bool:
        """Return True if the shape that is due must be skipped; count it."""
        is_due = self._share > SHAPES_ABOVE
        self.shapes += is_due
        return is_due

    def leaves_out_health(self) -> bool:
        """Return True if the judgement of the rig's health that is due must be skipped; count it."""
        is_due = self._share > HEALTH_ABOVE
        self.health += is_due
        return is_due
