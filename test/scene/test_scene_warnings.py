"""Everything that only warns, by a minimal edit of the default scene: units, geometry, and slips of a newcomer."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from command import main
from default_boom import clearance_text, default_text, example_names, example_text, with_end_mark
from scene.editing import OIL, put

from boom_twin import SceneError, load_scene
from boom_twin.scene.summary import explain

# Each row: the place that is edited and, if it is another one, the place of the warning; the new value; words of the message.
UNITS = [
    ("material.E", 206.0, "GPa", "206 GPa are 2.06e+11"),
    ("material.rho", 7.85, "g/cm^3", "7850"),
    ("sections[0].root.mass", 3.6e5, "grams?", "360"),
    ("sections[1].A", 39.0, "cm^2", "m^2"),
    ("sections[1].I", 2000.0, "cm^4", "m^4"),
    ("sections[1].rho_A", 7850.0, "density", "one metre"),
    ("joints[1].mL", 4e6, "grams?"),
    ("joints[1].cylinder.k", 30.0, "kN/mm?", "30 kN/mm are 3e+07"),
    ("joints[1].cylinder.oil -> joints[1].cylinder.oil.cap_line", OIL | {"cap_line": 2.0}, "litres?", "1e-3"),
    ("joints[1].cylinder.oil -> joints[1].cylinder.oil.rod_line", OIL | {"rod_line": 0.0}, "full stroke, 0.42 m"),
    ("gravity", [0.0, 9.81], "along -y, which is down"),
    ("gravity", [0.0, -1.62], "9.81", "[0.0, -9.81]"),
    ("postures.bent", [1.05, 0.35, -0.52, -1.4], "radians?", "degrees"),
]  # fmt: skip

GEOMETRY = [
    ("joints[0].range_deg", [-5, 95], "out of reach at 87.8 to 95.0 deg", "Narrow range_deg to [-5, 87]",
     "closed_length 1.086 and max_stroke 0.812"),
    ("joints[1].lL -> joints[1].range_deg", 0.55, "do not meet at -165.0 to -115.4 deg", "Narrow range_deg to [-49, 10]",
     "|lL - lR| = 0.173 m must be less"),
    ("sections[1].head.com", [-3.18, 0.0], "inside the head", "INBOARD pivot"),
]  # fmt: skip

SLIPS = [
    ("joints[0].cylinder.k", 40e3, "kN/m?", "4e+07"),
    ("joints[0].cylinder.k", 4e8, "a bore of 0.26 m", "at most 0.165 m"),
    ("joints[1].cylinder.k", 3e6, "gives way by", "2 % of its stroke"),
    ("joints[0].cylinder.d", 120.0, "alone it damps a mode of 0.95 Hz by"),
    ("sections[2].beta", 0.02, "2 zeta / omega"),
    ("sections[0].I", 0.00036, "sqrt(I/A)", "expected"),
    ("sections[1].height -> sections[1].I", 17.2, "for a box 17.2 m high"),
    ("sections[0].rho_A", 5.2, "rho A"),
    ("sections[0].rho_I", 7850.0, "rho I"),
    ("sections[1].head.com", [-0.12, 0.0], "INBOARD"),
    ("sections[0].root.com", [1.3, 0.0], "inside the root"),
    ("sections[0].head.inertia", 222.0, "OWN centre"),
    ("sections[0].root.mass", 0.036, "not tonnes"),
    ("joints[1].mL", 40.0, "25.8 kg", "not N"),
    ("joints[1].cylinder.barrel.mass -> joints[1].cylinder.barrel.inertia", 0.016, "gyration"),
    ("joints[2].cylinder.rod.com", 1.0, "rod pin"),
    ("sections[0].beam", [0.6, 3.0], "length of the beam, then x1 = 3.6"),
    ("gravity", [0.5, -9.797], "-y", "base.inclination"),
    ("base.inclination", 0.25, "0.2 rad"),
    ("base -> base.damping", {"pivot": [0.0, 0.0], "cylinder_pin": [0.45, -1.25], "stiffness": 5e6, "damping": 5e8}, "zeta"),
    ("base.stiffness", 5e3, "kN m/rad?", "5e+06"),
    ("material.E", 7e10, "1.7e+11 to 2.3e+11", "density of steel"),
    ("line_fill", 400.0, "whole load"),
    ("joints[1].cylinder.max_stroke", 1.13, "not the open length"),
    ("tip -> tip.payload", {"payload": 40000.0}, "half of what the boom weighs"),
]  # fmt: skip


@pytest.mark.parametrize("row", UNITS + GEOMETRY + SLIPS, ids=lambda row: f"{row[0]}-{row[2]}")
def test_an_odd_value_loads_and_is_warned_of_at_its_key(bench: Any, row: tuple[Any, ...]) -> None:
    (place, _, path), value, words = row[0].partition(" -> "), row[1], row[2:]
    path = path or place

    def edit(values: Any) -> None:
        if path.startswith("joints"):
            values["postures"] = {"arch": values["postures"]["arch"]}
        if "oil" in place:
            del values["joints"][1]["cylinder"]["k"]
        put(values, place, value)

    oddities = bench.oddities(edit)
    texts = [str(oddity) for oddity in oddities if oddity.path == path and oddity.remedy]
    assert any(all(word in text for word in words) for text in texts), [str(oddity) for oddity in oddities]
    assert row not in SLIPS or len(oddities) <= 2, [str(oddity) for oddity in oddities]


@pytest.mark.parametrize(("law", "given"), [("lankarani-nikravesh", "0.725"), ("flores", "0.470")])
def test_a_clearance_that_is_wide_and_a_law_that_does_not_keep_its_restitution_are_warned_of(
    bench: Any, law: str, given: str
) -> None:
    pin = {"at": "cylinder_1.rod", "pin_radius": 0.03, "radial_clearance": 0.004}
    block = {"contact": {"law": law, "restitution": 0.5}, "pins": [pin]}
    contact, wide = sorted(bench.oddities(lambda values: values.update(clearance=block)), key=lambda each: each.path)
    assert (
        contact.path == "clearance.contact.restitution" and given in contact.bound and "hunt-crossley-exact" in contact.remedy
    )
    assert wide.path == "clearance.pins[0].radial_clearance" and "more than a tenth of pin_radius" in wide.bound
    block["contact"]["law"], pin["radial_clearance"] = "hunt-crossley-exact", 1e-4
    assert bench.oddities(lambda values: values.update(clearance=block)) == []


LINKS = {"lL": 0.2, "lR": 0.0808}
DEAD_CENTRES = {
    "links": (1, [-60, 25], LINKS, ("next to a dead centre of the links at -14.3 to -8.5", "at least 5 deg")),
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
    low = first_number(oddity.remedy)
    assert low > whole[0] and bench.oddities(lambda values: edit(values, [low, whole[1]])) == []
    found = explain(load_scene(bench.edited(lambda values: edit(values, [low, whole[1]])))).joints[i]
    assert found.lever[0] >= 0.25 * found.lever[1] and (found.transmission_deg is None or found.transmission_deg >= 5.0)


def first_number(remedy: str) -> float:
    """Return the lower end of the range that a remedy suggests."""
    return float(remedy.partition("[")[2].partition(",")[0])


def test_a_scene_in_millimetres_warns_at_its_lengths(bench: Any) -> None:
    lengths = ("length", "beam", "rod_pin", "C", "D", "E", "R", "lL", "lR", "closed_length", "max_stroke", "com")

    def scaled(value: Any) -> Any:
        return [item * 1000 for item in value] if isinstance(value, list) else value * 1000

    def edit(values: Any) -> None:
        values["base"]["cylinder_pin"] = scaled(values["base"]["cylinder_pin"])
        blocks = [*values["sections"], *values["joints"], *(joint["cylinder"] for joint in values["joints"])]
        blocks += [section[end] for section in values["sections"] for end in ("root", "head")]
        for block in blocks:
            block.update({key: scaled(block[key]) for key in lengths if key in block})

    paths = {oddity.path for oddity in bench.oddities(edit) if "mm?" in oddity.bound}
    assert {"base.cylinder_pin", "sections[0].length", "sections[0].head.com", "joints[1].lL"} <= paths
    assert "joints[1].cylinder.closed_length" in paths and "joints[1].E" not in paths


def test_c_measured_from_the_wrong_pivot_is_pointed_out(bench: Any) -> None:
    with pytest.raises(SceneError, match="check the pins") as caught:
        load_scene(bench.edited(lambda values: put(values, "joints[1].C", [3.044, 0.18])))
    assert [fault.path for fault in caught.value.faults] == ["joints[1].cylinder.closed_length"]
    (oddity,) = [oddity for oddity in caught.value.oddities if oddity.path == "joints[1].C"]
    assert "OUTBOARD" in oddity.remedy and "warning: line" in str(caught.value)


def test_incompressible_cylinders_are_not_called_too_stiff(bench: Any) -> None:
    """What is left out of the model is no slip."""

    def edit(values: Any) -> None:
        for joint, section in zip(values["joints"], values["sections"], strict=True):
            del joint["cylinder"]["k"], joint["cylinder"]["d"]
            section["modes"] = 3 if section is values["sections"][3] else 0

    assert [str(oddity) for oddity in bench.oddities(edit)] == []


def test_sound_scenes_have_no_warning(bench: Any) -> None:
    whole = (Path(__file__).parents[2] / "examples" / "two_section_boom.yaml").read_text(encoding="utf-8")
    clearance = with_end_mark(f"{default_text()}\n{clearance_text()}")
    loaded = with_end_mark(f"{default_text()}\nline_fill: 20.0\ntip: {{payload: 40.0}}")
    for text in (default_text(), clearance, whole, loaded, *map(example_text, example_names())):
        assert main(["check", "--strict", str(bench.text(text))]) == 0
