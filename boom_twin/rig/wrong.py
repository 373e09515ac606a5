"""A boom whose parameters are not those that its scene file says, at random."""

from __future__ import annotations

import numpy as np

from ..errors import UsageError
from ..scene.named import parameter, parameter_names, with_parameters
from ..scene.parts import CylinderPart, Joint, Scene

MOST = 0.3  # share; twice as much is drawn at most, and every parameter stays positive
KEYS = ("k", "d", "EI", "mass")


def wrong_by(scene: Scene, share: float, seed: int) -> Scene:
    """Every k, d, EI and section mass, mass of link, barrel and rod multiplied by 1 + `share` z of its own.

    z is standard normal, drawn again beyond 2; masses take their inertia with them. Payload, line fill, geometry and material
    damping stay, for they are known, or nothing is predicted from them that a sensor could tell.

    Raises
    ------
    UsageError
        `share` is not from 0 to 0.3.
    """
    if not 0.0 <= share <= MOST:
        raise UsageError(f"wrong by {share:g}: must be from 0 to {MOST:g}, as a share of every parameter. 0.02 is 2 %.")
    rng = np.random.default_rng([seed, 2])
    names = [name for name in parameter_names(scene) if name.split(".")[-1] in KEYS]
    scene = with_parameters(scene, {name: parameter(scene, name) * _factor(share, rng) for name in names})
    return scene.model_copy(update={"joints": tuple(_joint(joint, share, rng) for joint in scene.joints)})


def _factor(share: float, rng: np.random.Generator) -> float:
    while abs(z := rng.standard_normal()) > 2.0:
        pass
    return 1.0 + share * float(z)


def _joint(joint: Joint, share: float, rng: np.random.Generator) -> Joint:
    links = {key: getattr(joint, key) for key in ("mL", "mR")}
    parts: dict[str, CylinderPart | None] = {key: getattr(joint.cylinder, key) for key in ("barrel", "rod")}
    cylinder = {key: _heavier(part, _factor(share, rng)) for key, part in parts.items() if part is not None}
    changes = {key: mass * _factor(share, rng) for key, mass in links.items() if mass is not None}
    return joint.model_copy(update={**changes, "cylinder": joint.cylinder.model_copy(update=cylinder)})


def _heavier(part: CylinderPart, factor: float) -> CylinderPart:
    return part.model_copy(update={"mass": factor * part.mass, "inertia": factor * part.inertia})
