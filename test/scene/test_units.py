"""Values with units: the same scene as in SI numbers, and what is said of a unit that does not fit."""

from __future__ import annotations

from typing import Any

import pytest
from pydantic import BaseModel
from scene.editing import put

from boom_twin import Scene, load_scene
from boom_twin.scene.block_reader import inner_block, meaning_of, unit_of

OTHER = {
    "m": (1000, "mm"), "m^2": (1e4, "cm^2"), "m^4": (1e8, "cm4"), "kg": (1e-3, "t"), "kg/m": (1e-3, "kg/mm"),
    "Pa": (1e-9, "GPa"),
    "N/m": (1e-6, "kN/mm"), "N s/m": (1e-3, "kN*s/m"), "s": (1e3, "ms"), "kg/m^3": (1e-3, "g/cm³"), "m/s^2": (1e2, "cm/s^2"),
    "m^3": (1e3, "l"), "kg m^2": (1e4, "kg cm²"), "kg m": (1e2, "kg·cm"), "degrees": (1, "deg"),
}  # fmt: skip
"""Of every unit of a scene another one, and how many of it are one of the first."""


def in_other_units(value: Any, unit: str) -> Any:
    if isinstance(value, list):
        return [in_other_units(item, unit) for item in value]
    factor, name = OTHER[unit]
    return f"{float(value) * factor:.12g} {name}"


def rewritten(block: Any, model: type[BaseModel] = Scene) -> Any:
    """A block of a scene with all its values in other units."""
    found = {}
    for key, value in block.items():
        inner, unit = inner_block(model, key), unit_of(meaning_of(model, key))
        if key == "postures":
            found[key] = {name: in_other_units(angles, "degrees") for name, angles in value.items()}
        elif isinstance(value, list) and inner is not None:
            found[key] = [rewritten(item, inner) for item in value]
        elif inner is not None:
            found[key] = rewritten(value, inner)
        else:
            found[key] = value if unit is None else in_other_units(value, unit)
    return found


def test_a_scene_in_other_units_is_the_same_to_the_bit(bench: Any) -> None:
    path = bench.edited(lambda values: values.update(rewritten(values)))
    text = path.read_text(encoding="utf-8")
    assert all(f" {name}" in text for _, name in OTHER.values() if name not in ("kg·cm", "l")) and "mm" in text
    assert load_scene(path) == load_scene()


def test_angles_take_degrees_and_radians(bench: Any) -> None:
    def edit(values: Any) -> None:
        values["base"] |= {"inclination": "3 deg", "stiffness": "5 MN m/rad", "damping": "50 kN·m·s/rad"}
        values["joints"][0]["range_deg"] = ["-5°", "1.4835298641951802 rad"]

    scene = load_scene(bench.edited(edit))
    assert scene.base.inclination == pytest.approx(0.05235987755982989, abs=1e-17)
    assert (scene.base.stiffness, scene.base.damping) == (5.0e6, 5.0e4)
    assert scene.joints[0].range_deg == pytest.approx((-5.0, 85.0), abs=1e-12)


K = "joints[1].cylinder.k"


@pytest.mark.parametrize(
    ("path", "value", "words"),
    [
        ("base.inclination", "3 m/m", ("`m/m` is no unit of this key, which is in rad",)),
        ("base.stiffness", "5 kN m", ("`kN m` is no unit of this key, which is in N m/rad",)),
        ("base.stiffness", "5 kN/mm", ("`kN/mm` is no unit of this key, which is in N m/rad",)),
        ("material.nu", "0.3 mm", ("a number without a unit is needed",)),
        (K, "30 kg/mm", ("`kg/mm` is no unit of this key, which is in N/m", "Give the stiffness of the oil spring, N/m.")),
        (K, "30 kN/mn", ("`kN/mn` is no unit of this key, which is in N/m; known are kN/m, MN/m, N/mm",)),
        (K, "1e999999999999999999999 kN/mm", ("is no number that can be had in N/m",)),
        (K, "30 kN/mm/mm**9", ("is no unit of this key",)),
        (K, "30 __import__('os')", ("a number is needed, not text",)),
        (K, "0,3 kN/mm", ("a number is needed, not text",)),
    ],
)
def test_a_unit_that_does_not_fit_is_refused_by_name(bench: Any, path: str, value: str, words: tuple[str, ...]) -> None:
    (fault,) = bench.faults(lambda values: put(values, path, value))
    assert fault.path == path and fault.line
    assert all(word in str(fault) for word in words), str(fault)
