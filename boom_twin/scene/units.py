"""Values that look as if they were given in another unit. They only warn."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

from pydantic import BaseModel

from .draft import Draft
from .finding import Finding, odd
from .read import Place

LENGTHS = ("length", "beam", "rod_pin", "com", "pivot", "cylinder_pin", "C", "D", "E", "R", "lL", "lR",
           "closed_length", "max_stroke")  # fmt: skip
MASSES = ("mass", "mL", "mR", "payload")

# key: (looks wrong when, what it looks like, what to do)
SUSPECTS: dict[str, tuple[float, str, str]] = {
    "A": (1.0, "more than 1 m^2: cm^2 or mm^2?", "Give the area in m^2: 49 cm^2 is 4.9e-3."),
    "I": (0.1, "more than 0.1 m^4: cm^4 or mm^4?", "Give the second moment in m^4: 3600 cm^4 is 3.6e-5."),
    "rho_A": (5000.0, "more than 5000 kg/m: a density in kg/m^3?", "Give the mass of one metre of the section."),
    "line_fill": (500.0, "more than 500 kg/m: the whole load in kg?", "Give the concrete in one metre of pipe."),
    "inclination": (1.0, "more than 1 rad: degrees?", "Give radians: 5 degrees are 0.0873."),
    "closed_length": (50.0, "more than 50 m: mm?", "Give lengths in m."),
    "max_stroke": (50.0, "more than 50 m: mm?", "Give lengths in m."),
}


def suspects(draft: Draft) -> Iterator[Finding]:
    """All values of all usable parts."""
    blocks: list[tuple[Place, Any]] = [(("material",), draft.material), (("base",), draft.base), (("tip",), draft.tip)]
    blocks += [(("sections", i), section) for i, section in enumerate(draft.sections)]
    blocks += [(("joints", i), joint) for i, joint in enumerate(draft.joints)]
    for place, block in blocks:
        if block is not None:
            yield from _block(draft, place, block)
    if draft.line_fill is not None:
        yield from _upper(draft, ("line_fill",), draft.line_fill)
    yield from _gravity(draft)
    yield from _postures(draft)


def _block(draft: Draft, place: Place, block: BaseModel) -> Iterator[Finding]:
    for key in type(block).model_fields:
        value, here = getattr(block, key), (*place, key)
        if isinstance(value, BaseModel):
            yield from _block(draft, here, value)
        elif value is not None:
            yield from _value(draft, here, value)


def _value(draft: Draft, place: Place, value: Any) -> Iterator[Finding]:
    key = place[-1]
    if key == "E" and place[0] == "material":
        if value < 1e6:
            factor = ("GPa", 1e9) if value < 1e3 else ("MPa", 1e6)
            remedy = f"Give Pa: {value:g} {factor[0]} are {value * factor[1]:g}."
            yield odd(draft, place, value, "less than 1e6 Pa: GPa or MPa?", remedy)
    elif key == "rho" and value < 50:
        yield odd(draft, place, value, "less than 50 kg/m^3: g/cm^3 or t/m^3?", f"Give kg/m^3: {value * 1000:g}.")
    elif key == "k" and value < 1e4:
        yield odd(draft, place, value, "less than 1e4 N/m: kN/mm?", f"Give N/m: {value:g} kN/mm are {value * 1e6:g}.")
    elif key == "range_deg" and max(map(abs, value)) < 6.3:
        shown = ", ".join(f"{math.degrees(angle):.4g}" for angle in value)
        yield odd(draft, place, value, "all within 6.3: radians?", f"Give degrees; these radians would be [{shown}].")
    elif key in MASSES and value > 1e5:
        yield odd(draft, place, value, "more than 1e5 kg: grams?", f"Give kg: {value:g} g are {value / 1000:g}.")
    elif key in LENGTHS and max(map(abs, value if isinstance(value, tuple) else (value,))) > 200:
        yield odd(draft, place, value, "more than 200 m: mm?", "Give lengths in m.")
    else:
        yield from _upper(draft, place, value)


def _upper(draft: Draft, place: Place, value: Any) -> Iterator[Finding]:
    limit, looks, remedy = SUSPECTS.get(str(place[-1]), (math.inf, "", ""))
    if isinstance(value, int | float) and abs(value) > limit:
        yield odd(draft, place, value, looks, remedy)


def _gravity(draft: Draft) -> Iterator[Finding]:
    if draft.gravity is not None:
        if not 9.7 < math.hypot(*draft.gravity) < 9.9:
            bound = "its size is not that of the earth's gravity, about 9.81 m/s^2"
            yield odd(draft, ("gravity",), draft.gravity, bound, "Usual is [0.0, -9.81].")
        elif draft.gravity[1] > 0:
            yield odd(draft, ("gravity",), draft.gravity, "it points upwards", "Usual is [0.0, -9.81].")


def _postures(draft: Draft) -> Iterator[Finding]:
    for name, angles in draft.postures.items():
        if angles and max(map(abs, angles)) < 6.3 and any(angle != round(angle) for angle in angles):
            yield odd(draft, ("postures", name), angles, "all within 6.3: radians?", "Give degrees to the horizontal.")
