"""What a twin leaves out while samples come faster than they are taken: shapes first, then the judgement of health.

Predictions, estimates and residuals are never left out, and do not depend on what is; but a sensor that fails meanwhile is
noticed, and no longer believed by the estimate, only afterwards.
"""

from __future__ import annotations

SHAPES_AFTER, HEALTH_AFTER = 0.5, 0.8
"""Time (s) that a sample has waited above which shapes, and the judgement of health too, are left out: below the second after
which, at 1 kHz and the usual depth of a topic, samples give way to newer ones."""


class LoadShedding:
    """Decides by how long the newest sample has waited. A replay, whose samples do not wait, leaves out nothing.

    Attributes
    ----------
    shapes, health : int
        Shapes, and looks at the rig's health, that were left out; there are ten of each in a second.
    """

    def __init__(self) -> None:
        self.shapes = self.health = 0
        self._wait = 0.0

    def waited(self, wait: float) -> None:
        """The sample that is taken next has waited for so many seconds."""
        self._wait = wait

    def leaves_out_shape(self) -> bool:
        """Whether the shape that is due is left out; counts it."""
        is_late = self._wait > SHAPES_AFTER
        self.shapes += is_late
        return is_late

    def leaves_out_health(self) -> bool:
        """Whether the look at the rig's health that is due is left out; counts it."""
        is_late = self._wait > HEALTH_AFTER
        self.health += is_late
        return is_late
