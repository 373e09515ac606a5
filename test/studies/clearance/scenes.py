"""Scenes of the clearance study: which pins have clearance, how much, and how they are treated."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

from default_boom import clearance_text
from ruamel.yaml import YAML

from boom_twin import Scene
from boom_twin.scene.checks.values import names_of
from boom_twin.scene.schema import Clearance, Pin

Treatment = Literal["contact", "spring-damper"]


def with_play(scene: Scene) -> Scene:
    """`scene` if it lists pins; else with the package's pins between its rods and sections, the last one for all beyond."""
    if scene.clearance is not None and scene.clearance.pins:
        return scene
    block = Clearance.model_validate(YAML(typ="safe").load(clearance_text())["clearance"])
    last = len(block.pins) - 1
    names = [f"cylinder_{i + 1}.rod" for i in range(len(scene.joints))]
    pins = [block.pins[min(i, last)].model_copy(update={"at": name}) for i, name in enumerate(names)]
    return with_pins(scene.model_copy(update={"clearance": block}), pins)


def ideal(scene: Scene) -> Scene:
    """`scene` with ideal pins."""
    return scene.model_copy(update={"clearance": None})


def treated(scene: Scene, treatment: Treatment) -> Scene:
    """`scene` with its pins as contact, or linearised."""
    return _with(scene, treatment=treatment)


def with_pins(scene: Scene, pins: Sequence[Pin]) -> Scene:
    """`scene` with `pins` in place of its own; laws and treatment stay."""
    return _with(scene, pins=tuple(pins))


def pins_of(scene: Scene) -> Clearance:
    """The block of a scene that has one."""
    return scene.clearance or Clearance()


def pin_like(scene: Scene, at: str, clearance: float | None = None) -> Pin:
    """The pin `at` with the radius that the scene gives it, or that of its first pin; likewise its `clearance` (m)."""
    own = {pin.at: pin for pin in pins_of(scene).pins}
    found = own.get(at, pins_of(scene).pins[0])
    return found.model_copy(update={"at": at} | ({} if clearance is None else {"radial_clearance": clearance}))


def rods_and_joints(scene: Scene) -> list[str]:
    """Names of all pins but those of the barrels, rods first."""
    names = [name for i, joint in enumerate(scene.joints) for name in names_of(i, joint) if not name.endswith("barrel")]
    return sorted(names)


def _with(scene: Scene, **changes: object) -> Scene:
    return scene.model_copy(update={"clearance": pins_of(scene).model_copy(update=changes)})
