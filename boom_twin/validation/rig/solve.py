"""Solve the Exudyn boom: equilibrium by Newton's method, motion, and what its sensors read.

Exudyn's own static solver leaves the change of constraint directions out of its tangent, so it converges slowly where
pins carry much load, and not at all where such forces hold the boom up. Here the tangent is the central difference of
Exudyn's residual, which has everything.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...errors import SolverError, UsageError
from ...scene.schema import Scene
from ...types import Array
from . import exudyn, items
from .boom import SHEAR_OVER_AXIAL, build
from .stepping import Course, Effort, ParameterChanges, Scheme, step_through
from .system import Boom, Site, Station


def settle(boom: Boom, strokes: Array) -> None:
    """Assemble the boom and bring it to rest at `strokes` (m) under its full load. What follows starts there."""
    boom.system.Assemble()
    residual, moving = _residual_of(boom.system)
    data = boom.system.systemData
    state = np.concatenate([data.GetODE2Coordinates(), data.GetAECoordinates()])
    for _ in range(40):
        increment = np.linalg.solve(_tangent(residual, state, moving), -residual(state))
        longest = float(np.abs(increment[:moving]).max())
        if not np.isfinite(longest):
            break
        state += increment * min(1.0, 0.2 / max(longest, 1e-300))  # m and rad
        if longest < 1e-6:  # m and rad; what is left is near its square
            residual(state)
            data.SetODE2Coordinates(state[:moving], exudyn.ConfigurationType.Initial)
            return
    where = ", ".join(f"{stroke:.6g}" for stroke in strokes)
    raise SolverError(
        f"The rig did not find the equilibrium at strokes {where} m. Check masses and stiffnesses, or take strokes nearer to a "
        "posture."
    )


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
        nudge, ahead, behind = 1e-5 if i < moving else 1e3, state.copy(), state.copy()  # m and rad
        ahead[i] += nudge
        behind[i] -= nudge
        columns[:, i] = (residual(ahead) - residual(behind)) / (2 * nudge)
    return columns


Share = tuple[int, float]  # a sensor and its share in a reading


class Probes:
    """Exudyn sensors of all recorded quantities. They are added before the system is assembled."""

    def __init__(self, boom: Boom) -> None:
        self._boom, kind, last = boom, exudyn.OutputVariableType, boom.sections[-1].head
        length = boom.scene.sections[-1].length
        self._tip, self._tip_acc = (self._on_body(last, length, each) for each in (kind.Position, kind.Acceleration))
        self._tip_rate = self._on_node(last.node, kind.Coordinates_t)
        self._roots = [self._on_node(section.root.node, kind.Coordinates) for section in boom.sections]
        self._heads = [self._on_node(section.head.node, kind.Coordinates) for section in boom.sections]
        force = {"distance": kind.Force, "referenceLength": kind.ForceLocal}  # by the name of the connector's length
        self._forces = [self._add(items.SensorObject, force[name], objectNumber=drive) for drive, name in boom.drives]
        self._lengths = [self._add(items.SensorObject, kind.Distance, objectNumber=drive) for drive, _ in boom.drives]
        self._sites = [(*self._at_site(site), self._about_site(site)) for site in boom.sites]
        self._base = None if boom.base.node is None else self._on_node(boom.base.node, kind.Coordinates)

    def read(self, at_rest: bool) -> dict[str, Array]:
        """Return all recorded rows (m); if `at_rest`, one row with the present equilibrium. SI.

        Keys: ``t`` (m,); ``tip``, ``tip_acc`` (m, 2); ``tip_angle``, ``tip_rate`` (m,); ``joints``, ``forces`` (tension),
        ``lengths`` (m, n; pin to pin less `closed_length`); ``sites`` (m, k, 7): x, y, their accelerations, angle, its rate,
        bending moment by the curvature (NaN off a beam).
        """

        def data(number: int) -> Array:
            """Return time (column 0; 0 at rest) and the sensor's values."""
            if at_rest:
                return np.hstack([0.0, self._boom.system.GetSensorValues(number)])[None, :]
            return np.asarray(self._boom.system.GetSensorStoredData(number), float)

        def angle(number: int, station: Station) -> Array:
            """Return the absolute angle (rad) of a rigid frame. The node stores only the change from its reference."""
            return np.asarray(data(number)[:, 3] + station.angle)

        def force(number: int, is_compressible: bool) -> Array:
            """Return the cylinder force (N), positive in tension.

            Exudyn's distance multiplier is positive in tension in the dynamic solver, but in compression in the static one.
            """
            return data(number)[:, 1] * (-1.0 if at_rest and not is_compressible else 1.0)

        def site(place: Site, position: int, acceleration: int, frame: int, rate: int, around: tuple[Share, ...]) -> Array:
            section, station = scene.sections[place.section], self._boom.sections[place.section].at(place.at)
            moment: Any = np.full(len(heads), np.nan)
            if around and section.I is not None:
                moment = scene.material.E * section.I * sum(share * data(number)[:, 3] for number, share in around)
            motion = data(position)[:, 1:3], data(acceleration)[:, 1:3], angle(frame, station), data(rate)[:, 3]
            return np.column_stack([*motion, moment])

        scene, sections = self._boom.scene, self._boom.sections
        cylinders = [joint.cylinder for joint in scene.joints]
        roots = np.column_stack([angle(number, each.root) for number, each in zip(self._roots, sections, strict=True)])
        heads = np.column_stack([angle(number, each.head) for number, each in zip(self._heads, sections, strict=True)])
        base = np.zeros(len(heads)) if self._base is None else data(self._base)[:, 3]
        forces = [force(number, each.is_compressible) for number, each in zip(self._forces, cylinders, strict=True)]
        lengths = [data(number)[:, 1] - each.closed_length for number, each in zip(self._lengths, cylinders, strict=True)]
        sites = [site(place, *numbers) for place, numbers in zip(self._boom.sites, self._sites, strict=True)]
        return {
            "t": data(self._tip)[:, 0],
            "tip": data(self._tip)[:, 1:3],
            "tip_acc": data(self._tip_acc)[:, 1:3],
            "tip_angle": heads[:, -1],
            "tip_rate": data(self._tip_rate)[:, 3],
            "joints": roots - np.column_stack([base, heads[:, :-1]]),
            "forces": np.column_stack(forces),
            "lengths": np.column_stack(lengths),
            "sites": np.stack(sites, axis=1) if sites else np.empty((len(heads), 0, 7)),
        }

    def _about_site(self, site: Site) -> tuple[Share, ...]:
        """Add sensors of the curvature of the elements about a site, linear between their middles; none off a beam."""
        built = self._boom.sections[site.section]
        if built.beam is None or not built.beam[0] < site.at < built.beam[1]:
            return ()
        near = sorted(built.beams, key=lambda beam: abs(0.5 * (beam[0] + beam[1]) - site.at))[:2]
        first, second = (0.5 * (start + end) for start, end, _ in near)
        kind, share = exudyn.OutputVariableType.CurvatureLocal, (site.at - first) / (second - first)
        numbers = [self._add(items.SensorBody, kind, bodyNumber=body, localPosition=[0.0, 0.0, 0.0]) for *_, body in near]
        return (numbers[0], 1.0 - share), (numbers[1], share)

    def _at_site(self, site: Site) -> tuple[int, int, int, int]:
        kind, station = exudyn.OutputVariableType, self._boom.sections[site.section].at(site.at)
        position, acceleration = (self._on_body(station, site.at, each) for each in (kind.Position, kind.Acceleration))
        frame, rate = (self._on_node(station.node, each) for each in (kind.Coordinates, kind.Coordinates_t))
        return position, acceleration, frame, rate

    def _on_body(self, station: Station, x: float, kind: Any) -> int:
        """Add a sensor at `x` (m) of a section, on the axis, which is on the rigid frame `station`."""
        return self._add(items.SensorBody, kind, bodyNumber=station.body, localPosition=[x - station.x, 0.0, 0.0])

    def _on_node(self, node: int, kind: Any) -> int:
        return self._add(items.SensorNode, kind, nodeNumber=node)

    def _add(self, item: Any, kind: Any, **where: Any) -> int:
        sensor = item(outputVariableType=kind, storeInternal=True, writeToFile=False, **where)
        return int(self._boom.system.AddSensor(sensor))


Drive = Callable[[Array], tuple[Array, Array]]  # times (m,) in s -> absolute strokes (m, n) in m and their rates (m, n) in m/s

TipLoad = Callable[[Array], Array]  # times (m,) in s -> external force at the tip (m, 2) in N, in the base's axes; 0 at t = 0

Change = tuple[Scene, Callable[[Array], Array]]
"""A scene that differs in stiffnesses or masses only; times (m,) in s -> share (m,) of the difference, 0 at t = 0."""


def statics(scene: Scene, strokes: Array, elements: int = 16) -> dict[str, Array]:
    """Return what `Probes.read` gives of the equilibrium under gravity at absolute `strokes` (m), shape (n,).

    There are no frequencies: Exudyn's eigenvalues lack the geometric stiffness.
    """
    return {name: rows[0] for name, rows in at_rest(scene, np.asarray(strokes, float), elements).rows.items()}


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
    """Integrate the motion from rest in the equilibrium of the drive's first strokes; return what `move` does.

    Rates are zero at t = 0; `t_end` and `output_step` (s) are multiples of `step`.
    """
    first = drive(np.zeros(1))[0][0]
    return move(at_rest(scene, first, elements, sites=sites), drive, t_end, step, output_step, None, load, changes)[0]


@dataclass(frozen=True)
class Resting:
    """A boom in equilibrium, which may be moved from there any number of times; `rows` are of `Probes.read`, one each."""

    boom: Boom
    probes: Probes
    rows: dict[str, Array]


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
    probes = Probes(boom)
    settle(boom, strokes)
    return Resting(boom, probes, probes.read(at_rest=True))


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
    """Integrate the motion of a boom at rest by a chosen scheme; return the rows of `Probes.read`, and the effort.

    ``drives`` (m, n) are added: strokes of the drives, m.
    """
    every = _ratio("output_step", output_step, step)
    count = _ratio("t_end", t_end, step)
    times: Array = step * np.arange(count + 1, dtype=np.float64)
    strokes, rates = drive(times)
    boom = resting.boom
    alike = boom.elements, boom.nodally_exact, boom.lumps is not None, boom.shear_over_axial, boom.sites
    others = [(build(changed, strokes[0], *alike), share(times)) for changed, share in changes]
    course = Course(strokes, rates, None if load is None else load(times), ParameterChanges(boom, others))
    effort = step_through(boom, course, step, output_step, scheme or Scheme())
    found = resting.probes.read(at_rest=False)
    found["forces"][0] = resting.rows["forces"][0]  # Exudyn starts with zero multipliers: incompressible cylinders read zero
    found["t"] = _recorded_times(found["t"], times[::every])
    return found | {"drives": drive(found["t"])[0]}, effort


def _ratio(name: str, whole: float, step: float) -> int:
    count = round(whole / step)
    if count < 1 or abs(count * step - whole) > 1e-6 * step:
        raise UsageError(f"{name} = {whole:g} s: not a multiple of step = {step:g} s. Choose one that is.")
    return count


def _recorded_times(recorded: Array, times: Array) -> Array:
    """Return the times (s) of recorded rows; in long runs the sum of steps is short, and Exudyn records one step later."""
    if len(recorded) != len(times) or np.abs(recorded - times).max() > 2.0 * times[1]:
        raise SolverError(f"Exudyn recorded {len(recorded)} of {len(times)} rows. Choose another output_step.")
    return np.where(np.abs(recorded - times) < 1e-6, times, recorded)
