"""What a scene does not name, and what its model therefore lacks."""

from __future__ import annotations

from dataclasses import dataclass

from .parts import IDEAL_BELOW, Joint, Scene


@dataclass(frozen=True, slots=True)
class LeftOut:
    """A key that the scene does not name, and what the model therefore is."""

    key: str
    meaning: str


def left_out(scene: Scene) -> tuple[LeftOut, ...]:
    """One entry per key that is absent somewhere, in the order sections, joints, the rest."""
    found = _absent("sections", [_absent_in_section(scene, i) for i in range(len(scene.sections))])
    found += _absent("joints", [_absent_in_joint(joint) for joint in scene.joints])
    if scene.tip is None or not scene.tip.payload:
        found.append(LeftOut("tip.payload", "no mass at the tip"))
    if not scene.line_fill:
        found.append(LeftOut("line_fill", "the pipe line is empty"))
    if not scene.base.inclination:
        found.append(LeftOut("base.inclination", "the base stands level"))
    if scene.clearance is None or not scene.clearance.pins:
        return (*found, LeftOut("clearance", "ideal pins"))
    tight = [i for i, pin in enumerate(scene.clearance.pins) if pin.radial_clearance < IDEAL_BELOW]
    if tight:
        where = ", ".join(map(str, tight))
        meaning = f"below {IDEAL_BELOW * 1e6:g} um, so the pin is ideal"
        found.append(LeftOut(f"clearance.pins[{where}].radial_clearance", meaning))
    return tuple(found)


def _absent_in_section(scene: Scene, i: int) -> dict[str, str]:
    section = scene.sections[i]
    if section.beam is None:
        return {"beam": "rigid, all of it described by root"}
    if not scene.is_flexible(i):
        absent = {"modes": "zero, so the beam is rigid and keeps its mass"}
    else:
        absent = {} if section.beta else {"beta": "no damping of the beam"}
        absent |= {} if section.rho_I else {"rho_I": "no rotary inertia of the beam"}
        absent |= {} if scene.has_axial(i) else {"axial": "false, so the beam does not stretch"}
        absent |= {} if scene.has_geometric(i) else {"geometric": "false, so bending is linear, without geometric stiffness"}
    for key, end in (("root", "inboard"), ("head", "outboard")):
        if getattr(section, key) is None:
            absent[key] = f"the rigid {end} part has no mass"
    return absent


def _absent_in_joint(joint: Joint) -> dict[str, str]:
    cylinder = joint.cylinder
    absent = {}
    if joint.kind != "A":
        absent = {key: "massless link" for key in ("mL", "mR") if not getattr(joint, key)}
    if cylinder.k is None:
        absent["cylinder.k"] = "incompressible: the stroke drives the joint"
    elif not cylinder.d:
        absent["cylinder.d"] = "no damping in the oil spring"
    for key in ("barrel", "rod"):
        if getattr(cylinder, key) is None:
            absent[f"cylinder.{key}"] = f"massless {key}"
    return absent


def _absent(block: str, items: list[dict[str, str]]) -> list[LeftOut]:
    """One entry per key, for all items of a list that lack it: ``sections[1, 3].beta``."""
    keys = dict.fromkeys((key, meaning) for item in items for key, meaning in item.items())
    found = []
    for key, meaning in keys:
        where = [str(i) for i, item in enumerate(items) if item.get(key) == meaning]
        index = "*" if len(where) == len(items) > 1 else ", ".join(where)
        found.append(LeftOut(f"{block}[{index}].{key}", meaning))
    return found
