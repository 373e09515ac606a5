"""Faults of the virtual rig: physical faults in its scene, random wrong parameters, sensor faults.

==============================  =========  ======================================================================
cause                           kind       size
==============================  =========  ======================================================================
``cylinder_i.k``                softer     share of the oil spring that is lost
``section_i.EI``                softer     share of the bending stiffness that is lost
``tip.payload``                 more       kg
``line_fill``                   more       kg/m
``cylinder_i.rod.clearance``    play       radial clearance of the rod pin, m
``joint_i.sensor``              bias       rad (of a ``cylinder_i.sensor``: m)
(``cylinder_i.sensor``)         drift      rad/s (m/s)
..                              scale      share by which it reads too much
..                              stuck      none: it repeats the last reading before the onset
..                              noisy      factor on the noise
..                              spikes     rad (m), up or down, of one reading in fifty
..                              dropout    share of readings without a value
``joint_angles.delay``          late       s by which stamps come after the reading
``joint_angles.dropout``        missing    share of messages that are not there (``cylinder_strokes.dropout`` too)
==============================  =========  ======================================================================

The first five are physical: they are in the scene that is simulated, from the start. The others are of sensors, from their
onset on.

They act on readings that are rounded already, as a fault behind the sensor does.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ...errors import UsageError
from ...scene.edit import parameter, parameter_names, scaled, with_parameters
from ...scene.schema import Clearance, CylinderPart, Joint, Pin, Scene
from ...types import SECOND, Array
from .session import RigSession

_ANY, _MORE, _FACTOR = "finite and not 0", "above 0", "above 1"
_SHARE, _LOSS, _PLAY = "above 0 and at most 1, a share", "above 0 and below 1, a share", "above 0 and below 0.005 m"
_HOLDS = {
    _ANY: lambda size: size != 0.0,
    _SHARE: lambda size: 0.0 < size <= 1.0,
    _LOSS: lambda size: 0.0 < size < 1.0,
    _MORE: lambda size: size > 0.0,
    _PLAY: lambda size: 0.0 < size < 0.005,
    _FACTOR: lambda size: size > 1.0,
}
_SENSOR = {"bias": _ANY, "drift": _ANY, "scale": _ANY, "stuck": None, "noisy": _FACTOR, "spikes": _ANY, "dropout": _SHARE}
_PHYSICAL = ("softer", "more", "play")
_CAUSES: dict[str, dict[str, str | None]] = {
    r"cylinder_([1-9]\d*)\.k": {"softer": _LOSS},
    r"section_([1-9]\d*)\.EI": {"softer": _LOSS},
    r"tip\.payload": {"more": _MORE},
    r"line_fill": {"more": _MORE},
    r"cylinder_([1-9]\d*)\.rod\.clearance": {"play": _PLAY},
    r"(?:joint|cylinder)_([1-9]\d*)\.sensor": _SENSOR,
    r"joint_angles\.delay": {"late": _MORE},
    r"(?:joint_angles|cylinder_strokes)\.dropout": {"missing": _SHARE},
}
CAUSES = (
    "cylinder_i.k, section_i.EI, tip.payload, line_fill, cylinder_i.rod.clearance, joint_i.sensor, cylinder_i.sensor, "
    "joint_angles.delay, joint_angles.dropout, cylinder_strokes.dropout"
)


@dataclass(frozen=True, slots=True)
class RigFault:
    """One fault: its cause, kind and size as in the table above, and its onset (s after the start).

    Raises
    ------
    UsageError
        There is no such cause, it has no such kind, or size or onset are out of bounds.
    """

    cause: str
    kind: str
    size: float = 0.0
    onset: float = 0.0

    def __post_init__(self) -> None:
        kinds = next((kinds for form, kinds in _CAUSES.items() if re.fullmatch(form, self.cause)), None)
        if kinds is None:
            raise UsageError(f"fault {self.cause}: not a cause. Give one of {CAUSES}, with i from 1.")
        if self.kind not in kinds:
            raise UsageError(f"fault {self.cause}:{self.kind}: not a kind of this cause. Give one of {', '.join(kinds)}.")
        bound = kinds[self.kind]
        if bound is None and self.size != 0.0:
            raise UsageError(f"fault {self.cause}:{self.kind}:{self.size:g}: it has no size. Leave that out.")
        if bound is not None and not (math.isfinite(self.size) and _HOLDS[bound](self.size)):
            raise UsageError(f"fault {self.cause}:{self.kind}: size = {self.size:g}, must be {bound}. Give it in SI units.")
        if not 0.0 <= self.onset < math.inf:
            raise UsageError(f"fault {self}: onset = {self.onset:g} s, must be finite and at least 0.")
        if self.is_physical and self.onset:
            raise UsageError(f"fault {self}: changes of the boom hold from the start of a session. Leave out @{self.onset:g}.")

    def __str__(self) -> str:
        size = f":{self.size:g}" if self.size else ""
        return f"{self.cause}:{self.kind}{size}" + (f"@{self.onset:g}" if self.onset else "")

    @property
    def is_physical(self) -> bool:
        """Whether it is of the boom, not of a sensor."""
        return self.kind in _PHYSICAL

    @property
    def number(self) -> int:
        """The i of its cause, from 1; 0 if it has none."""
        found = re.search(r"_(\d+)", self.cause)
        return 0 if found is None else int(found[1])


def parse(text: str) -> RigFault:
    """The fault that is written ``CAUSE:KIND[:SIZE][@ONSET]``.

    Raises
    ------
    UsageError
        The text has not that form, or see `RigFault`.
    """
    words, _, onset = text.partition("@")
    cause, _, rest = words.partition(":")
    kind, _, size = rest.partition(":")
    try:
        return RigFault(cause, kind, float(size or 0.0), float(onset or 0.0))
    except ValueError:
        raise UsageError(f"fault {text}: size and onset must be numbers. Write CAUSE:KIND[:SIZE][@ONSET].") from None


def check(faults: Sequence[RigFault], scene: Scene, duration: float) -> None:
    """UsageError if a fault is of a part that `scene` does not have, or begins after `duration` (s)."""
    parts = len(scene.joints)
    for fault in faults:
        if fault.number > parts:
            raise UsageError(f"fault {fault}: the boom has joints, cylinders and sections 1 to {parts}. Give one of them.")
        if fault.onset >= duration:
            raise UsageError(f"fault {fault}: begins at {fault.onset:g} s, must be before the end at {duration:g} s.")


JOURNAL = 0.025  # m, radius of a pin that the scene does not list


def with_faults(scene: Scene, faults: Sequence[RigFault]) -> Scene:
    """`scene` with the physical ones of `faults`; those of sensors are passed over.

    A pin that the scene does not list gets a journal of 25 mm radius.

    Raises
    ------
    UsageError
        The scene has no such parameter, for instance no oil spring.
    """
    for fault in faults:
        if fault.kind == "play":
            scene = _worn(scene, fault.cause.removesuffix(".clearance"), fault.size)
        elif fault.is_physical:
            now = parameter(scene, fault.cause)
            changed = now + fault.size if fault.kind == "more" else now * (1.0 - fault.size)
            scene = with_parameters(scene, {fault.cause: changed})
    return scene


def _worn(scene: Scene, at: str, more: float) -> Scene:
    """The pin `at` with `more` radial clearance (m) than it has."""
    clearance = scene.clearance or Clearance()
    pins = {pin.at: pin for pin in clearance.pins}
    pin = pins.get(at) or Pin(at=at, pin_radius=JOURNAL, radial_clearance=0.0)
    pins[at] = pin.model_copy(update={"radial_clearance": pin.radial_clearance + more})
    return scene.model_copy(update={"clearance": clearance.model_copy(update={"pins": tuple(pins.values())})})


MOST = 0.3  # share; twice as much is drawn at most, and every parameter stays positive
KEYS = ("k", "d", "EI", "mass")


def wrong_by(scene: Scene, share: float, seed: int) -> Scene:
    """Every k, d, EI and section mass, mass of link, barrel and rod multiplied by 1 + `share` z of its own.

    z is standard normal, drawn again beyond 2; masses take their inertia with them. Payload, line fill, geometry and material
    damping stay, for they are known, or nothing is predicted from them that a sensor could tell.

    Raises
    ------
    UsageError
        `share` is not from 0 to 0.3.
    """
    if not 0.0 <= share <= MOST:
        raise UsageError(f"wrong by {share:g}: must be from 0 to {MOST:g}, as a share of every parameter. 0.02 is 2 %.")
    rng = np.random.default_rng([seed, 2])
    names = [name for name in parameter_names(scene) if name.split(".")[-1] in KEYS]
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


SPIKE_SHARE = 0.02  # of the readings


def spoil(session: RigSession, faults: Sequence[RigFault], seed: int) -> RigSession:
    """The session with the sensor faults among `faults`; readings before an onset stay, bit for bit, and so does the truth.

    Parameters
    ----------
    seed : int
        Of spikes and dropouts; each fault draws from a stream of its own.
    """
    sensed = [fault for fault in faults if not fault.is_physical]
    for fault, rng in zip(sensed, np.random.default_rng([seed, 1]).spawn(len(sensed)), strict=True):
        session = _with_one(session, fault, rng)
    return session


def _with_one(session: RigSession, fault: RigFault, rng: np.random.Generator) -> RigSession:
    after = session.truth["t"] >= fault.onset
    if fault.kind == "late":
        late = np.where(after, round(fault.size * SECOND), 0)
        return replace(session, angle_stamps=session.angle_stamps + late)
    name = "joints" if fault.cause.startswith("joint") else "strokes"
    values: Array = getattr(session, name).copy()
    if fault.kind == "missing":
        values[after & (rng.random(len(after)) < fault.size)] = np.nan
    else:
        column = fault.number - 1
        true = session.truth[name][:, column]
        values[after, column] = _spoiled(fault, session.truth["t"], values[:, column], true, after, rng)[after]
    return replace(session, joints=values) if name == "joints" else replace(session, strokes=values)


def _spoiled(
    fault: RigFault, times: Array, read: Array, true: Array, after: NDArray[np.bool_], rng: np.random.Generator
) -> Array:
    """Readings (m,) of the one sensor as if the fault had always been there; those before the onset are not used."""
    match fault.kind:
        case "bias":
            return read + fault.size
        case "drift":
            return read + fault.size * (times - fault.onset)
        case "scale":
            return read * (1.0 + fault.size)
        case "stuck":
            last = max(0, int(np.argmax(after)) - 1)
            return np.full_like(read, read[last])
        case "noisy":
            return true + fault.size * (read - true)
        case "spikes":
            hit = rng.random(len(read)) < SPIKE_SHARE
            return np.asarray(read + fault.size * hit * rng.choice([-1.0, 1.0], len(read)))
        case _:  # dropout
            return np.where(rng.random(len(read)) < fault.size, np.nan, read)
