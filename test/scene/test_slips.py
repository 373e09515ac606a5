"""Slips of a newcomer, each by one edit of the default scene: all load, all are warned of at the key that is wrong."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from ruamel.yaml import YAML

from boom_twin.cli.main import main
from boom_twin.scene.checks.joint_clearance import passes_of
from boom_twin.scene.kinematics import skeleton
from boom_twin.scene.load import clearance_text, default_text, examine, examine_text, example_names, example_text
from boom_twin.scene.yaml_reader import text_of, with_end_mark

Place = tuple[str | int, ...]


def s(i: int, *rest: str | int) -> Place:
    return ("sections", i, *rest)


def j(i: int, *rest: str | int) -> Place:
    return ("joints", i, *rest)


SLIPS: dict[str, tuple[Place, Any, str, tuple[str, ...]]] = {
    "k in kN/m": (j(0, "cylinder", "k"), 40e3, "joints[0].cylinder.k", ("kN/m?", "4e+07")),
    "k of the last cylinder in kN/m": (j(3, "cylinder", "k"), 6e3, "joints[3].cylinder.k", ("kN/m?", "6e+06")),
    "k in kN/mm": (j(3, "cylinder", "k"), 6.0, "joints[3].cylinder.k", ("kN/mm?", "6e+06")),
    "k ten times too large": (j(0, "cylinder", "k"), 4e8, "joints[0].cylinder.k", ("a bore of 0.26 m", "at most 0.16 m")),
    "k ten times too small": (j(1, "cylinder", "k"), 3.0e6, "joints[1].cylinder.k", ("gives way by", "2 % of its stroke")),
    "k in N/m times a thousand": (j(2, "cylinder", "k"), 2e10, "joints[2].cylinder.k", ("expected from 1e6 to 1e9",)),
    "d in kN s/m": (j(0, "cylinder", "d"), 120.0, "joints[0].cylinder.d", ("would damp a mode of",)),
    "d 100 times too large": (j(1, "cylinder", "d"), 9e6, "joints[1].cylinder.d", ("would damp a mode of",)),
    "beta in ms": (s(0, "beta"), 1.0, "sections[0].beta", ("would damp a mode of",)),
    "beta as damping ratio": (s(2, "beta"), 0.02, "sections[2].beta", ("2 zeta / omega",)),
    "I decimal": (s(0, "I"), 3.6e-4, "sections[0].I", ("sqrt(I/A)", "expected")),
    "I of another power": (s(1, "I"), 2.0e-6, "sections[1].I", ("walls of",)),
    "A decimal": (s(0, "A"), 4.9e-4, "sections[0].I", ("sqrt(I/A)",)),
    "height in cm": (s(1, "height"), 17.2, "sections[1].I", ("for a box 17.2 m high",)),
    "height as half of it": (s(0, "height"), 0.1, "sections[0].I", ("0.1 m high",)),
    "rho_A of the box less pipe, decimal": (s(0, "rho_A"), 5.2, "sections[0].rho_A", ("rho A",)),
    "rho_A is less than rho A": (s(2, "rho_A"), 20.0, "sections[2].rho_A", ("expected 23.6 to",)),
    "rho_A of the whole section": (s(1, "rho_A"), 160.0, "sections[1].rho_A", ("one metre",)),
    "rho_I as rho": (s(0, "rho_I"), 7850.0, "sections[0].rho_I", ("rho I",)),
    "centre of a head from the outboard pivot": (s(1, "head", "com"), [-0.12, 0.0], "sections[1].head.com", ("INBOARD",)),
    "centre of a root in the beam": (s(0, "root", "com"), [1.3, 0.0], "sections[0].root.com", ("inside the root",)),
    "inertia about the pivot": (s(0, "head", "inertia"), 222.0, "sections[0].head.inertia", ("OWN centre",)),
    "mass of a root in t": (s(0, "root", "mass"), 0.036, "sections[0].root.mass", ("not tonnes",)),
    "mass of a head in g": (s(1, "head", "mass"), 13000.0, "sections[1].head.mass", ("not grams",)),
    "mass of a link in g": (j(1, "mL"), 4000.0, "joints[1].mL", ("not grams",)),
    "mass of a link in N": (j(1, "mL"), 40.0, "joints[1].mL", ("26 kg", "not N")),
    "mass of a barrel in t": (j(1, "cylinder", "barrel", "mass"), 0.016, "joints[1].cylinder.barrel.inertia", ("gyration",)),
    "centre of a rod from the other pin": (j(2, "cylinder", "rod", "com"), 1.0, "joints[2].cylinder.rod.com", ("rod pin",)),
    "beam end as length": (s(0, "beam"), [0.6, 3.0], "sections[0].beam", ("length of the beam, then x1 = 3.6",)),
    "beam end as length, section 3": (s(2, "beam"), [0.25, 2.45], "sections[2].beam", ("x1 = 2.7",)),
    "gravity along x": (("gravity",), [-9.81, 0.0], "gravity", ("-y", "base.inclination")),
    "gravity for a slope": (("gravity",), [0.5, -9.797], "gravity", ("-y", "base.inclination")),
    "inclination in degrees": (("base", "inclination"), 3.0, "base.inclination", ("degrees?",)),
    "inclination of half a radian": (("base", "inclination"), 0.25, "base.inclination", ("0.2 rad",)),
    "E of another power": (("material", "E"), 2.06e10, "material.E", ("expected from 6.3e+10",)),
    "E of aluminium": (("material", "E"), 7e10, "material.E", ("1.7e+11 to 2.3e+11", "density of steel")),
    "rho in g/cm^3": (("material", "rho"), 7.85, "material.rho", ("g/cm^3", "7850")),
    "rho in kN/m^3": (("material", "rho"), 77.0, "material.E", ("with a density of 77",)),
    "a centre in mm": (s(0, "root", "com"), [300.0, 0.0], "sections[0].root.com", ("mm?",)),
    "a length in mm": (s(0, "length"), 3860.0, "sections[0].length", ("mm?",)),
    "concrete as a whole": (("line_fill",), 400.0, "line_fill", ("whole load",)),
    "open length as stroke": (j(1, "cylinder", "max_stroke"), 1.13, "joints[1].cylinder.max_stroke", ("not the open length",)),
    "payload in g": (("tip",), {"payload": 40e3}, "tip.payload", ("half of what the boom weighs",)),
    "stiffness falls outwards too fast": (s(3, "I"), 0.45e-6, "sections[3].I", ("expected",)),
}


@pytest.mark.parametrize("slip", SLIPS)
def test_a_slip_is_warned_of_at_its_key(bench: Any, slip: str) -> None:
    place, value, path, words = SLIPS[slip]

    def edit(values: Any) -> None:
        for step in place[:-1]:
            values = values[step]
        values[place[-1]] = value

    told = {oddity.path: oddity for oddity in bench.oddities(edit)}
    assert path in told, [str(oddity) for oddity in told.values()]
    assert told[path].remedy and all(word in str(told[path]) for word in words), str(told[path])
    assert len(told) <= 2, [str(oddity) for oddity in told.values()]


PASSING = {
    "mirrored": (2, (1.37, 0.75), {"C": [-1.994, -0.146], "D": [-0.301, 0.032], "E": [0.25, -0.285], "lL": 0.791, "lR": 0.629},
                 ("0.115 m", "[-5, ")),
    "left": (1, (2.40, 1.18), {"C": [-3.019, 0.475], "D": [-0.164, -0.196], "E": [0.05, 0.355], "lL": 0.669, "lR": 0.599},
             ("0.135 m", "[-165, 5]")),
}  # fmt: skip
"""Six-bars of the Z fold, with bore and rod known, whose rods pass the pivot: what is needed, and the range to narrow to."""


@pytest.mark.parametrize("case", PASSING)
def test_a_rod_that_passes_a_pin_is_warned_of(case: str) -> None:
    i, (closed, stroke), keys, words = PASSING[case]
    values = YAML(typ="safe", pure=True).load(example_text("five_section_z_fold"))
    values["joints"][i].update(keys)
    values["joints"][i]["cylinder"].update(closed_length=closed, max_stroke=stroke)
    (told,) = examine_text(text_of(values), "scene")[1]
    assert told.path == f"joints[{i}].C"
    assert all(word in str(told) for word in (*words, "of cylinder", "from the pivot")), str(told)
    low, high = (float(angle) for angle in told.remedy.rpartition("[")[2].rstrip("].").split(","))
    values["joints"][i]["range_deg"], values["postures"] = [low, high], {"arch": values["postures"]["arch"]}
    assert examine_text(text_of(values), "scene")[1] == []


CLOSE = {
    "with oil": ("five_section_z_fold", 1, {"D": [-0.16, -0.16], "E": [0.03, 0.24], "lL": 0.66}, "0.163 m"),
    "without": (None, 1, {"D": [-0.13, -0.04], "E": [0.116, 0.039], "lR": 0.405}, "0.043 m"),
}


@pytest.mark.parametrize("case", CLOSE)
def test_pins_that_come_too_close_are_warned_of_with_the_range_that_keeps_them_apart(case: str) -> None:
    name, i, keys, needed = CLOSE[case]
    values = YAML(typ="safe", pure=True).load(example_text(name) if name else default_text())
    values["joints"][i].update(keys)
    cylinder = values["joints"][i]["cylinder"]
    cylinder.update(closed_length=cylinder["closed_length"] - 0.03, max_stroke=cylinder["max_stroke"] + 0.06)
    values["postures"] = {"arch": values["postures"]["arch"]}
    (told,) = examine_text(text_of(values), "scene")[1]
    assert told.path == f"joints[{i}].E" and "D and E are" in told.bound and f"at least {needed}" in told.bound, str(told)
    values["joints"][i]["range_deg"] = [float(angle) for angle in told.remedy.rpartition("[")[2].rstrip("].").split(",")]
    assert examine_text(text_of(values), "scene")[1] == []


def test_a_rod_is_as_far_from_the_pins_as_the_skeleton_says() -> None:
    scene, _ = examine_text(example_text("five_section_z_fold"), "scene")
    joint = scene.joints[2]
    assert joint.cylinder.oil is not None
    phi = np.radians([-5.0, 60.0, 178.0])
    passed = {each.pin: each for each in passes_of(scene, 2, joint.cylinder, joint.cylinder.oil, phi)}
    for k, angle in enumerate(phi):
        pins = skeleton(scene, np.array([0.0, 0.0, angle, 0.0, 0.0])).joints[2]
        stations = pins.barrel_pin + np.linspace(0.0, 1.0, 20001)[:, None] * (pins.rod_pin - pins.barrel_pin)
        for name, pin in (("the pivot", pins.pivot), ("D", pins.d), ("E", pins.e), ("Q", pins.q)):
            assert passed[name].distance[k] == pytest.approx(np.hypot(*(stations - pin).T).min(), abs=1e-6)


OIL = {
    "a rod as radius": ("rod", 0.07, "not one as a radius"),
    "a line in litres": ("cap_line", 0.5, "twice what the chamber takes"),
    "a line in ml": ("rod_line", 500.0, "litres?"),
}


@pytest.mark.parametrize("slip", OIL)
def test_slips_in_the_oil_are_warned_of(slip: str) -> None:
    key, value, told = OIL[slip]
    values = YAML(typ="safe", pure=True).load(example_text("five_section_z_fold"))
    values["joints"][1]["cylinder"]["oil"][key] = value
    (found,) = examine_text(text_of(values), "scene")[1]
    assert found.path == f"joints[1].cylinder.oil.{key}" and told in str(found)


def test_incompressible_cylinders_are_not_called_too_stiff(bench: Any) -> None:
    """What is left out of the model is no slip."""

    def edit(values: Any) -> None:
        for joint, section in zip(values["joints"], values["sections"], strict=True):
            del joint["cylinder"]["k"], joint["cylinder"]["d"]
            section["modes"] = 3 if section is values["sections"][3] else 0

    assert [str(oddity) for oddity in bench.oddities(edit)] == []


def test_sound_scenes_have_no_warning() -> None:
    whole = (Path(__file__).parents[2] / "examples" / "two_section_boom.yaml").read_text(encoding="utf-8")
    clearance = with_end_mark(f"{default_text()}\n{clearance_text()}")
    loaded = with_end_mark(f"{default_text()}\nline_fill: 20.0\ntip: {{payload: 40.0}}")
    for text in (default_text(), clearance, whole, loaded, *map(example_text, example_names())):
        assert [str(oddity) for oddity in examine_text(text, "scene")[1]] == []


def test_strict_makes_warnings_errors(bench: Any, capsys: pytest.CaptureFixture[str]) -> None:
    path = str(bench.edited(lambda values: values["joints"][0]["cylinder"].update(k=40e3)))
    assert main(["check", path]) == 0
    assert "Warnings: 1" in capsys.readouterr().out
    picture = Path(path).with_name("pins.png")  # it shows what the warnings are about
    assert main(["check", path, "--strict", "--picture", str(picture)]) == 1 and picture.is_file()
    out, err = capsys.readouterr()
    assert out == "" and "1 fault" in err and "joints[0].cylinder.k = 40000.0" in err
    assert main(["check", "--strict"]) == 0
    assert examine(path)[1]


@pytest.mark.parametrize("size", [1e-300, 1e-30, 1e30])
def test_absurd_values_are_told_of_without_an_accident(bench: Any, size: float) -> None:
    def edit(values: Any) -> None:
        values["material"].update(E=size, rho=size)
        for section in values["sections"]:
            section.update(A=size, I=size, rho_A=size, rho_I=size, beta=size, height=size)
        for joint in values["joints"]:
            joint["cylinder"].update(k=size, d=size)

    assert bench.oddities(edit)
