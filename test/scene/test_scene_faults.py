"""Every kind of fault, by a minimal edit of the default scene: place, value, and words of bound and remedy."""

from __future__ import annotations

import math
from typing import Any

import pytest

from boom_twin.errors import ABSENT, SceneError
from boom_twin.scene import load_scene
from boom_twin.scene.load import default_text

Place = tuple[str | int, ...]
GONE = object()


def put(values: Any, place: Place, value: Any) -> None:
    """Set (or, with GONE, remove) what is at a place."""
    for step in place[:-1]:
        values = values[step]
    if value is GONE:
        del values[place[-1]]
    else:
        values[place[-1]] = value


def s(i: int, *rest: str | int) -> Place:
    return ("sections", i, *rest)


def j(i: int, *rest: str | int) -> Place:
    return ("joints", i, *rest)


# place, new value, path of the fault, words that its text must have
SINGLE_VALUES: list[tuple[Place, Any, str, tuple[str, ...]]] = [
    (s(1, "root", "mass"), -12.0, "sections[1].root.mass", ("-12.0", "not be less than 0", "mass in kg")),
    (s(1, "length"), 0, "sections[1].length", ("greater than 0", "pivot to pivot")),
    (s(1, "length"), math.nan, "sections[1].length", ("nan", "finite")),
    (s(1, "A"), math.inf, "sections[1].A", ("inf", "finite")),
    (s(1, "A"), "3.9e-3", "sections[1].A", ("not text", "without quotes: 3.9e-3")),
    (s(1, "A"), "0,0039", "sections[1].A", ("not text", "decimal point: 0.0039")),
    (s(1, "A"), "39 cm", "sections[1].A", ("`cm` is no unit of this key, which is in m^2", "Give the area")),
    (s(1, "A"), "big", "sections[1].A", ("not text", "Give the area of the cross-section, m^2")),
    (s(1, "A"), True, "sections[1].A", ("true", "a number is needed, not true or false")),
    (s(1, "A"), [1], "sections[1].A", ("not a list",)),
    (s(1, "A"), {"x": 1}, "sections[1].A", ("not a block",)),
    (s(1, "root"), 3, "sections[1].root", ("a block of keys is needed, not a whole number",)),
    (s(1), "text", "sections[1]", ("a block of keys is needed, not text", "as in the default scene")),
    (s(1, "root", "com"), [1.0], "sections[1].root.com", ("2 numbers", "it has 1")),
    (s(1, "root", "com"), [1.0, 2.0, 3.0], "sections[1].root.com", ("2 numbers", "it has 3", "not a comma")),
    (s(1, "root", "com"), [1.0, None], "sections[1].root.com[1]", ("null", "not nothing")),
    (s(1, "root", "com"), 1.0, "sections[1].root.com", ("a list is needed",)),
    (s(1, "root", "mass"), GONE, "sections[1].root.mass", ("is absent", "needed", "kg")),
    (s(1, "modes"), 2.5, "sections[1].modes", ("a whole number is needed, not a decimal number",)),
    (s(1, "modes"), 11, "sections[1].modes", ("not be more than 10",)),
    (("modes",), -1, "modes", ("not be less than 0",)),
    (("gravity",), GONE, "gravity", ("is absent", "m/s^2")),
    (("gravity",), [0, "-9.81"], "gravity[1]", ("not text", "without quotes: -9.81")),
    (("material", "E"), GONE, "material.E", ("is absent", "Pa")),
    (("material", "nu"), 0.6, "material.nu", ("not be more than 0.5",)),
    (("material", "nu"), -1.0, "material.nu", ("greater than -1",)),
    (("material", "name"), 345, "material.name", ("text is needed", "quotes")),
    (("base",), GONE, "base", ("is absent", "cylinder_pin")),
    (("base", "pivot"), GONE, "base.pivot", ("is absent", "pin of section 1")),
    (("sections",), [], "sections", ("is absent", "one block per section")),
    (("sections",), {"first": 1}, "sections", ("a list is needed, not a block",)),
    (("joints",), GONE, "joints", ("is absent", "one block per joint")),
    (("tip",), {"payload": -1}, "tip.payload", ("not be less than 0", "kg")),
    (("line_fill",), -10, "line_fill", ("not be less than 0", "kg/m")),
    (("postures",), [1], "postures", ("a block of keys is needed, not a list",)),
    (("postures", "arch", 2), "x", "postures.arch[2]", ("a number is needed", "degrees")),
    (("postures", "arch", 2), None, "postures.arch[2]", ("not nothing", "section angles")),
    (("postures", "arch"), 30, "postures.arch", ("a list is needed",)),
    (j(1, "kind"), "B4", "joints[1].kind", ("'B4'", "'A', 'B1', 'B2' or 'B3'")),
    (j(1, "kind"), GONE, "joints[1].kind", ("is absent", "B1, B2 or B3")),
    (j(1, "lL"), -0.42, "joints[1].lL", ("greater than 0", "link L")),
    (j(1, "cylinder"), GONE, "joints[1].cylinder", ("is absent", "closed_length")),
    (j(1, "cylinder", "closed_length"), 0.0, "joints[1].cylinder.closed_length", ("greater than 0",)),
    (j(1, "cylinder", "closed_length"), GONE, "joints[1].cylinder.closed_length", ("is absent", "stroke 0")),
    (j(1, "cylinder", "max_stroke"), 0.0, "joints[1].cylinder.max_stroke", ("greater than 0",)),
    (j(1, "cylinder", "k"), 0, "joints[1].cylinder.k", ("greater than 0", "N/m")),
    (j(1, "cylinder", "rod", "mass"), -1, "joints[1].cylinder.rod.mass", ("not be less than 0",)),
]

UNKNOWN_KEYS: list[tuple[Place, Any, str, tuple[str, ...]]] = [
    (s(1, "rho_a"), 41.0, "sections[1].rho_a", ("unknown key in sections[1]", "nearest", "`rho_A`")),
    (s(1, "lenght"), 3.3, "sections[1].lenght", ("unknown key", "`length`")),
    (s(1, "k"), 3e7, "sections[1].k", ("`k` is a key of joints[i].cylinder", "nearest")),
    (j(1, "rod_pin"), [0, 0], "joints[1].rod_pin", ("is a key of sections[i]",)),
    (j(1, "cylinder", "maxstroke"), 1, "joints[1].cylinder.maxstroke", ("`max_stroke`",)),
    (("payload",), 40.0, "payload", ("`payload` is a key of tip",)),
    (("Gravity",), [0, -9.81], "Gravity", ("`gravity`",)),
    (("zzz",), 1, "zzz", ("nearest known key", "All of them: description, gravity")),
    (("base", "inclinaton"), 0.1, "base.inclinaton", ("`inclination`",)),
    (s(0, "86"), None, "sections[0].86", ("number stands where a key", "not a comma")),
    (("clearance",), {"pin": []}, "clearance.pin", ("`pins`",)),
    (("clearance",), {"law": "hertz"}, "clearance.law", ("`law` is a key of clearance.contact",)),
]

OIL = {"bore": 0.1, "rod": 0.07, "bulk_modulus": 1.5e9, "cap_line": 1e-3, "rod_line": 1e-3}

CONTRADICTIONS: list[tuple[Place, Any, str, tuple[str, ...]]] = [
    (s(1, "A"), GONE, "sections[1].A", ("is absent", "a section with a beam needs it", "m^2", "leave out `beam`")),
    (s(1, "I"), GONE, "sections[1].I", ("is absent", "m^4")),
    (s(1, "rho_A"), GONE, "sections[1].rho_A", ("is absent", "kg/m")),
    (s(1, "beam"), [-0.1, 3.0], "sections[1].beam", ("[-0.1, 3.0]", "0 <= x0 < x1 <= length = 3.3")),
    (s(1, "beam"), [0.25, 3.4], "sections[1].beam", ("length = 3.3", "inboard pivot")),
    (s(1, "beam"), [3.0, 0.25], "sections[1].beam", ("x0 < x1",)),
    (s(0, "rod_pin"), GONE, "sections[0].rod_pin", ("is absent", "cylinder 1", "rod pin")),
    (s(2, "rod_pin"), [0.5, 0.0], "sections[2].rod_pin", ("only the first section", "Remove it", "joints[2]")),
    (j(0, "C"), [0.1, 0.1], "joints[0].C", ("kind A has no links", "Remove `C`")),
    (j(0, "mL"), 3.0, "joints[0].mL", ("kind A has no links", "Remove `mL`")),
    (j(1, "R"), [0.1, 0.1], "joints[1].R", ("kind B1", "where the links meet", "Remove `R`")),
    (j(2, "R"), GONE, "joints[2].R", ("is absent", "kind B2 needs it", "rod pin on its link")),
    (j(3, "R"), GONE, "joints[3].R", ("is absent", "kind B3 needs it")),
    *((j(1, key), GONE, f"joints[1].{key}", ("is absent", "kind B1 needs it")) for key in ("C", "D", "E", "lL", "lR")),
    (j(0, "side"), "left", "joints[0].side", ("kind A has no links", "Remove `side`")),
    (j(1, "side"), "up", "joints[1].side", ("'up'", "'left' or 'right'", "where the links meet")),
    (j(1, "cylinder", "oil"), OIL, "joints[1].cylinder.oil", ("k = 3e+07 N/m too", "Remove k, or remove oil")),
    (j(1, "cylinder", "oil"), OIL | {"rod": 0.1}, "joints[1].cylinder.oil.rod", ("thinner than the bore, 0.1 m", "diameters")),
    (j(1, "cylinder", "oil"), OIL | {"bulk_modulus": 1.5}, "joints[1].cylinder.oil.bulk_modulus", ("not be less than 1e+07",)),
    (j(1, "cylinder", "oil"), OIL | {"bore": 160}, "joints[1].cylinder.oil.bore", ("not be more than 1", "piston, m")),
    (j(1, "cylinder", "oil"), OIL | {"bore": 1e-9}, "joints[1].cylinder.oil.bore", ("not be less than 0.001", "piston, m")),
    (j(1, "cylinder", "oil"), {"bore": 0.1}, "joints[1].cylinder.oil.bulk_modulus", ("is absent", "Pa")),
    (j(1, "cylinder", "oil"), OIL | {"rod_line": -1.0}, "joints[1].cylinder.oil.rod_line", ("not be less than 0", "m^3")),
    (j(1, "cylinder", "oil"), OIL | {"Bore": 0.1}, "joints[1].cylinder.oil.Bore", ("unknown key", "`bore`")),
    (j(1, "cylinder", "max_stroke"), GONE, "joints[1].cylinder.max_stroke", ("is absent", "the largest stroke, m")),
    (j(1, "cylinder", "k"), GONE, "joints[1].cylinder.d", ("90000.0", "incompressible", "Give k", "remove d")),
    (j(1, "range_deg"), [10, -165], "joints[1].range_deg", ("low < high", "lower angle first")),
    (j(1, "range_deg"), [-165, 400], "joints[1].range_deg", ("360",)),
    (("postures", "arch"), [60, 20, -30], "postures.arch", ("it has 3 angles", "4 sections", "one angle per section")),
    (j(1, "D"), [-0.4, -0.04], "joints[1].D", ("rigid head of sections[0]", "x >= -0.26", "x1 <= 3.46")),
    (j(1, "E"), [0.3, 0.062], "joints[1].E", ("rigid root of sections[1]", "x <= 0.25", "x0 >= 0.3")),
]

GEOMETRY: list[tuple[Place, Any, str, tuple[str, ...]]] = [
    (j(1, "lL"), 5.0, "joints[1].range_deg", ("do not meet at any angle", "Check D, E, lL and lR")),
    (j(1, "cylinder", "closed_length"), 3.0, "joints[1].cylinder.closed_length",
     ("from pin to pin", "3 to 3.42 m long", "closed_length and max_stroke")),
    (s(0, "rod_pin"), [0.0, 0.0], "joints[0].range_deg", ("stays 1.329 m long", "cannot turn the joint")),
    (("postures", "arch", 1), 80, "postures.arch[1]", ("`arch` turns joint 2 to 20 deg", "[-165, 10]", "difference")),
    (j(2, "cylinder", "max_stroke"), 0.1, "postures.arch[2]",
     ("`arch` turns joint 3 to -50 deg", "a stroke of", "cylinder 3 has 0 to 0.1 m", "max_stroke")),
]  # fmt: skip


@pytest.mark.parametrize(("place", "value", "path", "words"), SINGLE_VALUES + UNKNOWN_KEYS + CONTRADICTIONS + GEOMETRY)
def test_a_fault_names_place_value_bound_and_remedy(
    bench: Any, place: Place, value: Any, path: str, words: tuple[str, ...]
) -> None:
    faults = {fault.path: fault for fault in bench.faults(lambda values: put(values, place, value))}
    assert path in faults, f"found only {sorted(faults)}"
    text = str(faults[path])
    assert [word for word in words if word not in text] == [], text
    assert faults[path].remedy.strip(), text


@pytest.mark.parametrize(("place", "value", "path", "words"), SINGLE_VALUES + UNKNOWN_KEYS)
def test_a_wrong_value_or_key_is_the_only_fault_of_its_place(
    bench: Any, place: Place, value: Any, path: str, words: tuple[str, ...]
) -> None:
    faults = bench.faults(lambda values: put(values, place, value))
    assert [fault.path for fault in faults if not fault.path.startswith("postures") or "postures" in place] == [path]


@pytest.mark.parametrize("key", ["A", "I", "rho_A", "rho_I", "beta", "modes", "head"])
def test_a_rigid_section_must_not_have_the_keys_of_a_beam(bench: Any, key: str) -> None:
    def edit(values: Any) -> None:
        rigid = {"length": 3.3, "root": {"mass": 100, "com": [1.6, 0], "inertia": 90}}
        own = values["sections"][1] | {"modes": 3}
        values["sections"][1] = rigid | {key: own[key]}

    (fault,) = bench.faults(edit)
    assert fault.path == f"sections[1].{key}"
    assert "no `beam`" in fault.bound and f"Remove `{key}`" in fault.remedy


def test_a_rigid_section_needs_a_root(bench: Any) -> None:
    (fault,) = bench.faults(lambda values: put(values, s(3), {"length": 3.1}))
    assert (fault.path, fault.value) == ("sections[3].root", ABSENT)
    assert "all of it" in fault.bound and "mass" in fault.remedy


def test_joint_1_must_be_of_kind_a(bench: Any) -> None:
    faults = bench.faults(lambda values: values["joints"].reverse())
    kinds = {fault.path: str(fault) for fault in faults if fault.path.endswith("kind")}
    assert "must be of kind A" in kinds["joints[0].kind"]
    assert "only joint 1" in kinds["joints[3].kind"]


def test_as_many_joints_as_sections(bench: Any) -> None:
    def edit(values: Any) -> None:
        del values["joints"][3]

    (fault,) = bench.faults(edit)
    assert (fault.path, fault.value) == ("joints", 3)
    assert "4 sections" in fault.bound


def test_pins_of_links_may_sit_anywhere_on_rigid_sections(bench: Any) -> None:
    def edit(values: Any) -> None:
        values["modes"] = 0
        values["sections"][0]["beam"] = [0.6, 3.8]
        values["sections"][1]["beam"] = [0.05, 3.05]

    assert bench.faults(edit) == ()


def test_all_faults_are_reported_at_once(bench: Any) -> None:
    def edit(values: Any) -> None:
        put(values, ("material", "E"), "206e9")
        put(values, s(0, "root", "mass"), -36)
        put(values, s(1, "rho_a"), 41)
        put(values, s(2, "I"), GONE)
        put(values, j(1, "lL"), 5.0)
        put(values, j(2, "cylinder", "k"), GONE)
        put(values, j(3, "kind"), "B9")
        put(values, ("postures", "low"), [45, 0])
        put(values, ("clearance",), {"joints": []})

    path = bench.edited(edit)
    with pytest.raises(SceneError, match="9 faults") as caught:
        load_scene(path)
    assert {fault.path for fault in caught.value.faults} == {
        "material.E", "sections[0].root.mass", "sections[1].rho_a", "sections[2].I", "joints[1].range_deg",
        "joints[2].cylinder.d", "joints[3].kind", "postures.low", "clearance.joints",
    }  # fmt: skip
    assert caught.value.source == str(path)


def test_faults_come_with_their_line_in_the_order_of_the_file(bench: Any) -> None:
    text = default_text().replace("mass: 12.0, com: [0.12", "mass: -12.0, com: [0.12").replace("nu: 0.3", "nu: 0.9")
    faults = bench.faults_of(bench.text(text))
    rows = text.splitlines()
    assert [fault.path for fault in faults] == ["material.nu", "sections[1].root.mass"]
    assert "nu: 0.9" in rows[faults[0].line - 1] and "mass: -12.0" in rows[faults[1].line - 1]
    assert str(faults[0]).startswith(f"line {faults[0].line}: material.nu = 0.9: ")


def test_twice_the_same_key(bench: Any) -> None:
    text = default_text().replace(
        "beta: 1.0e-3,\n     root: {mass: 36.0", "beta: 1.0e-3, beta: 2.0e-3,\n     root: {mass: 36.0"
    )
    faults = bench.faults_of(bench.text(text))
    assert [(fault.path, fault.value) for fault in faults] == [("sections[0].beta", 1e-3)]
    assert "there twice" in faults[0].bound and "Keep one" in faults[0].remedy


def test_every_duplicate_is_reported(bench: Any) -> None:
    faults = bench.faults_of(bench.text(default_text() + "\nmodes: 1\nmodes: 2\ngravity: [0, 0]\n"))
    assert sorted(fault.path for fault in faults) == ["gravity", "modes"]


def test_a_yes_is_text_and_no_number(bench: Any) -> None:
    (fault,) = bench.faults_of(bench.text(default_text() + "\nline_fill: yes\n"))
    assert fault.path == "line_fill" and "not text" in fault.bound
