"""Booms that are not those of their scene: with physical faults, and with parameters that are wrong at random."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import numpy as np

from ...errors import UsageError
from ...scene.edit import parameter, parameter_names, scaled, with_parameters
from ...scene.schema import Clearance, CylinderPart, Joint, Pin, Scene
from ...types import Array
from .faults import RigFault
from .solve import Change


def changes(scene: Scene, faults: Sequence[RigFault]) -> tuple[Scene, list[Change]]:
    """Return `scene` with the physical `faults` that are there at first, and its changes by those that come or go."""
    first = [fault for fault in faults if fault.is_there_at_first]
    start, found = with_faults(scene, first), list[Change]()
    for fault in faults:
        if not fault.is_physical or fault.is_constant:
            continue
        if fault.is_there_at_first:
            found.append((with_faults(scene, [other for other in first if other is not fault]), partial(_gone, fault)))
        else:
            found.append((with_faults(scene, [*first, fault]), fault.share))
    return start, found


def _gone(fault: RigFault, times: Array) -> Array:
    return np.asarray(1.0 - fault.share(times))


def with_faults(scene: Scene, faults: Sequence[RigFault]) -> Scene:
    """Return `scene` with the physical ones of `faults` in full; UsageError if it lacks the parameter of one.

    A pin that the scene does not list gets a journal of 25 mm radius.
    """
    for fault in faults:
        if fault.kind == "play":
            scene = _worn(scene, fault.cause.removesuffix(".clearance"), fault.size)
        elif fault.is_physical:
            now = parameter(scene, fault.cause)
            changed = {"more": now + fault.size, "less": now - fault.size, "softer": now * (1.0 - fault.size)}
            scene = with_parameters(scene, {fault.cause: changed[fault.kind]})
    return scene


def _worn(scene: Scene, at: str, more: float) -> Scene:
    clearance = scene.clearance or Clearance()
    pins = {pin.at: pin for pin in clearance.pins}
    pin = pins.get(at) or Pin(at=at, pin_radius=0.025, radial_clearance=0.0)
    pins[at] = pin.model_copy(update={"radial_clearance": pin.radial_clearance + more})
    return scene.model_copy(update={"clearance": clearance.model_copy(update={"pins": tuple(pins.values())})})


MOST_WRONG = 0.3  # share; twice as much is drawn at most, and every parameter stays positive
KEYS = ("k", "d", "EI", "mass")


def wrong_by(scene: Scene, share: float, seed: int) -> Scene:
    """Return `scene` with every k, d, EI and mass of section, link, barrel and rod multiplied by 1 + `share` z of its own.

    z is standard normal, drawn again beyond 2; masses take their inertia with them. Payload, line fill, geometry and material
    damping stay, for they are known, or nothing is predicted from them that a sensor could tell.
    """
    if not 0.0 <= share <= MOST_WRONG:
        raise UsageError(f"wrong by {share:g}: must be from 0 to {MOST_WRONG:g}, as a share of every parameter. 0.02 is 2 %.")
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
    cylinder = {key: scaled(part, _factor(share, rng)) for key, part in parts.items() if part is not None}
    changes = {key: mass * _factor(share, rng) for key, mass in links.items() if mass is not None}
    return joint.model_copy(update={**changes, "cylinder": joint.cylinder.model_copy(update=cylinder)})
