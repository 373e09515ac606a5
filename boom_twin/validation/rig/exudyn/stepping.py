"""Exudyn's own stepping of an assembled boom: with which scheme, and what it took."""

from __future__ import annotations

import contextlib
import io
import time
from dataclasses import dataclass
from typing import Any

import numpy as np

from ....errors import SolverError
from ....types import Array
from .module import exudyn
from .system import Boom

STEP_FORCE = 1e-6  # N, absolute tolerance of a step


@dataclass(frozen=True, slots=True)
class Scheme:
    """Generalised-alpha with Newton's method.

    Attributes
    ----------
    rho : float
        Spectral radius at infinite frequency.
    modified : bool
        Keep the tangent over many steps (Exudyn's modified Newton), or make it anew in every pass.
    tolerance : float
        Relative, of a step; Exudyn's rounding allows no less than 1e-6.
    """

    rho: float = 0.8
    modified: bool = True
    tolerance: float = 1e-6


@dataclass(frozen=True, slots=True)
class Effort:
    """What a motion took.

    Attributes
    ----------
    seconds : float
        Wall time of Exudyn's stepping alone.
    feeding : float
        Of which in the Python function that hands the drives their lengths.
    passes, tangents : int
        Newton passes, and tangents made.
    """

    seconds: float
    feeding: float
    passes: int
    tangents: int


def step_through(boom: Boom, strokes: Array, rates: Array, step: float, output_step: float, scheme: Scheme) -> Effort:
    """From the boom's equilibrium through `strokes` (m) and `rates` (m/s), each (count + 1, n), one row per step."""
    count = len(strokes) - 1
    feeding = _feed(boom, strokes, rates, step)
    settings = _settings(count, step, output_step, scheme)
    begun = time.perf_counter()
    try:
        with contextlib.redirect_stdout(io.StringIO()):
            boom.system.SolveDynamic(settings)
    except exudyn.SolverError as failure:
        raise SolverError(
            f"The rig stopped in a motion of {count * step:g} s ({failure}). Take a step smaller than {step:g} s."
        ) from failure
    seconds = time.perf_counter() - begun
    counted = boom.system.sys["dynamicSolver"].it
    return Effort(seconds, feeding[0], int(counted.newtonStepsCount), int(counted.newtonJacobiCount))


def _settings(count: int, step: float, output_step: float, scheme: Scheme) -> Any:
    """The sparse solver was the fastest from 4 elements a section on, and as fast as the dense ones below.

    A tangent that is made anew in every pass keeps at least the pattern of its factors.
    """
    settings = exudyn.SimulationSettings()
    settings.solution.file.write = False
    settings.linearSolver.solverType = exudyn.LinearSolverType.EigenSparse
    settings.linearSolver.reuseAnalyzedPattern = not scheme.modified
    settings.solution.sensors.writePeriod = output_step
    time_integration = settings.timeIntegration
    time_integration.numberOfSteps, time_integration.endTime = count, count * step
    time_integration.adaptiveStep = time_integration.automaticStepSize = False
    time_integration.verboseMode = 0
    newton = time_integration.newton
    newton.relativeTolerance, newton.absoluteTolerance = scheme.tolerance, STEP_FORCE
    newton.useModifiedNewton = scheme.modified
    time_integration.generalizedAlpha.spectralRadius = scheme.rho
    time_integration.generalizedAlpha.computeInitialAccelerations = False  # at rest they are zero
    return settings


def _feed(boom: Boom, strokes: Array, rates: Array, step: float) -> list[float]:
    """Before every step, hand the drives that move their lengths and rates at its end; returns the seconds it takes.

    All drives get those of the start at once. Pins with play note then whether they touch.
    """
    closed = np.array([joint.cylinder.closed_length for joint in boom.scene.joints])
    lengths, speeds = (strokes + closed).tolist(), rates.tolist()
    last = [[float("nan")] * 2 for _ in boom.drives]
    spent = [0.0]

    def hand_over(row: int) -> None:
        for i, (drive, name) in enumerate(boom.drives):
            now = [lengths[row][i], speeds[row][i]]
            if now != last[i]:
                last[i] = now
                boom.system.SetObjectParameter(drive, name, now[0])
                if name == "referenceLength":
                    boom.system.SetObjectParameter(drive, "velocityOffset", now[1])

    def before_step(_: Any, at: float) -> bool:
        begun = time.perf_counter()
        hand_over(round(at / step))
        for bush in boom.bushes:
            bush.watch(boom.system)
        spent[0] += time.perf_counter() - begun
        return True

    hand_over(0)
    for bush in boom.bushes:
        bush.entry = None
    boom.system.SetPreStepUserFunction(before_step)
    return spent
