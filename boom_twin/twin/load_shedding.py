"""What a twin leaves out while samples come faster than they are taken: shapes first, then the judgement of health.

Predictions, estimates and residuals are never left out, and do not depend on what is; but a sensor that fails meanwhile is
noticed, and no longer believed by the estimate, only afterwards.
"""

from __future__ import annotations

SHAPES_ABOVE, HEALTH_ABOVE = 0.5, 0.75
"""Share of the queue of samples that is filled, above which shapes and then health too are left out; at 1 samples are lost."""


class LoadShedding:
    """Decides by how full the queue is that samples are taken from. A replay has none, and leaves out nothing.

    Attributes
    ----------
    shapes, health : int
        Shapes, and looks at the rig's health, that were left out; there are ten of each in a second.
    """

    def __init__(self) -> None:
        self.shapes = self.health = 0
        self._share = 0.0

    def filled(self, share: float) -> None:
        """The queue is so full, 0 to 1, when the next sample is taken."""
        self._share = share

    def leaves_out_shape(self) -> bool:
        """Whether the shape that is due is left out; counts it."""
        is_due = self._share > SHAPES_ABOVE
        self.shapes += is_due
        return is_due

    def leaves_out_health(self) -> bool:
        """Whether the look at the rig's health that is due is left out; counts it."""
        is_due = self._share > HEALTH_ABOVE
        self.health += is_due
        return is_due
