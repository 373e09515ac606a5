"""Everything that only warns, by a minimal edit of the default scene."""

from __future__ import annotations

from typing import Any

import pytest

from boom_twin.errors import SceneError
from boom_twin.scene import load_scene
from boom_twin.scene.summary import explain

Place = tuple[str | int, ...]


def put(values: Any, place: Place, value: Any) -> None:
    """Set what is at a place."""
    for step in place[:-1]:
        values = values[step]
    values[place[-1]] = value


def s(i: int, *rest: str | int) -> Place:
    return ("sections", i, *rest)


def j(i: int, *rest: str | int) -> Place:
    return ("joints", i, *rest)


OIL = {"bore": 0.1, "rod": 0.07, "bulk_modulus": 1.5e9, "cap_line": 1e-3, "rod_line": 1e-3}

UNITS: list[tuple[Place, Any, str, tuple[str, ...]]] = [
    (("material", "E"), 206.0, "material.E", ("GPa", "206 GPa are 2.06e+11")),
    (("material", "E"), 206000.0, "material.E", ("MPa", "206000 MPa are 2.06e+11")),
    (("material", "rho"), 7.85, "material.rho", ("g/cm^3", "7850")),
    (("base", "inclination"), 5.0, "base.inclination", ("degrees?", "radians")),
    (("base", "inclination"), -5, "base.inclination", ("degrees?",)),
    (s(0, "root", "mass"), 3.6e5, "sections[0].root.mass", ("grams?", "360")),
    (s(1, "A"), 39.0, "sections[1].A", ("cm^2", "m^2")),
    (s(1, "I"), 2000.0, "sections[1].I", ("cm^4", "m^4")),
    (s(1, "rho_A"), 7850.0, "sections[1].rho_A", ("density", "one metre")),
    (("line_fill",), 600, "line_fill", ("kg/m", "one metre")),
    (("tip",), {"payload": 4e5}, "tip.payload", ("grams?",)),
    (j(1, "mL"), 4e6, "joints[1].mL", ("grams?",)),
    (j(1, "cylinder", "k"), 30.0, "joints[1].cylinder.k", ("kN/mm?", "30 kN/mm are 3e+07")),
    (j(1, "cylinder", "oil"), OIL | {"cap_line": 2.0}, "joints[1].cylinder.oil.cap_line", ("litres?", "1e-3")),
    (j(1, "cylinder", "oil"), OIL | {"rod_line": 0.0}, "joints[1].cylinder.oil.rod_line", ("full stroke, 0.42 m",)),
    (("gravity",), [0.0, -1.62], "gravity", ("9.81", "[0.0, -9.81]")),
    (("gravity",), [0.0, 9.81], "gravity", ("upwards",)),
    (("postures", "bent"), [1.05, 0.35, -0.52, -1.4], "postures.bent", ("radians?", "degrees")),
]

GEOMETRY: list[tuple[Place, Any, str, tuple[str, ...]]] = [
    (j(0, "range_deg"), [-5, 95], "joints[0].range_deg",
     ("out of reach at 87.8 to 95.0 deg", "Narrow range_deg to [-5, 87]", "closed_length 1.086 and max_stroke 0.812")),
    (j(1, "lL"), 0.55, "joints[1].range_deg",
     ("do not meet at -165.0 to -115.4 deg", "Narrow range_deg to [-49, 10]", "|lL - lR| = 0.173 m must be less")),
    (s(0, "rod_pin"), [0.61, -0.12], "sections[0].rod_pin", ("splits the beam 10 mm from its end", "x = 0.61")),
    (s(1, "head", "com"), [-3.18, 0.0], "sections[1].head.com", ("far outside", "inboard pivot")),
    (s(1, "root", "com"), [0.12, 2.0], "sections[1].root.com", ("far outside",)),
]  # fmt: skip


@pytest.mark.parametrize(("place", "value", "path", "words"), UNITS + GEOMETRY)
def test_an_odd_value_warns_and_loads(bench: Any, place: Place, value: Any, path: str, words: tuple[str, ...]) -> None:
    def edit(values: Any) -> None:
        if path.startswith("joints"):
            values["postures"] = {"arch": values["postures"]["arch"]}
        if "oil" in place:
            del values["joints"][1]["cylinder"]["k"]
        put(values, place, value)

    texts = [str(oddity) for oddity in bench.oddities(edit) if oddity.path == path]
    assert any(all(word in text for word in words) for text in texts), texts


def test_a_stroke_that_turns_back_warns(bench: Any) -> None:
    def edit(values: Any) -> None:
        put(values, j(0, "range_deg"), [-90, 85])
        values["joints"][0]["cylinder"].update(closed_length=0.7, max_stroke=1.2)

    (oddity,) = bench.oddities(edit)
    assert oddity.path == "joints[0].range_deg"
    assert "turns back at -58.9 deg" in oddity.bound and "two angles" in oddity.bound
    assert "Narrow range_deg to [-51, 85], which keeps a quarter of the largest lever" in oddity.remedy


DEAD_CENTRES = {
    "links": (
        1,
        [-60, 25],
        {"lL": 0.2, "lR": 0.0808},
        ("next to a dead centre of the links at -14.3 to -8.5", "at least 5 deg"),
    ),
    "slider-crank": (0, [-54, 22], {}, ("next to a dead centre of the cylinder at -54", "a quarter of the largest")),
}


@pytest.mark.parametrize("case", DEAD_CENTRES)
def test_a_range_that_ends_next_to_a_dead_centre_warns_and_the_suggested_one_keeps_clear_of_it(bench: Any, case: str) -> None:
    i, whole, keys, words = DEAD_CENTRES[case]

    def edit(values: Any, angles: list[float]) -> None:
        values["postures"] = {"straight": [0, 0, 0, 0]}
        values["joints"][i].update(keys, range_deg=angles)
        values["joints"][i]["cylinder"].update(
            [{"closed_length": 0.72, "max_stroke": 0.68}, {"closed_length": 0.55, "max_stroke": 0.5}][i]
        )

    (oddity,) = bench.oddities(lambda values: edit(values, whole))
    assert oddity.path == f"joints[{i}].range_deg" and all(word in oddity.bound for word in words), str(oddity)
    low = float(oddity.remedy.partition("[")[2].partition(",")[0])
    assert low > whole[0] and bench.oddities(lambda values: edit(values, [low, whole[1]])) == []
    scene = load_scene(bench.edited(lambda values: edit(values, [low, whole[1]])))
    found = explain(scene).joints[i].linkage
    assert found.lever[0] >= 0.25 * found.lever[1] and (found.transmission_deg is None or found.transmission_deg >= 5.0)


def test_one_warning_tells_all_that_is_wrong_with_a_range_and_its_remedy_mends_it(bench: Any) -> None:
    def edit(values: Any, low: float) -> None:
        values["postures"] = {"straight": [0, 0, 0, 0]}
        values["joints"][1].update(range_deg=[low, 10], lL=0.5)
        values["joints"][1]["cylinder"].update(closed_length=0.7, max_stroke=0.6)

    (oddity,) = bench.oddities(lambda values: edit(values, -179))
    assert oddity.path == "joints[1].range_deg"
    assert all(words in oddity.bound for words in ("do not meet at", "turns back at"))
    low = float(oddity.remedy.partition("[")[2].partition(",")[0])
    assert bench.oddities(lambda values: edit(values, low)) == []
    assert len(bench.oddities(lambda values: edit(values, low - 2))) == 1


def test_a_joint_range_in_radians_warns(bench: Any) -> None:
    def edit(values: Any) -> None:
        values["postures"] = {}
        values["joints"][0]["range_deg"] = [-0.09, 1.48]

    (oddity,) = bench.oddities(edit)
    assert oddity.path == "joints[0].range_deg" and "radians?" in oddity.bound and "84.8" in oddity.remedy


def _scaled(value: Any, factor: float) -> Any:
    return [item * factor for item in value] if isinstance(value, list) else value * factor


def test_a_scene_in_millimetres_warns_at_its_lengths(bench: Any) -> None:
    lengths = ("length", "beam", "rod_pin", "C", "D", "E", "R", "lL", "lR", "closed_length", "max_stroke", "com")

    def edit(values: Any) -> None:
        values["base"]["cylinder_pin"] = _scaled(values["base"]["cylinder_pin"], 1000)
        blocks = [*values["sections"], *values["joints"], *(joint["cylinder"] for joint in values["joints"])]
        blocks += [section[end] for section in values["sections"] for end in ("root", "head")]
        for block in blocks:
            block.update({key: _scaled(block[key], 1000) for key in lengths if key in block})

    paths = {oddity.path for oddity in bench.oddities(edit) if "mm?" in oddity.bound}
    assert {"base.cylinder_pin", "sections[0].length", "sections[0].head.com", "joints[1].lL"} <= paths
    assert "joints[1].cylinder.closed_length" in paths and "joints[1].E" not in paths


def test_a_weightless_rigid_section_warns(bench: Any) -> None:
    def edit(values: Any) -> None:
        values["sections"][3] = {"length": 3.1, "root": {"mass": 0, "com": [1.5, 0], "inertia": 0}}

    (oddity,) = bench.oddities(edit)
    assert oddity.path == "sections[3].root.mass" and "weighs nothing" in oddity.bound


def test_c_measured_from_the_wrong_pivot_is_pointed_out(bench: Any) -> None:
    with pytest.raises(SceneError, match="check the pins") as caught:
        load_scene(bench.edited(lambda values: put(values, j(1, "C"), [3.044, 0.18])))
    assert [fault.path for fault in caught.value.faults] == ["joints[1].cylinder.closed_length"]
    (oddity,) = [oddity for oddity in caught.value.oddities if oddity.path == "joints[1].C"]
    assert "OUTBOARD" in oddity.remedy
    assert "warning: line" in str(caught.value)


def test_oddities_come_in_the_order_of_the_file(bench: Any) -> None:
    def edit(values: Any) -> None:
        put(values, s(1, "A"), 39.0)
        put(values, ("material", "E"), 206.0)
        put(values, ("gravity",), [0, -1.62])

    lines = [oddity.line for oddity in bench.oddities(edit)]
    assert len(lines) == 3 and lines == sorted(lines)


@pytest.mark.parametrize(("place", "path"), [(("modes",), "modes"), (("sections", 1, "modes"), "sections[1].modes")])
def test_a_single_bending_coordinate_warns_of_what_it_costs(bench: Any, place: Any, path: str) -> None:
    (oddity,) = bench.oddities(lambda values: put(values, place, 1))
    assert oddity.path == path and "21 %" in oddity.bound and "Take 2 or 3" in oddity.remedy
    assert bench.oddities(lambda values: put(values, place, 2)) == []
