"""The fault catalogue: what may be wrong with a boom and its sensors, as parameters of linear signatures.

A parameter is 0 where the scene and the mapping are right. Stiffnesses are taken by their compliance, in which residuals are
nearly linear: a parameter of 0.25 of ``cylinder_2.k`` is an oil spring 1.25 times as compliant as the scene's.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from math import inf
from typing import Literal

import numpy as np

from ...scene.edit import parameter, parameter_names
from ...scene.schema import Scene
from ...types import Array


class Form(Enum):
    """How a parameter enters the residuals."""

    SCENE = "scene"  # by another equilibrium of the model
    ANGLE = "angle"  # adds to one angle
    STROKE = "stroke"  # adds to one stroke
    SCALE = "scale"  # multiplies one stroke
    ANGLE_SCALE = "angle scale"  # multiplies one angle
    PLAY = "play"  # lengthens one cylinder the way it is pulled
    DELAY = "delay"  # readings of a stream are those of an earlier time
    IMU = "imu"  # adds to one axis of the IMU
    IMU_SCALE = "imu scale"  # multiplies both axes of the IMU
    IMU_TURN = "imu turn"  # turns the IMU in the plane of the boom


@dataclass(frozen=True, slots=True)
class Parameter:
    """One thing that may be wrong.

    Attributes
    ----------
    cause : str
        The scene's parameter or the sensor, as alarms name it.
    kind : str
        What is then the matter with it, in a word.
    form : Form
    index : int
        Of the cylinder, joint, section, axis or judged stream, from 0; 0 where there is only one.
    unit : str
        Of the parameter; empty for a share.
    healthy : float
        Standard deviation that it may have while all is well and nothing has been learnt.
    faulty : float
        Standard deviation of a fault.
    least : float
        What it cannot be below: a spring is only expected to soften, an empty line cannot lose concrete.
    prior : float
        Weight of such a fault beside others before anything is seen.
    """

    cause: str
    kind: str
    form: Form
    index: int
    unit: str
    healthy: float
    faulty: float
    least: float = -inf
    prior: float = 1.0

    @property
    def name(self) -> str:
        """Cause and kind: no two parameters share it."""
        return f"{self.cause}:{self.kind}"


COMPLIANCE = (0.02, 0.5)
BENDING = (0.02, 0.3)
STEPS = {"kg": 1.0, "kg/m": 0.1, "rad": 2e-4}
"""Small values of the scene's parameters that are not judged by their share."""


def parameters(scene: Scene) -> tuple[Parameter, ...]:
    """Everything that may be wrong with this boom and its sensors, in a fixed order."""
    names, joints = set(parameter_names(scene)), len(scene.joints)
    each = range(joints)
    found = [
        Parameter(f"cylinder_{i + 1}.k", "softer", Form.SCENE, i, "", *COMPLIANCE, least=0.0)
        for i in each
        if f"cylinder_{i + 1}.k" in names
    ]
    found += [
        Parameter(f"section_{i + 1}.EI", "softer", Form.SCENE, i, "", *BENDING, least=0.0)
        for i in each
        if f"section_{i + 1}.EI" in names
    ]
    found += [
        Parameter("tip.payload", "changed", Form.SCENE, 0, "kg", 1.0, 30.0, least=-parameter(scene, "tip.payload")),
        Parameter("line_fill", "changed", Form.SCENE, 0, "kg/m", 0.1, 5.0, least=-parameter(scene, "line_fill")),
    ]
    found.append(Parameter("base.inclination", "changed", Form.SCENE, 0, "rad", 1e-3, 0.03, prior=0.5))
    found += [Parameter(f"joint_{i + 1}.sensor", "bias", Form.ANGLE, i, "rad", 1e-4, 5e-3) for i in each]
    found += [Parameter(f"joint_{i + 1}.sensor", "scale", Form.ANGLE_SCALE, i, "", 1e-4, 0.03, prior=0.5) for i in each]
    found += [Parameter(f"cylinder_{i + 1}.sensor", "bias", Form.STROKE, i, "m", 2e-5, 3e-3, prior=0.5) for i in each]
    found += [Parameter(f"cylinder_{i + 1}.sensor", "scale", Form.SCALE, i, "", 1e-4, 0.03, prior=0.5) for i in each]
    found += [Parameter(f"cylinder_{i + 1}.rod.clearance", "grown", Form.PLAY, i, "m", 0.0, 4e-4, 0.0, 0.1) for i in each]
    found.append(Parameter("joint_angles.delay", "late", Form.DELAY, 0, "s", 5e-4, 0.05, prior=0.5))
    found.append(Parameter("tip_imu.delay", "late", Form.DELAY, 1, "s", 2e-3, 0.05, prior=0.5))
    found += [Parameter("tip_imu.sensor", f"bias {axis}", Form.IMU, i, "m/s^2", 0.01, 0.5) for i, axis in enumerate("xz")]
    found.append(Parameter("tip_imu.sensor", "scale", Form.IMU_SCALE, 0, "", 1e-3, 0.05, prior=0.5))
    found.append(Parameter("tip_imu.sensor", "turned", Form.IMU_TURN, 0, "rad", 1e-3, 0.1, prior=0.5))
    found += [
        Parameter(f"section_{i + 1}.mass", "changed", Form.SCENE, i, "", 0.02, 0.0)
        for i in each
        if f"section_{i + 1}.mass" in names
    ]
    return tuple(found)


def step_of(each: Parameter, scene: Scene) -> tuple[float, dict[str, float]]:
    """A small value of a parameter of the scene, and what the scene then has; see `boom_twin.scene.edit`."""
    value = parameter(scene, each.cause)
    if each.unit == "":
        share = 0.01
        return share, {each.cause: value * (1.0 + share) if each.cause.endswith(".mass") else value / (1.0 + share)}
    step = STEPS[each.unit]
    return step, {each.cause: value + step}


def physical(each: Parameter, scene: Scene, value: float) -> float:
    """What a scene's parameter is (SI) where its parameter here has a value."""
    own = parameter(scene, each.cause)
    if each.unit:
        return own + value
    return own * (1.0 + value) if each.cause.endswith(".mass") else own / (1.0 + value)


Spread = Literal["healthy", "faulty"]


def variances(known: tuple[Parameter, ...], spread: Spread) -> Array:
    """Squares of one of the deviations, shape (parameters,)."""
    return np.array([getattr(each, spread) ** 2 for each in known])
