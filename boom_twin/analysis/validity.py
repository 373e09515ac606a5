"""Where the model ends: deflections for which few shapes a part, and strokes taken for small compressions, are not meant."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..errors import UsageError
from ..records import Array
from ..scene.kinematics import joint_angles_of_strokes
from ..scene.parts import Scene
from .posture import rigid_tip

SHARE = 0.5  # of the boom's reach, most that the tip may be off the undeformed boom's
INSTANTS = 8  # of a motion, evenly spaced, at which that is looked at; and where the tip is farthest from its start


def beyond_validity(scene: Scene, away: float) -> tuple[str, ...]:
    """A sentence if a tip `away` (m) from the undeformed boom's is outside the model's validity."""
    if away <= SHARE * scene.reach:
        return ()
    return (
        f"the tip is {away:.3g} m from where rigid sections and cylinders would have it, more than half the reach of "
        f"{scene.reach:.3g} m: outside the model's validity. Check stiffnesses, masses and load",
    )


def motion_beyond_validity(scene: Scene, strokes: Array, tip: Array, angles: Array | None) -> tuple[str, ...]:
    """The same for the worst of some instants of a motion; strokes (m, n), tip (m, 2) in m; angles (n,) near the first, rad."""
    rows: NDArray[np.int64] = np.linspace(0, len(tip) - 1, INSTANTS).astype(np.int64)
    rows = np.unique(np.append(rows, np.argmax(np.hypot(*(tip - tip[0]).T))))
    worst, near = 0.0, angles
    for row in rows:
        try:
            near = joint_angles_of_strokes(scene, strokes[row], near=near)
        except UsageError:  # in the cylinder's travel, but out of the joint's range
            continue
        worst = max(worst, float(np.hypot(*(tip[row] - rigid_tip(scene, near)))))
    return beyond_validity(scene, worst)
