"""Faults of the clearance block: place, value, words of bound and remedy."""

from __future__ import annotations

from typing import Any

import pytest

from boom_twin.scene.load import clearance_text

PIN = {"at": "cylinder_1.rod", "pin_radius": 0.03, "radial_clearance": 1e-4}
FORM = ("not the name of a pin", "cylinder_i. with rod or barrel", "pivot, link_L, link_R or Q")


def pin(**values: Any) -> dict[str, Any]:
    """A block with one pin that differs from a sound one."""
    return {"pins": [PIN | values]}


def law(**values: Any) -> dict[str, Any]:
    """A block with a contact law."""
    return {"contact": values, "pins": [PIN]}


FAULTS = [
    (pin(at="cylinder_9.rod"), "pins[0].at", ("'cylinder_9.rod'", "joints and cylinders 1 to 4", "cylinder_4.barrel")),
    (pin(at="joint_0.pivot"), "pins[0].at", ("'joint_0.pivot'", "1 to 4", "joint_4.Q")),
    (pin(at="joint_1.link_L"), "pins[0].at", ("joint 1 is of kind A and has no links", "cylinder_1.barrel, joint_1.pivot.")),
    (pin(at="cylinder_1.bolt"), "pins[0].at", FORM),
    (pin(at="joint_2.rod"), "pins[0].at", FORM),
    (pin(at="rod"), "pins[0].at", FORM),
    (pin(at=3), "pins[0].at", ("text is needed",)),
    ({"pins": [PIN, PIN]}, "pins[1].at", ("clearance.pins[0] is this pin already", "once")),
    (pin(radial_clearance=0.03), "pins[0].radial_clearance", ("0.03", "less than pin_radius = 0.03 m", "metres")),
    (pin(radial_clearance=-1e-4), "pins[0].radial_clearance", ("-0.0001", "not be less than 0", "m.")),
    (pin(radial_clearance="0.1 mn"), "pins[0].radial_clearance", ("`mn` is no unit that is known", "less that of the pin, m")),
    (pin(pin_radius=0), "pins[0].pin_radius", ("greater than 0", "radius of the pin, m")),
    (pin(clearance=1e-4), "pins[0].clearance", ("unknown key", "`radial_clearance`")),
    ({"pins": [{"at": "cylinder_1.rod", "pin_radius": 0.03}]}, "pins[0].radial_clearance", ("is absent", "m.")),
    ({"pins": "cylinder_1.rod"}, "pins", ("a list is needed, not text", "one block per pin")),
    (law(law="hertzian"), "contact.law", ("'hertzian'", "'flores', 'hunt-crossley' or 'hunt-crossley-exact'")),
    (law(restitution=0), "contact.restitution", ("greater than 0", "at most 1")),
    (law(restitution=1.1), "contact.restitution", ("1.1", "not be more than 1")),
    (law(exponent=0.5), "contact.exponent", ("not be less than 1.3", "1.5 for Hertz's")),
    (law(friction=-0.1), "contact.friction", ("not be less than 0", "0 to 2")),
    (law(frictoin=0.1), "contact.frictoin", ("unknown key in clearance.contact", "`friction`")),
    (law(bush={"E": 0}), "contact.bush.E", ("greater than 0", "Pa")),
    ({"treatment": "springs"}, "treatment", ("'springs'", "'contact' or 'spring-damper'")),
    ({"cylinder_2.rod": 1e-4}, "cylinder_2.rod", ("unknown key in clearance", "`pins`", "treatment, contact, pins")),
]


@pytest.mark.parametrize(("block", "path", "words"), FAULTS)
def test_a_fault_names_place_value_bound_and_remedy(bench: Any, block: Any, path: str, words: tuple[str, ...]) -> None:
    (fault,) = bench.faults(lambda values: values.update(clearance=block))
    assert fault.path == f"clearance.{path}" and fault.line is not None and fault.remedy.strip()
    assert [word for word in words if word not in str(fault)] == [], str(fault)


def test_a_block_of_another_kind(bench: Any) -> None:
    (fault,) = bench.faults(lambda values: values.update(clearance=1e-4))
    assert fault.path == "clearance" and "a block of keys is needed" in fault.bound


def test_all_pins_of_a_boom_may_be_listed(bench: Any) -> None:
    places = [f"cylinder_{i}.{end}" for i in range(1, 5) for end in ("rod", "barrel")]
    places += ["joint_1.pivot", *(f"joint_{i}.{place}" for i in (2, 3, 4) for place in ("pivot", "link_L", "link_R", "Q"))]
    assert bench.faults(lambda values: values.update(clearance={"pins": [PIN | {"at": at} for at in places]})) == ()


@pytest.mark.parametrize(("law", "asked", "given"), [("lankarani-nikravesh", 0.5, "0.725"), ("flores", 0.5, "0.470")])
def test_a_law_that_does_not_keep_its_restitution_is_odd(bench: Any, law: str, asked: float, given: str) -> None:
    block = {"contact": {"law": law, "restitution": asked}, **pin()}
    (fault,) = bench.oddities(lambda values: values.update(clearance=block))
    assert fault.path == "clearance.contact.restitution" and given in fault.bound and "hunt-crossley-exact" in fault.remedy
    block["contact"]["law"] = "hunt-crossley-exact"
    assert bench.oddities(lambda values: values.update(clearance=block)) == []


def test_a_clearance_wide_for_its_pin_is_odd(bench: Any) -> None:
    (fault,) = bench.oddities(lambda values: values.update(clearance=pin(radial_clearance=0.004)))
    assert fault.path == "clearance.pins[0].radial_clearance" and "more than a tenth of pin_radius" in fault.bound


def test_a_block_without_a_boom_is_no_fault_of_its_pins(bench: Any) -> None:
    faults = bench.faults_of(bench.text(clearance_text() + "\n"))
    assert {fault.path for fault in faults} == {"gravity", "material", "base", "sections", "joints"}
