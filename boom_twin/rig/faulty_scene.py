"""The scene of a boom with physical faults."""

from __future__ import annotations

from collections.abc import Sequence

from ..scene.named import parameter, with_parameters
from ..scene.parts import Clearance, Pin, Scene
from .faults import Fault

JOURNAL = 0.025  # m, radius of a pin that the scene does not list


def with_faults(scene: Scene, faults: Sequence[Fault]) -> Scene:
    """`scene` with the physical ones of `faults`; those of sensors are passed over.

    A pin that the scene does not list gets a journal of 25 mm radius.

    Raises
    ------
    UsageError
        The scene has no such parameter, for instance no oil spring.
    """
    for fault in faults:
        if fault.kind == "play":
            scene = _worn(scene, fault.cause.removesuffix(".clearance"), fault.size)
        elif fault.is_physical:
            now = parameter(scene, fault.cause)
            changed = now + fault.size if fault.kind == "more" else now * (1.0 - fault.size)
            scene = with_parameters(scene, {fault.cause: changed})
    return scene


def _worn(scene: Scene, at: str, more: float) -> Scene:
    """The pin `at` with `more` radial clearance (m) than it has."""
    clearance = scene.clearance or Clearance()
    pins = {pin.at: pin for pin in clearance.pins}
    pin = pins.get(at) or Pin(at=at, pin_radius=JOURNAL, radial_clearance=0.0)
    pins[at] = pin.model_copy(update={"radial_clearance": pin.radial_clearance + more})
    return scene.model_copy(update={"clearance": clearance.model_copy(update={"pins": tuple(pins.values())})})
