"""Exudyn's own stepping of an assembled boom, whose stiffnesses and masses may change while it moves.

A changed boom is built in full. At each step the moving boom has its own parameters plus a share of the differences. So any
parameter except geometry can change, without a second formula.
"""

from __future__ import annotations

import contextlib
import io
import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...errors import SolverError, UsageError
from ...scene.schema import Cylinder
from ...types import Array
from . import exudyn
from .system import Boom, oil_stiffness


@dataclass(frozen=True, slots=True)
class Scheme:
    """Generalised-alpha with Newton's method."""

    rho: float = 0.8  # spectral radius at infinite frequency
    kept: int = 9  # passes with the tangent of earlier steps before it is made anew; 0: anew in each, 9: Exudyn's choice
    tolerance: float = 1e-6  # of a step, relative to its residual without accelerations and constraint forces; 1e-6 at least


@dataclass(frozen=True, slots=True)
class Effort:
    """Computing time and Newton passes of a motion."""

    seconds: float  # CPU time of Exudyn's stepping alone
    passes: int  # of Newton's method


class ParameterChanges:
    """Parameter differences between a boom and fully `changed` ones, with their share (count + 1,) at the start and every step.

    The boom is not lumped: there, masses are loads. UsageError if a changed boom has other parts.
    """

    def __init__(self, boom: Boom, changed: Sequence[tuple[Boom, Array]]) -> None:
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
        self._set_shares([float(share[row]) for share in self._shares])

    def restore(self) -> None:
        self._set_shares([0.0] * len(self._shares))

    def _set_shares(self, shares: list[float]) -> None:
        if shares == self._last:
            return
        self._last = shares
        for number, old in self._healthy.items():
            values = dict(old)
            for share, more in zip(shares, self._more[number], strict=True):
                for name, value in more.items():
                    values[name] += share * value
            _set(self._system, number, values, {name for more in self._more[number] for name in more})


def _objects(boom: Boom) -> list[dict[str, float]]:
    """Return the parameters of all objects in additive form: first moments instead of the centre of mass."""
    return [_additive(boom.system.GetObject(number)) for number in range(boom.system.systemData.NumberOfObjects())]


def _additive(record: dict[str, Any]) -> dict[str, float]:
    if record["objectType"] == "RigidBody2D":
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


@dataclass(frozen=True, slots=True)
class Course:
    """Inputs to a boom in count + 1 rows, one for the start and one for every step."""

    strokes: Array  # (count + 1, n), m
    rates: Array  # (count + 1, n), m/s
    load: Array | None  # (count + 1, 2), external force at the tip, N, in the base's axes; at the start it is 0
    changes: ParameterChanges  # of stiffnesses and masses


def step_through(boom: Boom, course: Course, step: float, output_step: float, scheme: Scheme) -> Effort:
    """Step a boom from its equilibrium through a course; then load and parameters are again those of the equilibrium."""
    count = len(course.strokes) - 1
    _feed(boom, course, step)
    settings = _settings(count, step, output_step, scheme)
    begun = time.process_time()
    try:
        with contextlib.redirect_stdout(io.StringIO()):
            boom.system.SolveDynamic(settings)
    except exudyn.SolverError as failure:
        raise SolverError(
            f"The rig stopped in a motion of {count * step:g} s ({failure}). Take a step smaller than {step:g} s."
        ) from failure
    except exudyn.ModelError as failure:
        if "KeyboardInterrupt" in str(failure):  # Ctrl-C in the function before a step
            raise KeyboardInterrupt from None
        raise
    finally:
        boom.push(np.zeros(2))
        course.changes.restore()
    seconds = time.process_time() - begun
    return Effort(seconds, int(boom.system.sys["dynamicSolver"].it.newtonStepsCount))


def _settings(count: int, step: float, output_step: float, scheme: Scheme) -> Any:
    """Return Exudyn's settings. Its sparse solver was the fastest from 4 elements a section on, and no slower below.

    A tangent that is made often, kept for less than 3 passes, keeps at least the pattern of its factors.
    """
    settings = exudyn.SimulationSettings()
    settings.solution.file.write = False
    settings.linearSolver.solverType = exudyn.LinearSolverType.EigenSparse
    settings.linearSolver.reuseAnalyzedPattern = scheme.kept < 3
    settings.solution.sensors.writePeriod = output_step
    time_integration = settings.timeIntegration
    time_integration.numberOfSteps, time_integration.endTime = count, count * step
    time_integration.adaptiveStep = time_integration.automaticStepSize = False
    time_integration.verboseMode = 0
    newton = time_integration.newton
    newton.relativeTolerance, newton.absoluteTolerance = scheme.tolerance, 1e-6  # N
    newton.useModifiedNewton = scheme.kept > 0
    newton.maxModifiedNewtonIterations = max(0, scheme.kept - 1)
    time_integration.generalizedAlpha.spectralRadius = scheme.rho
    time_integration.generalizedAlpha.computeInitialAccelerations = False  # at rest they are zero
    return settings


def _feed(boom: Boom, course: Course, step: float) -> None:
    """Hand the drives, before every step, their lengths without force at its end, and load and parameters there."""
    rests = [_rests(boom, i, course) for i in range(len(boom.drives))]
    drives = [(*drive, rest) for drive, rest in zip(boom.drives, rests, strict=True)]
    oils = [(drive[0], _stiffness(boom, i, course).tolist()) for i, drive in enumerate(boom.drives) if _cylinder(boom, i).oil]
    last = [float("nan")] * len(drives)

    def hand_over(row: int) -> None:
        for i, (drive, name, rest) in enumerate(drives):
            if rest[row] != last[i]:
                last[i] = rest[row]
                boom.system.SetObjectParameter(drive, name, rest[row])
        if course.load is not None:
            boom.push(course.load[row])
        course.changes.hand_over(row)
        for drive, stiffness in oils:
            boom.system.SetObjectParameter(drive, "stiffness", stiffness[row])

    def before_step(_: Any, at: float) -> bool:
        hand_over(round(at / step))
        return True

    hand_over(0)
    boom.system.SetPreStepUserFunction(before_step)


def _rests(boom: Boom, index: int, course: Course) -> list[float]:
    """Return the lengths (m) at which a drive is without force when its pins stand still: its own, and d / k of its rate."""
    cylinder = _cylinder(boom, index)
    lengths: Array = course.strokes[:, index] + cylinder.closed_length
    if cylinder.is_compressible:
        lengths = lengths + (cylinder.d or 0.0) / _stiffness(boom, index, course) * course.rates[:, index]
    return [float(rest) for rest in lengths]


def _stiffness(boom: Boom, index: int, course: Course) -> Array:
    """Return the stiffness of an oil spring at the start and after every step, N/m.

    It is that of its drive's stroke, changed in the same proportion.
    """
    stiffness = oil_stiffness(_cylinder(boom, index), course.strokes[:, index])
    return np.asarray(stiffness + course.changes.of(boom.drives[index][0], "stiffness") * (stiffness / stiffness[0]))


def _cylinder(boom: Boom, index: int) -> Cylinder:
    return boom.scene.joints[index].cylinder
