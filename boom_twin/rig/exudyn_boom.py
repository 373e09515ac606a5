"""The boom as an Exudyn system: geometrically exact beams, rigid parts, pins, links and cylinders.

The model shares no equation with the twin. Every node holds absolute x, y and rotation in the base's axes; the rigid
root and head of a section sit on the end nodes of its beam, so they add no unknowns. A part that the scene does not
name has no mass here; massless links stay as bodies, held by as many constraints as they have unknowns.

Sources: J. Simo and L. Vu-Quoc, "On the dynamics of flexible beams under large overall motions - the plane case",
J. Appl. Mech. 53 (1986), for the beam; Exudyn (J. Gerstmayr) for everything that is solved.
"""

from __future__ import annotations

from ..records import Array
from ..scene.parts import Scene
from .assembly import gravity_in_base, section_frames
from .joints import add_joint, add_pivot
from .peer import exudyn, items
from .play import refuse_other_pins
from .sections import add_section
from .system import Boom


def build(scene: Scene, strokes: Array, elements: int = 16, nodally_exact: bool = False) -> Boom:
    """The undeformed boom with its drives at absolute `strokes` (m), shape (n,); sensors may still be added.

    Parameters
    ----------
    elements : int
        Finite elements per flexible section, at least one per part between cylinder brackets.
    nodally_exact : bool
        Whether few elements bend as many do; see `sections.shear_stiffness`.

    Raises
    ------
    UsageError
        The scene has pins with clearance other than of rods, or on a rod without mass.
    """
    refuse_other_pins(scene)
    container = exudyn.SystemContainer()
    system = container.AddSystem()
    ground = int(system.AddObject(items.ObjectGround()))
    boom = Boom(scene, container, system, [*gravity_in_base(scene), 0.0], ground, nodally_exact)
    frames = section_frames(scene, strokes)
    for index, frame in enumerate(frames):
        boom.sections.append(add_section(boom, frame, index, elements))
        add_pivot(boom, index)
        add_joint(boom, frames, index, float(strokes[index]))
    return boom
