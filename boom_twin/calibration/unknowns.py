"""Unknowns that a calibration may estimate: names, units, priors."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from ..deviation.kalman import ANGLE_ZERO
from ..errors import UsageError
from ..scene.edit import parameter, parameter_names
from ..scene.schema import Scene
from ..types import Stream, channels_of, stream_of


@dataclass(frozen=True, slots=True)
class UnknownKind:
    """Kind of a parameter."""

    unit: str
    prior: float  # deviation that is expected of the present value
    useful: float  # deviation from which an estimate is of use
    relative: bool = False  # these two are shares of the value, which stays positive; else they have its unit
    least: float = 0.0  # smallest standard deviation of an estimate: the error of the model's statics looks like a zero


KINDS = {
    "k": UnknownKind("N/m", 0.3, 0.1, relative=True),
    "d": UnknownKind("N s/m", 1.0, 0.2, relative=True),
    "EI": UnknownKind("N m^2", 0.3, 0.1, relative=True),
    "beta": UnknownKind("s", 1.0, 0.2, relative=True),
    "mass": UnknownKind("kg", 0.1, 0.05, relative=True),
    "stiffness": UnknownKind("N m/rad", 0.5, 0.1, relative=True),
    "damping": UnknownKind("N m s/rad", 1.0, 0.2, relative=True),
    "tip.payload": UnknownKind("kg", 50.0, 5.0),
    "line_fill": UnknownKind("kg/m", 10.0, 1.0),
}
"""Kinds of parameters, by the last word of a parameter's name."""

ZEROS = {
    Stream.ANGLES: UnknownKind("rad", math.radians(2.0), math.radians(0.05), least=ANGLE_ZERO),
    Stream.STROKES: UnknownKind("m", 0.01, 5e-4, least=0.3 * ANGLE_ZERO),  # m, a lever
    Stream.IMU: UnknownKind("m/s^2", 0.3, 0.03),
}
"""Kinds of the sensors' zeros, by stream, in the order in which they are estimated."""


ASSUMED = {
    "EI": UnknownKind("N m^2", 0.02, 0.0, relative=True),
    "mass": UnknownKind("kg", 0.02, 0.0, relative=True),
    "d": UnknownKind("N s/m", 0.2, 0.0, relative=True),
    "beta": UnknownKind("s", 0.2, 0.0, relative=True),
    "damping": UnknownKind("N m s/rad", 0.2, 0.0, relative=True),
}
"""Standard deviations of parameters that are not estimated, by the last word of their names: tolerances, and damping."""


@dataclass(frozen=True, slots=True)
class Unknown:
    """Parameter with its present value (SI): to be estimated, or taken from the scene (`assumed`), see `ASSUMED`."""

    name: str
    present: float
    assumed: bool = False

    @property
    def channel(self) -> str | None:
        """Channel whose zero it is; None for a parameter of the scene."""
        channel = self.name.removesuffix(".zero")
        return None if channel == self.name else channel

    @property
    def kind(self) -> UnknownKind:
        """Unit and likely deviations of the parameter's kind."""
        if self.channel is not None and (stream := stream_of(self.channel)) is not None:
            return ZEROS[stream]
        return (ASSUMED if self.assumed else KINDS)[self.name if self.name in KINDS else self.name.rpartition(".")[2]]

    @property
    def least(self) -> float:
        """Lower bound in deviations from the present value; loads are 0.001 at least, for none is another model."""
        return (1e-3 - self.present) / self.kind.prior if self.name in ("tip.payload", "line_fill") else -math.inf

    def value(self, deviation: float) -> float:
        """Return the value at `deviation` prior deviations from the present one."""
        step = deviation * self.kind.prior
        return self.present * math.exp(step) if self.kind.relative else self.present + step


@dataclass(frozen=True)
class Choice:
    """Choice of unknowns: `names`; without names the default ones and those requested by the other fields."""

    names: tuple[str, ...] = ()
    load: str | None = None  # payload or line_fill
    damping: str | None = None  # d (cylinders) or beta (sections)
    stiffness: bool = False  # of sections in bending, and of an elastic base
    zeros: str = "all"  # all, angles (stroke transducers are then taken to be right) or none


def usual_names(scene: Scene, streams: Sequence[Stream], choice: Choice) -> list[str]:
    """Return the default unknowns: stiffness of every cylinder, zero of every sensor of `streams`, and those of `choice`."""
    ends = [".k", *([f".{choice.damping}"] if choice.damping else []), *([".EI", ".stiffness"] if choice.stiffness else [])]
    names = [name for end in ends for name in parameter_names(scene) if name.endswith(end)]
    names += {None: [], "payload": ["tip.payload"], "line_fill": ["line_fill"]}[choice.load]
    trusted = {"all": (), "angles": (Stream.STROKES,), "none": tuple(Stream)}[choice.zeros]
    return names + zero_names(scene, [stream for stream in streams if stream not in trusted])


def zero_names(scene: Scene, streams: Sequence[Stream] = tuple(Stream)) -> list[str]:
    """Return the names of the sensors' zeros of some of the streams of `ZEROS`."""
    channels = channels_of(len(scene.joints))
    return [f"{channel}.zero" for stream in ZEROS if stream in streams for channel in channels[stream]]


def unknowns_of(scene: Scene, names: Sequence[str]) -> tuple[Unknown, ...]:
    """Return the unknowns of these names; zeros are 0 at present, since the mapping has applied the known ones.

    UsageError if the scene has no such parameter, if a name stands there twice, or for none at all.
    """
    known = [*parameter_names(scene), *zero_names(scene)]
    if not names:
        raise UsageError(f"parameters: none to be estimated. The scene has {', '.join(known)}.")
    for name in names:
        if name not in known:
            raise UsageError(f"{name}: the scene has no such parameter. It has {', '.join(known)}.")
        if names.count(name) > 1:
            raise UsageError(f"{name}: named {names.count(name)} times. Name it once.")
    zeros = set(zero_names(scene))
    return tuple(Unknown(name, 0.0 if name in zeros else parameter(scene, name)) for name in names)


def assumed_of(scene: Scene, names: Sequence[str]) -> tuple[Unknown, ...]:
    """Return the parameters of the scene that are not estimated but have errors, without those of `names`."""
    others = [name for name in parameter_names(scene) if name.rpartition(".")[2] in ASSUMED and name not in names]
    return tuple(Unknown(name, at, True) for name in others if (at := parameter(scene, name)) > 0.0)
