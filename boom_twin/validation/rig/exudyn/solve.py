"""Solve the Exudyn boom: equilibrium by Newton's method, motion.

Exudyn's own static solver leaves the change of constraint directions out of its tangent, so it converges slowly where
pins carry much load, and not at all where such forces hold the boom up. Here the tangent is the central difference of
Exudyn's residual, which has everything.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ....errors import SolverError, UsageError
from ....scene.schema import Scene
from ....types import Array
from . import exudyn
from .boom import SHEAR_OVER_AXIAL, build
from .parameter_changes import ParameterChanges
from .pin_clearance import pin_with_play
from .probes import Probes, attach, read
from .stepping import Course, Effort, Scheme, step_through
from .system import Boom, Site, section_frames

PASSES = 40
SITE = ("x_m", "y_m", "ax_m_s2", "ay_m_s2", "angle_rad", "rate_rad_s", "moment_Nm")  # ends of the columns of a site
LAST_INCREMENT = 1e-6  # m and rad, last increment; what is left is near its square
LONGEST_INCREMENT = 0.2  # m and rad, in one pass
NUDGE = 1e-5  # m and rad, of the difference quotient


def find_equilibrium(system: Any, aim: str) -> None:
    """Bring an assembled system to rest under its full load; errors name the `aim`. What follows starts there."""
    residual, moving = _residual_of(system)
    data = system.systemData
    state = np.concatenate([data.GetODE2Coordinates(), data.GetAECoordinates()])
    for _ in range(PASSES):
        increment = np.linalg.solve(_tangent(residual, state, moving), -residual(state))
        longest = float(np.abs(increment[:moving]).max())
        if not np.isfinite(longest):
            break
        state += increment * min(1.0, LONGEST_INCREMENT / max(longest, 1e-300))
        if longest < LAST_INCREMENT:
            residual(state)
            data.SetODE2Coordinates(state[:moving], exudyn.ConfigurationType.Initial)
            return
    raise SolverError(f"The rig did not find {aim}. Check masses and stiffnesses, or take strokes nearer to a posture.")


def _residual_of(system: Any) -> tuple[Any, int]:
    """Return Exudyn's residual as a function of the state (coordinates, then multipliers), and the number of coordinates."""
    solver, settings = exudyn.MainSolverStatic(), exudyn.SimulationSettings()
    settings.solution.file.write = False
    settings.staticSolver.useLoadFactor = False
    settings.staticSolver.verboseMode = 0
    solver.InitializeSolver(system, settings)
    moving = solver.GetODE2size()

    def residual(state: Array) -> Array:
        system.systemData.SetODE2Coordinates(state[:moving])
        system.systemData.SetAECoordinates(state[moving:])
        solver.ComputeNewtonResidual(system, settings)
        return np.array(solver.GetSystemResidual(), float)

    return residual, moving


def _tangent(residual: Any, state: Array, moving: int) -> Array:
    """Return the derivative of the residual. It is linear in the multipliers, which may be nudged by as much as 1 kN."""
    columns = np.empty((len(state), len(state)))
    for i in range(len(state)):
        nudge, ahead, behind = NUDGE if i < moving else 1e3, state.copy(), state.copy()
        ahead[i] += nudge
        behind[i] -= nudge
        columns[:, i] = (residual(ahead) - residual(behind)) / (2 * nudge)
    return columns


Drive = Callable[[Array], tuple[Array, Array]]  # times (m,) in s -> absolute strokes (m, n) in m and their rates (m, n) in m/s

TipLoad = Callable[[Array], Array]  # times (m,) in s -> external force at the tip (m, 2) in N, in the base's axes; 0 at t = 0

Change = tuple[Scene, Callable[[Array], Array]]
"""A scene that differs in stiffnesses or masses only; times (m,) in s -> share (m,) of the difference, 0 at t = 0."""


def statics(scene: Scene, strokes: Array, elements: int = 16) -> dict[str, list[float]]:
    """Solve the equilibrium under gravity at absolute `strokes` (m), shape (n,). Return lists, SI, the base's axes.

    There are no frequencies: Exudyn's eigenvalues lack the geometric stiffness.
    """
    strokes = np.asarray(strokes, float)
    boom = build(scene, strokes, elements)
    probes = attach(boom)
    settle(boom, strokes)
    found = {key: values[-1] for key, values in read(boom, probes, at_rest=True).items()}
    rigid = section_frames(scene, strokes)[-1].point((scene.sections[-1].length, 0.0))
    return {
        "stroke_m": strokes.tolist(),
        "tip_rigid_m": rigid.tolist(),
        "tip_m": found["tip"].tolist(),
        "joint_rad": found["joints"].tolist(),
        "cylinder_force_N": found["forces"].tolist(),
    }


def simulate(
    scene: Scene,
    drive: Drive,
    t_end: float,
    step: float = 5e-4,
    output_step: float = 1e-3,
    elements: int = 16,
    load: TipLoad | None = None,
    changes: Sequence[Change] = (),
    sites: tuple[Site, ...] = (),
) -> dict[str, Array]:
    """Integrate the motion from rest in the equilibrium of the drive's first strokes; return columns (rows,), SI.

    Rates are zero at t = 0; `t_end` and `output_step` (s) are multiples of `step`. The columns are those of a simulation
    (``t_s``, ``stroke_1_m``, .., ``joint_1_rad``, .., ``tip_x_m``, ``tip_ax_m_s2``, .., ``cylinder_force_1_N``, ..), angle,
    rate and angular acceleration of the tip, ``length_1_m``, .., of every one of the `sites` those of `SITE` (``site_1_x_m``,
    ..), and offsets of journals with play (``cylinder_1_rod_dx_m``, ..).
    """
    first = drive(np.zeros(1))[0][0]
    return move(at_rest(scene, first, elements, sites=sites), drive, t_end, step, output_step, None, load, changes)[0]


@dataclass(frozen=True)
class Resting:
    """A boom in equilibrium, which may be moved from there any number of times; cylinder forces (n,) in N."""

    boom: Boom
    probes: Probes
    forces: Array


def at_rest(
    scene: Scene,
    strokes: Array,
    elements: int,
    nodally_exact: bool = False,
    lumped: bool = False,
    shear_over_axial: float = SHEAR_OVER_AXIAL,
    sites: tuple[Site, ...] = (),
) -> Resting:
    """Build the boom with its drives at `strokes` (m), shape (n,), and let it come to rest; see `build`."""
    boom = build(scene, strokes, elements, nodally_exact, lumped, shear_over_axial, sites)
    probes = attach(boom)
    settle(boom, strokes)
    return Resting(boom, probes, read(boom, probes, at_rest=True)["forces"][-1])


def move(
    resting: Resting,
    drive: Drive,
    t_end: float,
    step: float,
    output_step: float,
    scheme: Scheme | None = None,
    load: TipLoad | None = None,
    changes: Sequence[Change] = (),
) -> tuple[dict[str, Array], Effort]:
    """Integrate the motion of a boom at rest by a chosen scheme; return the columns of `simulate` and the effort."""
    every = _ratio("output_step", output_step, step)
    count = _ratio("t_end", t_end, step)
    times: Array = step * np.arange(count + 1, dtype=np.float64)
    strokes, rates = drive(times)
    others = [(_built_alike(resting.boom, changed, strokes[0]), share(times)) for changed, share in changes]
    course = Course(strokes, rates, None if load is None else load(times), ParameterChanges(resting.boom, others))
    effort = step_through(resting.boom, course, step, output_step, scheme or Scheme())
    found = read(resting.boom, resting.probes, at_rest=False)
    found["forces"][0] = resting.forces  # Exudyn starts with zero multipliers, so incompressible cylinders would read zero
    worn = [pin_with_play(resting.boom.scene, index) for index in range(len(resting.boom.scene.joints))]
    names = [pin.at.replace(".", "_") for pin in worn if pin is not None]
    return _columns(found, drive, times[::every], names), effort


def _built_alike(boom: Boom, scene: Scene, strokes: Array) -> Boom:
    return build(scene, strokes, boom.elements, boom.nodally_exact, boom.lumps is not None, boom.shear_over_axial, boom.sites)


def settle(boom: Boom, strokes: Array) -> None:
    """Assemble the boom and bring it to its equilibrium; it is the start of what follows."""
    boom.system.Assemble()
    aim = f"the equilibrium at strokes {', '.join(f'{s:.6g}' for s in strokes)} m"
    find_equilibrium(boom.system, aim)
    if boom.bushes:
        for bush in boom.bushes:
            bush.release(boom.system)
        find_equilibrium(boom.system, f"{aim} with play in its pins")


def _ratio(name: str, whole: float, step: float) -> int:
    count = round(whole / step)
    if count < 1 or abs(count * step - whole) > 1e-6 * step:
        raise UsageError(f"{name} = {whole:g} s: not a multiple of step = {step:g} s. Choose one that is.")
    return count


def _columns(found: dict[str, Array], drive: Drive, times: Array, pins: Sequence[str]) -> dict[str, Array]:
    if len(found["t"]) != len(times) or np.abs(found["t"] - times).max() > 2.0 * times[1]:
        raise SolverError(f"Exudyn recorded {len(found['t'])} of {len(times)} rows. Choose another output_step.")
    # in long runs the sum of steps falls short of a whole output step, and Exudyn records one step later
    times = np.where(np.abs(found["t"] - times) < 1e-6, times, found["t"])
    strokes = drive(times)[0]
    number = range(1, strokes.shape[1] + 1)
    return {
        "t_s": times,
        **{f"stroke_{i}_m": strokes[:, i - 1] for i in number},
        **{f"joint_{i}_rad": found["joints"][:, i - 1] for i in number},
        "tip_x_m": found["tip"][:, 0],
        "tip_y_m": found["tip"][:, 1],
        "tip_ax_m_s2": found["tip_acc"][:, 0],
        "tip_ay_m_s2": found["tip_acc"][:, 1],
        **{f"cylinder_force_{i}_N": found["forces"][:, i - 1] for i in number},
        "tip_angle_rad": found["tip_angle"],
        "tip_angular_velocity_rad_s": found["tip_rate"],
        "tip_angular_acceleration_rad_s2": found["tip_rate_dot"],
        **{f"length_{i}_m": found["lengths"][:, i - 1] for i in number},
        **{
            f"site_{k + 1}_{name}": found["sites"][:, k, j]
            for k in range(found["sites"].shape[1])
            for j, name in enumerate(SITE)
        },
        **{f"{pin}_d{axis}_m": found["pins"][:, k, j] for k, pin in enumerate(pins) for j, axis in enumerate("xy")},
    }
