"""Values with a unit of their own, such as ``8500 mm``, turned into the unit that the glossary states for their key.

Units are pint's, which is imported when the first one is met: a scene in plain SI numbers does without. With decimal arithmetic
``3860 mm`` and ``3.86`` are the same number.
"""

from __future__ import annotations

import re
from decimal import Decimal
from functools import cache
from typing import TYPE_CHECKING, Any

from .yaml_reader import NUMBER

if TYPE_CHECKING:
    from pint import Unit, UnitRegistry

_STATED = re.compile(r"(?:,| in) (m/s\^2|kg/m\^3|kg m\^2|kg/m|kg m|kg|N s/m|N/m|Pa|m\^2|m\^3|m\^4|m|s|rad|degrees)(?![\w^/])")
_TERM = r"[A-Za-zµμ°]+(?:(?:\^|\*\*)?-?[1-9]|[²³⁴])?"
_QUANTITY = re.compile(rf"(?P<number>{NUMBER.pattern})\s*(?P<unit>{_TERM}(?:(?:\s*[*/·]\s*|\s+){_TERM})*)")
_LONGEST = 60  # characters
_POWERS = str.maketrans({"²": "**2", "³": "**3", "⁴": "**4", "·": "*", "^": "**", "μ": "µ"})


def unit_of(meaning: str) -> str | None:
    """Return the unit that the meaning of a key states, for example ``kg m^2``; None for a pure number."""
    found = _STATED.search(meaning)
    return None if found is None else found[1]


def converted(value: Any, unit: str | None) -> Any:
    """Return `value` with every text in it that is a number with a fitting unit as a number in `unit`; all else as it is."""
    if isinstance(value, tuple):
        return tuple(converted(item, unit) for item in value)
    if isinstance(value, dict):
        return {key: converted(item, unit) for key, item in value.items()}
    found = quantity(value, unit) if isinstance(value, str) else None
    return found if isinstance(found, float) else value


def quantity(text: str, unit: str | None) -> float | str | None:
    """Return a number with a unit as a number in `unit`, or why it cannot be one; None for any other text."""
    text = text.strip()
    if len(text) > _LONGEST or NUMBER.fullmatch(text) or not (found := _QUANTITY.fullmatch(text)):  # e-3 could be a unit
        return None
    number, name = found["number"], found["unit"]
    if unit is None:
        return f"a number without a unit is needed, and this one has `{name}`"
    own, wanted = _unit(name), _unit(unit)
    if own is None or wanted is None:
        return f"`{name}` is no unit that is known"
    if own.dimensionality != wanted.dimensionality or _is_angle(own) != _is_angle(wanted):
        return f"`{name}` is no unit of this key, which is in {unit}"
    try:
        return float(_registry().Quantity(Decimal(number), own).to(wanted).magnitude)
    except (ArithmeticError, ValueError):
        return f"`{number}` is no number that can be had in {unit}"


@cache
def _unit(text: str) -> Unit | None:
    from pint.errors import PintError

    plain = re.sub(r"(?<=[A-Za-zµ°])(-?[1-9])", r"**\1", text.translate(_POWERS))
    try:
        return _registry().parse_units(re.sub(r"(?<=[\w°])\s+(?=[A-Za-zµ°])", "*", plain))
    except (PintError, ValueError, TypeError, AttributeError):
        return None


def _is_angle(unit: Unit) -> bool:
    """Return True if a unit is one of angles; pint takes these for pure numbers, as radians are."""
    root = _registry().get_root_units(unit)[1]
    return unit.dimensionless and root == _registry().radian


@cache
def _registry() -> UnitRegistry[Any]:
    from pint import UnitRegistry

    return UnitRegistry(non_int_type=Decimal)
