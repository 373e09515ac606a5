"""Frequency response about the deflected equilibrium: from a force at the tip or a cylinder's drive to tip, joints, forces.

The boom linearised at rest is solved at every frequency by the complex sweeps of `kernels.transfer.vibration`; no
natural mode is left out. A flexible part bends in at least `SHAPES` shapes, however few the scene has `modes`: so many that up
to 30 Hz more change nothing (see `with_all_shapes`). All pins are ideal.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ..compiler.plan import Plan
from ..errors import SolverError, UsageError
from ..kernels.tables import BEAM, JOINT_A, JOINT_B, OK, SENTENCES, Z_SECTION, Tables, complex_scratch
from ..kernels.transfer.forward_kinematics import place
from ..kernels.transfer.vibration import TIP_FORCE, harmonic_response
from ..scene.load import SceneSource, as_scene
from ..scene.schema import Scene
from ..system.result_text import SummaryDisplay
from ..types import Array, ComplexArray
from .bending_stress import Station, moments_by_unknowns, stations
from .equilibrium import rest_at, strokes_and_angles
from .modal import drive_at_rest

SHAPES = 5  # least number of shapes in which a flexible part bends, see `with_all_shapes`
UPWARD = (0.0, 1.0)  # N


@dataclass(frozen=True, repr=False)
class FrequencyResponse(SummaryDisplay):
    """Complex amplitudes at k frequencies: a quantity moves by the real part of its amplitude times e^(2 pi i f t).

    n sections, m stations.

    Attributes
    ----------
    frequencies : ndarray, shape (k,)
        Hz.
    tip : ndarray of complex, shape (k, 2)
        Displacement of the tip from its place at rest, x and y, m.
    joints : ndarray of complex, shape (k, n)
        Change of the joint angles, rad.
    cylinder_forces : ndarray of complex, shape (k, n)
        Their change, N, positive in tension.
    moments : ndarray of complex, shape (k, m)
        Change of the bending moments, N m, positive where the outboard end is bent up; without material damping.
    stations : tuple of Station
        Where: section and place.
    """

    frequencies: Array
    tip: ComplexArray
    joints: ComplexArray
    cylinder_forces: ComplexArray
    moments: ComplexArray
    stations: tuple[Station, ...]

    def summary_rows(self) -> dict[str, str]:
        """Range of frequencies, and where the tip moves most."""
        f, size = self.frequencies, np.hypot(*np.abs(self.tip.T))
        rows = {"frequencies": f"{len(f)}" + (f", {f.min():.4g} to {f.max():.4g} Hz" if len(f) else "")}
        if len(f):
            rows["largest tip amplitude"] = f"{size.max():.4g} m at {f[size.argmax()]:.4g} Hz"
        return rows

    @property
    def tip_acceleration(self) -> ComplexArray:
        """Acceleration of the tip, m/s^2, shape (k, 2)."""
        return np.asarray(-((2.0 * math.pi * self.frequencies[:, None]) ** 2) * self.tip)

    def channels(self) -> dict[str, ComplexArray]:
        """All quantities by name and unit, each of shape (k,)."""
        found = {"tip_x_m": self.tip[:, 0], "tip_y_m": self.tip[:, 1]}
        found |= {f"tip_a{axis}_m_s2": column for axis, column in zip("xy", self.tip_acceleration.T, strict=True)}
        found |= {f"joint_{i + 1}_rad": column for i, column in enumerate(self.joints.T)}
        found |= {f"cylinder_force_{i + 1}_N": column for i, column in enumerate(self.cylinder_forces.T)}
        for station, column in zip(self.stations, self.moments.T, strict=True):
            found[f"moment_{station.key}_Nm"] = column
        return found


def with_oil_at_rest(plan: Plan, drives: Array, stretches: Array) -> tuple[Tables, Array, Array]:
    """Return tables whose cylinders keep the oil's compliance at rest, and gains and lags (s) of the drives, both (n,).

    A drive on its way changes the stiffness k(s) of its oil, too. The force k(s) (l - s) + d (l' - s') therefore changes by
    -(k - k' (l - s)) ds - d ds'; with k kept it would by -k ds - d ds'. The gain is their ratio 1 - k' (l - s) / k, which is
    1 without `oil`, and the lag is d / k. `drives` and `stretches` l - s (m), both (n,), are those at rest.
    """
    rows, step = plan.tables.cylinders.copy(), 1e-6
    rows.compliance, rows.lag = plan.compliances_and_lags(drives)
    beyond, before = (plan.compliances_and_lags(drives + way)[0] for way in (step, -step))
    change = (beyond - before) / (2.0 * step)  # k' / k is -c' / c
    gains = np.ones(len(rows))
    of_oil = rows.oil >= 0
    gains[of_oil] += change[of_oil] / rows.compliance[of_oil] * stretches[of_oil]
    rows.oil = -1
    return plan.tables._replace(cylinders=rows), gains, rows.lag.copy()


def with_all_shapes(scene: Scene) -> Scene:
    """`scene`, its flexible parts bending in at least `SHAPES` shapes.

    The `modes` of a scene are chosen for time steps. With five a part is so near to an Euler-Bernoulli beam that up to 30 Hz
    the default boom's answer is within 1e-6 of that with more (with three 0.14 %).
    """
    sections = [
        section.model_copy(update={"modes": max(SHAPES, scene.of_section(i, "modes"))}) if scene.is_flexible(i) else section
        for i, section in enumerate(scene.sections)
    ]
    return scene.model_copy(update={"sections": sections})


class LinearisedBoom:
    """A boom at rest at absolute `strokes` (m), next to the joint `angles` (rad), both (n,), for harmonic loads.

    SolverError if there is no equilibrium, UsageError for pins with clearance, which do not answer in proportion.
    """

    def __init__(self, scene: Scene, strokes: Array, angles: Array) -> None:
        self.plan, self._state, work = rest_at(with_all_shapes(scene), strokes, angles)
        if self.plan.pins:
            told = f"clearance.pins = {', '.join(self.plan.pins)}: a boom with play in its pins does not answer in proportion"
            raise UsageError(f"{told}, so it has no frequency response. Leave the block clearance out, or simulate.")
        self.stations = stations(scene)
        yields = scene.base.stiffness is not None or any(scene.is_flexible(i) for i in range(self.plan.joints))
        self._is_rigid = not yields and not self.plan.compliances_and_lags(strokes)[0].any()
        place(self.plan.tables, self._state, work)
        self._drive = drive_at_rest(self.plan, self._state, work)
        stretches = work.position[self.plan.tables.cylinders.history] - self._drive
        self._tables, self._gains, self._lags = with_oil_at_rest(self.plan, self._drive, stretches)
        self._work = complex_scratch(work)
        self._joints, self._moments = joint_angles_by_unknowns(self.plan), moments_by_unknowns(self.plan)

    def respond(self, frequencies: Array, loads: ComplexArray) -> FrequencyResponse:
        """Return the answer at `frequencies` (k,), Hz, to a load at each of them; 0 Hz is the static limit.

        `loads` (k, 2 + n) or (2 + n,) are the force at the tip in x and y (N), then the drive of every cylinder (m), complex.
        SolverError if the equations are singular at a frequency.
        """
        every = np.array(np.broadcast_to(np.asarray(loads, complex), (len(frequencies), self.load().size)))
        rates = 2j * math.pi * np.asarray(frequencies, float)
        damped = np.outer(rates, self._lags)
        every[:, TIP_FORCE:] *= (self._gains + damped) / (1.0 + damped)
        increments, tip = self._increments(rates, every)
        joints = np.asarray(increments @ self._joints.T, complex)
        if self._is_rigid and not every[:, TIP_FORCE:].any():  # nothing moves; what was computed is rounding
            tip[:], joints[:] = 0.0, 0.0
        return FrequencyResponse(
            frequencies=np.asarray(frequencies, float),
            tip=tip[:, :2],
            joints=joints,
            cylinder_forces=increments[:, self.plan.tables.cylinders.z],
            moments=np.asarray(increments @ self._moments.T, complex),
            stations=self.stations,
        )

    def _increments(self, rates: ComplexArray, loads: ComplexArray) -> tuple[ComplexArray, ComplexArray]:
        """Amplitudes of the unknowns (k, unknowns) and of the tip (k, 3) under loads (k, 2 + n) at `rates` (k,), 1/s."""
        large = 1e4  # times a load of 1 N or 1 m: static forces and lengths are rounded to 1e-16 of themselves
        increments = np.zeros((len(rates), len(self.plan.names)), complex)
        tip = np.zeros((len(rates), 3), complex)
        boom = self._tables, self._state, self._work, self._drive
        status, row = harmonic_response(*boom, rates, large * loads, increments, tip)
        if status != OK:
            where = rates[row].imag / (2.0 * math.pi)
            raise SolverError(f"the response at {where:g} Hz cannot be computed: {SENTENCES[int(status)]}.")
        increments /= large
        tip /= large
        return increments, tip

    def load(self, tip_force: Sequence[float] = (0.0, 0.0), drive: int | None = None) -> ComplexArray:
        """A load for `respond`, shape (2 + n,): force at the tip (N), and 1 m of the drive of a cylinder, counted from 0."""
        found = np.zeros(TIP_FORCE + self.plan.joints, complex)
        found[:TIP_FORCE] = tip_force
        if drive is not None:
            found[TIP_FORCE + drive] = 1.0
        return found


def linearised_boom(
    scene: SceneSource = None, strokes: ArrayLike | str | None = None, posture: str | None = None
) -> LinearisedBoom:
    """The `LinearisedBoom` at absolute `strokes` (m), shape (n,), or at a named posture; takes and raises as `statics`."""
    scene = as_scene(scene)
    return LinearisedBoom(scene, *strokes_and_angles(scene, strokes, posture))


def frequency_response(
    scene: SceneSource,
    frequencies: ArrayLike,
    strokes: ArrayLike | str | None = None,
    posture: str | None = None,
    tip_force: Sequence[float] | None = None,
    drive: int | None = None,
) -> FrequencyResponse:
    """Answer to a harmonic force at the tip, or to a harmonic stroke of one cylinder, about the equilibrium under gravity.

    Parameters
    ----------
    scene : Scene, path or mapping
        The boom, of n sections: a `Scene`, a scene file, a dict with its keys; None: the default scene.
    frequencies : array_like, shape (k,)
        Hz, at least 0; 0 gives the static limit.
    strokes : array_like, shape (n,), or str, optional
        Absolute strokes at rest, m; or the name of a posture.
    posture : str, optional
        A posture of the scene; just one of strokes and posture is given.
    tip_force : sequence of two numbers, optional
        Amplitude of the force at the tip in x and y, N; by default 1 N in y.
    drive : int, optional
        Instead of a force: the cylinder, counted from 1, whose drive moves with an amplitude of 1 m (the answer is linear).

    Returns
    -------
    FrequencyResponse
        Complex amplitudes of tip, joint angles, cylinder forces and bending moments.

    Raises
    ------
    UsageError
        As `statics` does; frequencies that are negative or not finite; a force and a drive; a force of 0; a cylinder that is
        not there; pins with clearance.
    SolverError
        No stable equilibrium was found.

    Examples
    --------
    >>> import numpy as np
    >>> from boom_twin import frequency_response, load_scene
    >>> found = frequency_response(load_scene(), np.linspace(0.05, 30.0, 300), posture="arch")
    >>> gain = abs(found.tip[:, 1])  # m of the tip's height per N
    """
    scene = as_scene(scene)
    frequencies = np.atleast_1d(np.asarray(frequencies, dtype=float))
    if frequencies.ndim != 1 or not np.all(np.isfinite(frequencies) & (frequencies >= 0.0)):
        raise UsageError(f"frequencies = {frequencies}: must be finite and at least 0 Hz, in one row.")
    if tip_force is not None and drive is not None:
        raise UsageError("tip_force and drive: give one of them, the answers add up.")
    n = len(scene.joints)
    if drive is not None and not 1 <= drive <= n:
        raise UsageError(f"drive = {drive}: the scene has cylinders 1 to {n}. Name one of them.")
    if tip_force is not None and not (len(tip_force) == 2 and np.all(np.isfinite(tip_force))):
        raise UsageError(f"tip_force = {tip_force}: give two numbers, the force in x and y (N).")
    if tip_force is not None and not np.any(tip_force):
        raise UsageError("tip_force = (0, 0) N moves nothing. Give a force, such as 0,1, or the drive of a cylinder.")
    boom = linearised_boom(scene, strokes, posture)
    force = tip_force if tip_force is not None else UPWARD
    return boom.respond(frequencies, boom.load(force) if drive is None else boom.load(drive=drive - 1))


def joint_angles_by_unknowns(plan: Plan) -> Array:
    """Derivatives of the joint angles by the unknowns, shape (n, unknowns): a section's root against what carries it."""
    t, found = plan.tables, np.zeros((plan.joints, len(plan.names)))
    head, joint = np.zeros(len(plan.names)), 0
    head[t.hinges.z] = 1.0
    for operation in t.operations:
        row = operation.row
        if operation.kind in (JOINT_A, JOINT_B):
            root = np.zeros_like(head)
            root[t.joints[row].z + Z_SECTION] = 1.0
            found[joint] = root - head
            head, joint = root, joint + 1
        elif operation.kind == BEAM:
            beam = t.beams[row]
            head = head.copy()
            head[beam.z : beam.z + beam.bending] += t.psi[row, beam.points, : beam.bending]
    return found
