"""Faults of the virtual rig: their notation, the booms that have them, and the readings of faulty sensors.

`listing` names every cause with its kinds and sizes, in SI units. Faults of stiffness and load are physical:
`changes` puts them into the simulated boom. A fault of a drive changes the motion that the boom follows; a leaked stroke stays.
Faults of sensors change rounded readings. A fault begins at its onset, grows linearly to its size over its ramp, and falls
from its end on over the same time.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from ...errors import UsageError
from ...scene.edit import parameter, parameter_names, scaled, with_parameters
from ...scene.schema import CylinderPart, Joint, Scene
from ...types import SECOND, Array
from .session import RigSession
from .solve import Change, Drive

_ANY, _MORE, _FACTOR = "finite and not 0", "above 0", "above 1"
_SHARE, _LOSS = "above 0 and at most 1, a share", "above 0 and below 1, a share"
_HOLDS = {
    _ANY: lambda size: size != 0.0,
    _SHARE: lambda size: 0.0 < size <= 1.0,
    _LOSS: lambda size: 0.0 < size < 1.0,
    _MORE: lambda size: size > 0.0,
    _FACTOR: lambda size: size > 1.0,
}
_SENSOR = {"bias": _ANY, "drift": _ANY, "scale": _ANY, "stuck": None, "noisy": _FACTOR, "spikes": _ANY, "dropout": _SHARE}
_PHYSICAL = ("softer", "more", "less")
_WITHOUT_RAMP = ("drift", "stuck")
_CAUSES: dict[str, dict[str, str | None]] = {
    r"cylinder_([1-9]\d*)\.k": {"softer": _LOSS},
    r"section_([1-9]\d*)\.EI": {"softer": _LOSS},
    r"base\.stiffness": {"softer": _LOSS},
    r"tip\.payload": {"more": _MORE, "less": _MORE},
    r"line_fill": {"more": _MORE, "less": _MORE},
    r"cylinder_([1-9]\d*)\.drive": {"drift": _ANY},
    r"(?:joint|cylinder|cylinder_force)_([1-9]\d*)\.sensor": _SENSOR,
    r"joint_angles\.delay": {"late": _MORE},
    r"(?:joint_angles|cylinder_strokes)\.dropout": {"missing": _SHARE},
}
_SIZES = {
    "softer": "share of the stiffness that is lost",
    "more tip.payload": "kg, at most the boom's mass",
    "more line_fill": "kg/m, at most the boom's mass over its reach",
    "less tip.payload": "kg, at most what the scene has",
    "less line_fill": "kg/m, at most what the scene has",
    "bias": "rad, m or N; at most 1 rad, the travel, 1e6 N",
    "drift": "rad, m or N in a second",
    "scale": "share by which it reads too much, at most 1",
    "stuck": "none: it repeats the last reading before the onset",
    "noisy": "factor on the noise, at most 1000",
    "spikes": "as a bias, of one reading in fifty",
    "dropout": "share of the readings",
    "late": "s by which stamps come after the reading, at most 10",
    "missing": "share of the messages",
}
"""What a size is, by kind, and by cause where that differs."""


def _words(form: str, number: str) -> str:
    """Return the cause of a form of `_CAUSES` as it is told to people, with `number` for the cylinder, joint or section."""
    return form.replace(r"([1-9]\d*)", number).replace("\\", "").replace("(?:", "(")


@dataclass(frozen=True, slots=True)
class RigFault:
    """One fault. UsageError if there is no such cause or kind, or size or times are out of bounds; see `listing`."""

    cause: str
    kind: str
    size: float = 0.0
    onset: float = 0.0  # s after the start
    ramp: float = 0.0  # s, from nothing to the full size
    end: float = math.inf  # s after the start

    def __post_init__(self) -> None:
        kinds = next((kinds for form, kinds in _CAUSES.items() if re.fullmatch(form, self.cause)), None)
        if kinds is None:
            causes = ", ".join(_words(form, "i") for form in _CAUSES)
            raise UsageError(f"fault {self.cause}: not a cause. Give one of {causes}, with i from 1 and (a|b) for a or b.")
        if self.kind not in kinds:
            raise UsageError(f"fault {self.cause}:{self.kind}: not a kind of this cause. Give one of {', '.join(kinds)}.")
        bound = kinds[self.kind]
        if bound is None and self.size != 0.0:
            raise UsageError(f"fault {self.cause}:{self.kind}:{self.size:g}: it has no size. Leave that out.")
        if bound is not None and not (math.isfinite(self.size) and _HOLDS[bound](self.size)):
            raise UsageError(f"fault {self.cause}:{self.kind}: size = {self.size:g}, must be {bound}. Give it in SI units.")
        for name, value in (("onset", self.onset), ("ramp", self.ramp)):
            if not 0.0 <= value < math.inf:
                raise UsageError(f"fault {self}: {name} = {value:g} s, must be finite and at least 0.")
        if not self.onset + self.ramp < self.end:
            whole = self.onset + self.ramp
            raise UsageError(f"fault {self}: end = {self.end:g} s, must be after {whole:g} s, when it is there in full.")
        if self.ramp and self.kind in _WITHOUT_RAMP:
            raise UsageError(f"fault {self}: {self.kind} does not come on over a time. Leave out +{self.ramp:g}.")

    def __str__(self) -> str:
        size = f":{self.size:g}" if self.size else ""
        ramp, end = f"+{self.ramp:g}" if self.ramp else "", f"..{self.end:g}" if self.end < math.inf else ""
        return f"{self.cause}:{self.kind}{size}" + (f"@{self.onset:g}{ramp}{end}" if self.onset or ramp or end else "")

    def share(self, times: Array) -> Array:
        """Return the share of the fault at `times` (m,) in s: 0 before the onset, 1 in full."""
        return self._begun(times, self.onset) - self._begun(times, self.end)

    def _begun(self, times: Array, at: float) -> Array:
        if self.ramp == 0.0:
            return np.where(times >= at, 1.0, 0.0)
        return np.clip((times - at) / self.ramp, 0.0, 1.0)

    @property
    def is_there_at_first(self) -> bool:
        return self.onset == self.ramp == 0.0

    @property
    def is_physical(self) -> bool:
        """Return True if the fault is one of the boom, not of a sensor."""
        return self.kind in _PHYSICAL

    @property
    def is_of_drive(self) -> bool:
        return self.cause.endswith(".drive")

    @property
    def is_constant(self) -> bool:
        return self.is_there_at_first and self.end == math.inf

    @property
    def number(self) -> int:
        found = re.search(r"_(\d+)", self.cause)
        return 0 if found is None else int(found[1])


FORM = "CAUSE:KIND[:SIZE][@ONSET[+RAMP][..END]]"


def parse(text: str) -> RigFault:
    """Parse a fault that is written as `FORM` says; UsageError for another form, or see `RigFault`."""
    words, _, when = text.partition("@")
    cause, _, rest = words.partition(":")
    kind, _, size = rest.partition(":")
    begin, _, end = when.partition("..")
    onset, _, ramp = begin.partition("+")
    try:
        return RigFault(cause, kind, float(size or 0.0), float(onset or 0.0), float(ramp or 0.0), float(end or math.inf))
    except ValueError:
        raise UsageError(f"fault {text}: size, onset, ramp and end must be numbers. Write {FORM}.") from None


def check(faults: Sequence[RigFault], scene: Scene, duration: float) -> None:
    """Raise UsageError if a fault is of a part that `scene` lacks, or begins after `duration` (s), or two change one thing."""
    parts = len(scene.joints)
    changing = [fault.cause for fault in faults if fault.is_physical and not fault.is_constant]
    for fault in faults:
        if fault.is_physical and not fault.is_constant and changing.count(fault.cause) > 1:
            raise UsageError(f"fault {fault}: {fault.cause} changes by another fault too. Give one of them.")
        if fault.number > parts:
            raise UsageError(f"fault {fault}: the boom has joints, cylinders and sections 1 to {parts}. Give one of them.")
        if fault.onset >= duration:
            raise UsageError(f"fault {fault}: begins at {fault.onset:g} s, must be before the end at {duration:g} s.")
        most = largest_size(fault, scene, duration)
        if abs(fault.size) > most:
            most_here = f"must be at most {most:.4g} on this boom"
            raise UsageError(f"fault {fault}: size = {fault.size:g}, {most_here}. Give it in SI units.")


def largest_size(fault: RigFault, scene: Scene, duration: float) -> float:
    """Return how large a fault may be on a boom within `duration` (s), in its unit.

    Loads are at most as heavy as the boom, readings within what a sensor can tell, leaks within the cylinder's travel.
    """
    if fault.is_of_drive:
        return scene.joints[fault.number - 1].cylinder.max_stroke / (min(fault.end, duration) - fault.onset)
    if fault.kind == "more":
        mass = sum(section.mass for section in scene.sections)
        return mass if fault.cause == "tip.payload" else mass / scene.reach
    if fault.kind == "less":
        return parameter(scene, fault.cause)
    if fault.kind in ("bias", "spikes", "drift"):
        if fault.cause.startswith("joint_"):
            return 1.0  # rad
        return 1e6 if "force" in fault.cause else scene.joints[fault.number - 1].cylinder.max_stroke
    return {"late": 10.0, "noisy": 1000.0, "scale": 1.0}.get(fault.kind, math.inf)


def listing() -> list[str]:
    """Return all causes and kinds with the meaning of their sizes, a line each."""
    lines = [f"{'cause':41} {'kind':9} size"]
    for form, kinds in _CAUSES.items():
        cause = _words(form, "I")
        for kind, bound in kinds.items():
            unit = _SIZES.get(kind) or _SIZES[f"{kind} {cause}"]
            lines.append(f"{cause:41} {kind:9} {unit}{f'; {bound}' if bound else ''}")
    return [*lines, "", f"I is 1, 2, ..; (a|b) is a or b. Write --fault {FORM}, times in s."]


def changes(scene: Scene, faults: Sequence[RigFault]) -> tuple[Scene, list[Change]]:
    """Return `scene` with the physical `faults` that are there at first, and its changes by those that come or go."""
    first = [fault for fault in faults if fault.is_there_at_first]
    start, found = with_faults(scene, first), list[Change]()
    for fault in faults:
        if not fault.is_physical or fault.is_constant:
            continue
        if fault.is_there_at_first:
            found.append((with_faults(scene, [other for other in first if other is not fault]), partial(_gone, fault)))
        else:
            found.append((with_faults(scene, [*first, fault]), fault.share))
    return start, found


def _gone(fault: RigFault, times: Array) -> Array:
    return np.asarray(1.0 - fault.share(times))


def with_faults(scene: Scene, faults: Sequence[RigFault]) -> Scene:
    """Return `scene` with the physical ones of `faults` in full; UsageError if it lacks the parameter of one."""
    for fault in faults:
        if fault.is_physical:
            now = parameter(scene, fault.cause)
            changed = {"more": now + fault.size, "less": now - fault.size, "softer": now * (1.0 - fault.size)}
            scene = with_parameters(scene, {fault.cause: changed[fault.kind]})
    return scene


def wrong_by(scene: Scene, share: float, seed: int) -> Scene:
    """Return `scene` with every k, d, EI and mass of section, link, barrel and rod multiplied by 1 + `share` z of its own.

    z is standard normal, drawn again beyond 2; masses take their inertia with them. Payload, line fill, geometry and material
    damping stay, for they are known, or nothing is predicted from them that a sensor could tell.
    """
    if not 0.0 <= share <= 0.3:  # twice as much is drawn at most, and every parameter stays positive
        raise UsageError(f"wrong by {share:g}: must be from 0 to 0.3, as a share of every parameter. 0.02 is 2 %.")
    rng = np.random.default_rng([seed, 2])
    names = [name for name in parameter_names(scene) if name.split(".")[-1] in ("k", "d", "EI", "mass")]
    scene = with_parameters(scene, {name: parameter(scene, name) * _factor(share, rng) for name in names})
    return scene.model_copy(update={"joints": tuple(_joint(joint, share, rng) for joint in scene.joints)})


def _factor(share: float, rng: np.random.Generator) -> float:
    while abs(z := rng.standard_normal()) > 2.0:
        pass
    return 1.0 + share * float(z)


def _joint(joint: Joint, share: float, rng: np.random.Generator) -> Joint:
    links = {key: getattr(joint, key) for key in ("mL", "mR")}
    parts: dict[str, CylinderPart | None] = {key: getattr(joint.cylinder, key) for key in ("barrel", "rod")}
    cylinder = {key: scaled(part, _factor(share, rng)) for key, part in parts.items() if part is not None}
    changes = {key: mass * _factor(share, rng) for key, mass in links.items() if mass is not None}
    return joint.model_copy(update={**changes, "cylinder": joint.cylinder.model_copy(update=cylinder)})


def drifting(programme: Drive, faults: Sequence[RigFault]) -> Drive:
    """Return `programme` with the drift of every drive that has a fault among `faults`; it stays when the fault ends."""

    def drive(times: Array) -> tuple[Array, Array]:
        strokes, rates = programme(times)
        for fault in (fault for fault in faults if fault.is_of_drive):
            strokes[:, fault.number - 1] += fault.size * (np.clip(times, fault.onset, fault.end) - fault.onset)
            rates[:, fault.number - 1] += fault.size * fault.share(times)
        return strokes, rates

    return drive


SPIKE_SHARE = 0.02  # of the readings


def spoil(session: RigSession, faults: Sequence[RigFault], seed: int) -> RigSession:
    """Return the session with the sensor faults among `faults`. Readings without a fault and the truth stay, bit for bit.

    Spikes and dropouts are drawn by `seed`; each fault draws from a stream of its own.
    """
    sensed = [fault for fault in faults if not fault.is_physical and not fault.is_of_drive]
    for fault, rng in zip(sensed, np.random.default_rng([seed, 1]).spawn(len(sensed)), strict=True):
        session = _with_one(session, fault, rng)
    return session


def _with_one(session: RigSession, fault: RigFault, rng: np.random.Generator) -> RigSession:
    share = fault.share(session.truth["t"])
    if fault.kind == "late":
        late = np.rint(share * round(fault.size * SECOND)).astype(np.int64)
        return replace(session, angle_stamps=session.angle_stamps + late)
    name = "forces" if "force" in fault.cause else "joints" if fault.cause.startswith("joint") else "strokes"
    values: Array = getattr(session, name).copy()
    if fault.kind == "missing":
        values[rng.random(len(share)) < share * fault.size] = np.nan
    else:
        column, there = fault.number - 1, share > 0.0
        true = session.truth[name][:, column]
        values[there, column] = _spoiled(fault, session.truth["t"], values[:, column], true, share, rng)[there]
    changed: dict[str, Any] = {name: values}
    return replace(session, **changed)


def _spoiled(fault: RigFault, times: Array, read: Array, true: Array, share: Array, rng: np.random.Generator) -> Array:
    """Return the readings (m,) of one sensor with `share` (m,) of the fault; those with nothing of it are not used."""
    size = share * fault.size
    match fault.kind:
        case "bias":
            return read + size
        case "drift":
            return read + size * (times - fault.onset)
        case "scale":
            return read * (1.0 + size)
        case "stuck":
            last = max(0, int(np.argmax(share > 0.0)) - 1)
            return np.full_like(read, read[last])
        case "noisy":
            return true + (1.0 + share * (fault.size - 1.0)) * (read - true)
        case "spikes":
            hit = rng.random(len(read)) < SPIKE_SHARE
            return np.asarray(read + size * hit * rng.choice([-1.0, 1.0], len(read)))
        case _:  # dropout
            return np.where(rng.random(len(read)) < size, np.nan, read)
