"""Rod pins with clearance in the Exudyn boom.

The contact law is that of the peers, with the K of the scene's radii and materials; pins are contact here also where the scene
has the twin linearise them.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ...errors import UsageError
from ...scene.schema import Material, Pin, Scene
from ...types import Array
from ..contact_law import HYSTERESIS, Contact, stiffness
from . import exudyn

HOLD = 1e10  # N/m, of a journal that is held in the middle


@dataclass(slots=True)
class Bush:
    """The contact of one pin as Exudyn asks for it."""

    contact: Contact
    sides: tuple[int, int]  # markers of the hole and of the journal
    node: int  # of the rod, which moves with the journal
    held: bool = True  # True if a spring holds the journal in the middle instead
    entry: float | None = None  # speed of approach (m/s) when it touched; None in flight

    def spring(self, _s: Any, _t: float, _i: int, offset: Array, rate: Array, _k: Any, _d: Any, _o: Any) -> list[float]:
        """Return the force (N) that draws hole and journal together, at the journal's offset (m) and rate (m/s), to Exudyn."""
        if self.held:
            return [HOLD * offset[0], HOLD * offset[1], 0.0]
        force = self.contact.force(complex(offset[0], offset[1]), complex(rate[0], rate[1]), self.entry)
        return [-force.real, -force.imag, 0.0]

    def offset(self, system: Any) -> complex:
        """Return the offset of the journal in the hole, m, as the system stands."""
        return self._between(system, exudyn.OutputVariableType.Position)

    def watch(self, system: Any) -> None:
        """Note before a step whether hole and journal touch, and their speed of approach."""
        offset = self.offset(system)
        if self.contact.gap(offset) < 0.0:
            self.entry = None
        elif self.entry is None:
            rate = self._between(system, exudyn.OutputVariableType.Velocity)
            self.entry = abs((rate * offset.conjugate()).real) / abs(offset)

    def release(self, system: Any) -> None:
        """Let the journal go at rest, from where it presses on the hole."""
        held = self.offset(system)
        shift = self.contact.resting_offset(HOLD * held) - held if held else 0j
        start = np.array(system.systemData.GetODE2Coordinates(exudyn.ConfigurationType.Initial))
        place = system.GetNodeODE2Index(self.node)
        start[place : place + 2] += shift.real, shift.imag
        system.systemData.SetODE2Coordinates(start, exudyn.ConfigurationType.Initial)
        self.held = False

    def _between(self, system: Any, kind: Any) -> complex:
        hole, journal = (system.GetMarkerOutput(side, kind) for side in self.sides)
        return complex(journal[0] - hole[0], journal[1] - hole[1])


def pin_with_play(scene: Scene, index: int) -> Pin | None:
    """Return the rod pin of cylinder `index` (0-based) if it has play."""
    return next((pin for pin in scene.pins_of(f"cylinder_{index + 1}") if pin.at.endswith(".rod")), None)


def contact_of(scene: Scene, pin: Pin) -> Contact:
    """Return the law by which a pin touches its bush."""
    assert scene.clearance is not None
    law = scene.clearance.contact

    def alone(material: Material) -> float:
        return stiffness(pin.pin_radius, max(pin.radial_clearance, 3e-5), material.E, material.nu)  # m

    both = 2.0 / (1.0 / alone(scene.material) + 1.0 / alone(law.bush or scene.material))
    loss = HYSTERESIS[law.law](law.restitution)
    return Contact(both, loss, pin.radial_clearance, law.exponent, 1e-6, law.friction)


def refuse_other_pins(scene: Scene) -> None:
    """Raise UsageError if `scene` has pins with play that the virtual rig does not know, or a rod that is too light for one."""
    for index, joint in enumerate(scene.joints):
        owners = (f"cylinder_{index + 1}", f"joint_{index + 1}")
        other = [pin.at for owner in owners for pin in scene.pins_of(owner) if not pin.at.endswith(".rod")]
        if other:
            names = ", ".join(other)
            raise UsageError(f"clearance.pins = {names}: the virtual rig knows play in rod pins only. Leave them out.")
        rod = joint.cylinder.rod
        if pin_with_play(scene, index) is not None and (rod is None or rod.mass == 0.0):
            raise UsageError(
                f"clearance.pins = cylinder_{index + 1}.rod: the rod has no mass, and in the virtual rig nothing then holds "
                f"the journal in flight. Give joints[{index}].cylinder.rod a mass."
            )
