"""Every kind of fault, by a minimal edit of the default scene: place, value, and words of bound and remedy."""

from __future__ import annotations

import math
from typing import Any

import pytest
from default_boom import clearance_text, default_text
from scene.editing import GONE, OIL, put

from boom_twin import SceneError, load_scene
from boom_twin.errors import ABSENT

# Each row: the place that is edited and, if it is another one, the place of the fault; the new value; words of the message.

SINGLE_VALUES = [
    ("sections[1].root.mass", -12.0, "-12.0", "greater than or equal to 0", "mass in kg"),
    ("sections[1].length", 0, "greater than 0", "pivot to pivot"),
    ("sections[1].length", math.nan, "nan", "finite"),
    ("sections[1].A", "3.9e-3", "not text", "without quotes: 3.9e-3"),
    ("sections[1].A", "0,0039", "not text", "decimal point: 0.0039"),
    ("sections[1].A", "39 cm", "`cm` is no unit of this key, which is in m^2", "Give the area"),
    ("sections[1].A", True, "true", "a number is needed, not true or false"),
    ("sections[1].root", 3, "a block of keys is needed, not a whole number"),
    ("sections[1].root.com", [1.0, 2.0, 3.0], "2 numbers", "it has 3", "not a comma"),
    ("sections[1].root.com -> sections[1].root.com[1]", [1.0, None], "null", "not nothing"),
    ("sections[1].root.mass", GONE, "is absent", "needed", "kg"),
    ("sections[1].modes", 2.5, "a whole number is needed, not a decimal number"),
    ("gravity", GONE, "is absent", "m/s^2"),
    ("material.nu", 0.6, "less than or equal to 0.5"),
    ("material.name", 345, "text is needed", "quotes"),
    ("sections", [], "is absent", "one block per section"),
    ("joints", GONE, "is absent", "one block per joint"),
    ("postures.arch[2]", None, "not nothing", "section angles"),
    ("joints[1].kind", "B4", "'B4'", "'A', 'B1', 'B2' or 'B3'"),
]  # fmt: skip

UNKNOWN_KEYS = [
    ("sections[1].rho_a", 41.0, "unknown key in sections[1]", "nearest", "`rho_A`"),
    ("sections[1].k", 3e7, "`k` is a key of joints[i].cylinder", "nearest"),
    ("payload", 40.0, "`payload` is a key of tip"),
    ("Gravity", [0, -9.81], "`gravity`"),
    ("zzz", 1, "nearest known key", "All of them: description, gravity"),
    ("sections[0].86", None, "number stands where a key", "not a comma"),
    ("clearance -> clearance.pin", {"pin": []}, "`pins`"),
    ("clearance -> clearance.law", {"law": "hertz"}, "`law` is a key of clearance.contact"),
]  # fmt: skip

CONTRADICTIONS = [
    ("sections[1].A", GONE, "is absent", "a section with a beam needs it", "m^2", "leave out `beam`"),
    ("sections[1].beam", [-0.1, 3.0], "[-0.1, 3.0]", "0 <= x0 < x1 <= length = 3.3"),
    ("sections[0].rod_pin", GONE, "is absent", "cylinder 1", "rod pin"),
    ("sections[2].rod_pin", [0.5, 0.0], "only the first section", "Remove it", "joints[2]"),
    ("joints[0].C", [0.1, 0.1], "kind A has no links", "Remove `C`"),
    ("joints[1].R", [0.1, 0.1], "kind B1", "where the links meet", "Remove `R`"),
    ("joints[2].R", GONE, "is absent", "kind B2 needs it", "rod pin on its link"),
    ("joints[0].side", "left", "kind A has no links", "Remove `side`"),
    ("joints[1].side", "up", "'up'", "'left' or 'right'", "where the links meet"),
    ("joints[1].cylinder.oil", OIL, "k = 3e+07 N/m too", "Remove k, or remove oil"),
    ("joints[1].cylinder.oil -> joints[1].cylinder.oil.rod", OIL | {"rod": 0.1}, "thinner than the bore, 0.1 m", "diameters"),
    ("joints[1].cylinder.oil -> joints[1].cylinder.oil.bore", OIL | {"bore": 160}, "less than or equal to 1", "piston, m"),
    ("joints[1].cylinder.max_stroke", GONE, "is absent", "the largest stroke, m"),
    ("joints[1].cylinder.k -> joints[1].cylinder.d", GONE, "90000.0", "incompressible", "Give k", "remove d"),
    ("joints[1].range_deg", [10, -165], "low < high", "lower angle first"),
    ("joints[1].range_deg", [-2.88, 0.17], "within 6.28 degrees", "these radians would be [-165, 9.74]"),
    ("base.inclination", 5.0, "less than or equal to 1.571", "in rad, or with its unit, like 5 deg"),
    ("postures.arch", [60, 20, -30], "it has 3 angles", "4 sections", "one angle per section"),
    ("joints[1].D", [-0.4, -0.04], "rigid head of sections[0]", "x >= -0.26", "x1 <= 3.46"),
    ("joints[1].E", [0.3, 0.062], "rigid root of sections[1]", "x <= 0.25", "x0 >= 0.3"),
]  # fmt: skip

GEOMETRY = [
    ("joints[1].lL -> joints[1].range_deg", 5.0, "do not meet at any angle", "Check D, E, lL and lR"),
    ("joints[1].cylinder.closed_length", 3.0, "from pin to pin", "3 to 3.42 m long", "closed_length and max_stroke"),
    ("sections[0].rod_pin -> joints[0].range_deg", [0.0, 0.0], "stays 1.329 m long", "cannot turn the joint"),
    ("postures.arch[1]", 80, "`arch` turns joint 2 to 20 deg", "[-165, 10]", "difference"),
    ("joints[2].cylinder.max_stroke -> postures.arch[2]", 0.1, "`arch` turns joint 3 to -50 deg", "a stroke of",
     "cylinder 3 has 0 to 0.1 m", "max_stroke"),
]  # fmt: skip

PIN = {"at": "cylinder_1.rod", "pin_radius": 0.03, "radial_clearance": 1e-4}
NO_NAME = ("not the name of a pin", "cylinder_i. with rod or barrel", "pivot, link_L, link_R or Q")
CLEARANCE = [
    ({"pins": [PIN | {"at": "cylinder_9.rod"}]}, "pins[0].at", "'cylinder_9.rod'", "joints and cylinders 1 to 4",
     "cylinder_4.barrel"),
    ({"pins": [PIN | {"at": "joint_0.pivot"}]}, "pins[0].at", "'joint_0.pivot'", "1 to 4", "joint_4.Q"),
    ({"pins": [PIN | {"at": "joint_1.link_L"}]}, "pins[0].at", "joint 1 is of kind A and has no links",
     "cylinder_1.barrel, joint_1.pivot."),
    ({"pins": [PIN | {"at": "cylinder_1.bolt"}]}, "pins[0].at", *NO_NAME),
    ({"pins": [PIN | {"at": 3}]}, "pins[0].at", "text is needed"),
    ({"pins": [PIN, PIN]}, "pins[1].at", "clearance.pins[0] is this pin already", "once"),
    ({"pins": [PIN | {"radial_clearance": 0.03}]}, "pins[0].radial_clearance", "0.03", "less than pin_radius = 0.03 m",
     "metres"),
    ({"pins": [PIN | {"radial_clearance": "0.1 mn"}]}, "pins[0].radial_clearance", "`mn` is no unit of this key",
     "less that of the pin, m"),
    ({"pins": [PIN | {"clearance": 0.0001}]}, "pins[0].clearance", "unknown key", "`radial_clearance`"),
    ({"pins": "cylinder_1.rod"}, "pins", "a list is needed, not text", "one block per pin"),
    ({"contact": {"bush": {"E": 0}}, "pins": [PIN]}, "contact.bush.E", "greater than 0", "Pa"),
    ({"treatment": "springs"}, "treatment", "'springs'", "'contact' or 'spring-damper'"),
    ({"cylinder_2.rod": 0.0001}, "cylinder_2.rod", "unknown key in clearance", "`pins`", "treatment, contact, pins"),
]  # fmt: skip


@pytest.mark.parametrize("row", SINGLE_VALUES + UNKNOWN_KEYS + CONTRADICTIONS + GEOMETRY, ids=lambda row: f"{row[0]}-{row[2]}")
def test_a_fault_names_place_value_bound_and_remedy(bench: Any, row: tuple[Any, ...]) -> None:
    (place, _, path), value, words = row[0].partition(" -> "), row[1], row[2:]
    path = path or place
    faults = {fault.path: fault for fault in bench.faults(lambda values: put(values, place, value))}
    assert path in faults, f"found only {sorted(faults)}"
    assert faults[path].remedy.strip() and [word for word in words if word not in str(faults[path])] == [], str(faults[path])
    if row in SINGLE_VALUES + UNKNOWN_KEYS:  # and it is the only fault
        assert [each for each in faults if not each.startswith("postures") or "postures" in place] == [path]


@pytest.mark.parametrize("row", CLEARANCE, ids=lambda row: f"{row[1]}-{row[2]}")
def test_a_fault_of_the_clearance_block_names_place_value_bound_and_remedy(bench: Any, row: tuple[Any, ...]) -> None:
    (fault,) = bench.faults(lambda values: values.update(clearance=row[0]))
    assert fault.path == f"clearance.{row[1]}" and fault.line is not None and fault.remedy.strip()
    assert [word for word in row[2:] if word not in str(fault)] == [], str(fault)


def test_all_pins_of_a_boom_may_be_listed_and_a_block_without_a_boom_has_no_fault_of_its_pins(bench: Any) -> None:
    places = [f"cylinder_{i}.{end}" for i in range(1, 5) for end in ("rod", "barrel")]
    places += ["joint_1.pivot", *(f"joint_{i}.{place}" for i in (2, 3, 4) for place in ("pivot", "link_L", "link_R", "Q"))]
    assert bench.faults(lambda values: values.update(clearance={"pins": [PIN | {"at": at} for at in places]})) == ()
    faults = bench.faults_of(bench.text(clearance_text() + "\n"))
    assert {fault.path for fault in faults} == {"gravity", "material", "base", "sections", "joints"}


def test_a_rigid_section_needs_a_root_and_must_not_have_the_keys_of_a_beam(bench: Any) -> None:
    def edit(values: Any) -> None:
        rigid = {"length": 3.3, "root": {"mass": 100, "com": [1.6, 0], "inertia": 90}}
        values["sections"][1] = values["sections"][1] | {"modes": 3} | rigid
        del values["sections"][1]["beam"]
        values["sections"][3] = {"length": 3.1}

    faults = bench.faults(edit)
    assert [fault.path for fault in faults if fault.value == ABSENT] == ["sections[3].root"]
    keys = {fault.path.rpartition(".")[2] for fault in faults if "no `beam`" in fault.bound and "Remove" in fault.remedy}
    assert keys == {"A", "I", "rho_A", "rho_I", "beta", "modes", "head"}


def test_joints_have_their_kinds_in_order_and_are_as_many_as_sections(bench: Any) -> None:
    faults = bench.faults(lambda values: values["joints"].reverse())
    kinds = {fault.path: str(fault) for fault in faults if fault.path.endswith("kind")}
    assert "must be of kind A" in kinds["joints[0].kind"] and "only joint 1" in kinds["joints[3].kind"]
    (fault,) = bench.faults(lambda values: put(values, "joints[3]", GONE))
    assert (fault.path, fault.value) == ("joints", 3) and "4 sections" in fault.bound


def test_all_faults_of_a_stage_are_reported_at_once(bench: Any) -> None:
    """Values by themselves and unknown keys; then keys that need each other; then geometry."""
    values = [("material.E", "206e9"), ("sections[0].root.mass", -36), ("joints[3].kind", "B9")]
    unknown = [("sections[1].rho_a", 41), ("clearance", {"joints": []})]
    keys = [("sections[2].I", GONE), ("joints[2].cylinder.k", GONE), ("postures.low", [45, 0])]
    geometry = [("joints[1].lL", 5.0), ("joints[3].lL", 5.0)]
    found = []
    for edits in (values + unknown + keys + geometry, unknown + keys + geometry, geometry):
        path = bench.edited(lambda scene, edits=edits: [put(scene, *each) for each in edits])
        with pytest.raises(SceneError, match="faults") as caught:
            load_scene(path)
        assert caught.value.source == str(path)
        found.append({fault.path for fault in caught.value.faults if not fault.path.startswith("postures.a")})
    assert found[0] == {"material.E", "sections[0].root.mass", "joints[3].kind", "sections[1].rho_a", "clearance.joints"}
    assert found[1] == {
        "sections[1].rho_a", "clearance.joints", "sections[2].I", "joints[2].cylinder.d", "postures.low"
    }  # fmt: skip
    assert found[2] == {"joints[1].range_deg", "joints[3].range_deg"}


def test_faults_come_with_their_line_in_the_order_of_the_file(bench: Any) -> None:
    text = default_text().replace("mass: 12.0, com: [0.12", "mass: -12.0, com: [0.12").replace("nu: 0.3", "nu: 0.9")
    faults = bench.faults_of(bench.text(text))
    rows = text.splitlines()
    assert [fault.path for fault in faults] == ["material.nu", "sections[1].root.mass"]
    assert "nu: 0.9" in rows[faults[0].line - 1] and "mass: -12.0" in rows[faults[1].line - 1]
    assert str(faults[0]).startswith(f"line {faults[0].line}: material.nu = 0.9: ")
