"""Changes of stiffnesses and masses of an Exudyn boom while it moves.

The changed boom is built in full. At each step the moving boom has its own parameters plus a share of the differences. So any
parameter except geometry can change, without a second formula.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ....errors import UsageError
from ....types import Array
from .system import Boom

_BODY = "RigidBody2D"


class ParameterChanges:
    """Parameter differences between a boom and fully `changed` ones, with their share (count + 1,) at the start and every step.

    UsageError if a changed boom has other parts, or the boom is lumped (its masses are loads).
    """

    def __init__(self, boom: Boom, changed: Sequence[tuple[Boom, Array]]) -> None:
        if changed and boom.lumps:
            raise UsageError("A lumped boom cannot change while it moves. Build it with lumped=False.")
        self._system, self._shares = boom.system, [share for _, share in changed]
        now = _objects(boom)
        self._healthy: dict[int, dict[str, float]] = {}
        self._more: dict[int, list[dict[str, float]]] = {}
        for at, (other, _) in enumerate(changed):
            others = _objects(other)
            if [each.keys() for each in others] != [each.keys() for each in now]:
                raise UsageError("The changed boom has other parts than the one that moves. Change its stiffnesses or masses.")
            for number, (old, new) in enumerate(zip(now, others, strict=True)):
                if more := {name: new[name] - old[name] for name in old if new[name] != old[name]}:
                    self._healthy[number] = old
                    self._more.setdefault(number, [{} for _ in changed])[at] = more
        self._last: list[float] = [0.0] * len(changed)

    def of(self, number: int, name: str) -> Array:
        """Return the change of parameter `name` of an object from the unchanged boom, shape (count + 1,) or ()."""
        found = np.zeros(())
        for share, more in zip(self._shares, self._more.get(number, []), strict=False):
            found = found + share * more.get(name, 0.0)
        return found

    def hand_over(self, row: int) -> None:
        """Set the parameters of all changed objects for step `row`."""
        shares = [float(share[row]) for share in self._shares]
        if shares == self._last:
            return
        self._last = shares
        for number, old in self._healthy.items():
            values = dict(old)
            for share, more in zip(shares, self._more[number], strict=True):
                for name, value in more.items():
                    values[name] += share * value
            _set(self._system, number, values, {name for more in self._more[number] for name in more})

    def restore(self) -> None:
        """Restore the unchanged boom's parameters."""
        for number, old in self._healthy.items():
            _set(self._system, number, old, {name for more in self._more[number] for name in more})


def _objects(boom: Boom) -> list[dict[str, float]]:
    """Return the parameters of all objects in additive form: first moments instead of the centre of mass."""
    return [_additive(boom.system.GetObject(number)) for number in range(boom.system.systemData.NumberOfObjects())]


def _additive(record: dict[str, Any]) -> dict[str, float]:
    if record["objectType"] == _BODY:
        mass, (x, y) = record["mass"], record["centerOfMass"]
        return {"mass": mass, "inertia": record["inertia"], "moment_x": mass * x, "moment_y": mass * y}
    return {name: value for name, value in record.items() if isinstance(value, float) and not name.startswith("V")}


def _set(system: Any, number: int, values: dict[str, float], names: set[str]) -> None:
    if "moment_x" in values:
        mass = values["mass"]
        centre = [values["moment_x"] / mass, values["moment_y"] / mass] if mass else [0.0, 0.0]
        system.SetObjectParameter(number, "mass", mass)
        system.SetObjectParameter(number, "inertia", values["inertia"])
        system.SetObjectParameter(number, "centerOfMass", centre)
        return
    for name in names:
        system.SetObjectParameter(number, name, values[name])
