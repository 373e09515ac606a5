"""Faults that a session of the virtual rig can be given, named as alarms name their causes.

==============================  =========  ======================================================================
cause                           kind       size
==============================  =========  ======================================================================
``cylinder_i.k``                softer     share of the oil spring that is lost
``section_i.EI``                softer     share of the bending stiffness that is lost
``tip.payload``                 more       kg
``line_fill``                   more       kg/m
``cylinder_i.rod.clearance``    play       radial clearance of the rod pin, m
``joint_i.sensor``              bias       rad (of a ``cylinder_i.sensor``: m)
(``cylinder_i.sensor``)         drift      rad/s (m/s)
..                              scale      share by which it reads too much
..                              stuck      none: it repeats the last reading before the onset
..                              noisy      factor on the noise
..                              spikes     rad (m), up or down, of one reading in fifty
..                              dropout    share of readings without a value
``joint_angles.delay``          late       s by which stamps come after the reading
``joint_angles.dropout``        missing    share of messages that are not there (``cylinder_strokes.dropout`` too)
==============================  =========  ======================================================================

The first five are physical: they are in the scene that is simulated, from the start. The others are of sensors, from their
onset on.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass

from ..errors import UsageError
from ..scene.parts import Scene

_ANY, _MORE, _FACTOR = "finite and not 0", "above 0", "above 1"
_SHARE, _LOSS, _PLAY = "above 0 and at most 1, a share", "above 0 and below 1, a share", "above 0 and below 0.005 m"
_HOLDS = {
    _ANY: lambda size: size != 0.0,
    _SHARE: lambda size: 0.0 < size <= 1.0,
    _LOSS: lambda size: 0.0 < size < 1.0,
    _MORE: lambda size: size > 0.0,
    _PLAY: lambda size: 0.0 < size < 0.005,
    _FACTOR: lambda size: size > 1.0,
}
_SENSOR = {"bias": _ANY, "drift": _ANY, "scale": _ANY, "stuck": None, "noisy": _FACTOR, "spikes": _ANY, "dropout": _SHARE}
_PHYSICAL = ("softer", "more", "play")
_CAUSES: dict[str, dict[str, str | None]] = {
    r"cylinder_([1-9]\d*)\.k": {"softer": _LOSS},
    r"section_([1-9]\d*)\.EI": {"softer": _LOSS},
    r"tip\.payload": {"more": _MORE},
    r"line_fill": {"more": _MORE},
    r"cylinder_([1-9]\d*)\.rod\.clearance": {"play": _PLAY},
    r"(?:joint|cylinder)_([1-9]\d*)\.sensor": _SENSOR,
    r"joint_angles\.delay": {"late": _MORE},
    r"(?:joint_angles|cylinder_strokes)\.dropout": {"missing": _SHARE},
}
CAUSES = (
    "cylinder_i.k, section_i.EI, tip.payload, line_fill, cylinder_i.rod.clearance, joint_i.sensor, cylinder_i.sensor, "
    "joint_angles.delay, joint_angles.dropout, cylinder_strokes.dropout"
)


@dataclass(frozen=True, slots=True)
class Fault:
    """One fault: its cause, kind and size as in the table above, and its onset (s after the start).

    Raises
    ------
    UsageError
        There is no such cause, it has no such kind, or size or onset are out of bounds.
    """

    cause: str
    kind: str
    size: float = 0.0
    onset: float = 0.0

    def __post_init__(self) -> None:
        kinds = next((kinds for form, kinds in _CAUSES.items() if re.fullmatch(form, self.cause)), None)
        if kinds is None:
            raise UsageError(f"fault {self.cause}: not a cause. Give one of {CAUSES}, with i from 1.")
        if self.kind not in kinds:
            raise UsageError(f"fault {self.cause}:{self.kind}: not a kind of this cause. Give one of {', '.join(kinds)}.")
        bound = kinds[self.kind]
        if bound is None and self.size != 0.0:
            raise UsageError(f"fault {self.cause}:{self.kind}:{self.size:g}: it has no size. Leave that out.")
        if bound is not None and not (math.isfinite(self.size) and _HOLDS[bound](self.size)):
            raise UsageError(f"fault {self.cause}:{self.kind}: size = {self.size:g}, must be {bound}. Give it in SI units.")
        if not 0.0 <= self.onset < math.inf:
            raise UsageError(f"fault {self}: onset = {self.onset:g} s, must be finite and at least 0.")
        if self.is_physical and self.onset:
            raise UsageError(f"fault {self}: changes of the boom hold from the start of a session. Leave out @{self.onset:g}.")

    def __str__(self) -> str:
        size = f":{self.size:g}" if self.size else ""
        return f"{self.cause}:{self.kind}{size}" + (f"@{self.onset:g}" if self.onset else "")

    @property
    def is_physical(self) -> bool:
        """Whether it is of the boom, not of a sensor."""
        return self.kind in _PHYSICAL

    @property
    def number(self) -> int:
        """The i of its cause, from 1; 0 if it has none."""
        found = re.search(r"_(\d+)", self.cause)
        return 0 if found is None else int(found[1])


def parse(text: str) -> Fault:
    """The fault that is written ``CAUSE:KIND[:SIZE][@ONSET]``.

    Raises
    ------
    UsageError
        The text has not that form, or see `Fault`.
    """
    words, _, onset = text.partition("@")
    cause, _, rest = words.partition(":")
    kind, _, size = rest.partition(":")
    try:
        return Fault(cause, kind, float(size or 0.0), float(onset or 0.0))
    except ValueError:
        raise UsageError(f"fault {text}: size and onset must be numbers. Write CAUSE:KIND[:SIZE][@ONSET].") from None


def check(faults: Sequence[Fault], scene: Scene, duration: float) -> None:
    """UsageError if a fault is of a part that `scene` does not have, or begins after `duration` (s)."""
    parts = len(scene.joints)
    for fault in faults:
        if fault.number > parts:
            raise UsageError(f"fault {fault}: the boom has joints, cylinders and sections 1 to {parts}. Give one of them.")
        if fault.onset >= duration:
            raise UsageError(f"fault {fault}: begins at {fault.onset:g} s, must be before the end at {duration:g} s.")
