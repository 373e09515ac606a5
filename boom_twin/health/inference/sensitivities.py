"""Sensitivities of the residuals to every parameter, at the present posture and load."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ...analysis.equilibrium import settle
from ...analysis.modal import frequencies_near, natural_frequencies
from ...compiler.compile import compile_scene
from ...compiler.plan import Plan
from ...deviation.sensor_model import Mounting, Reading
from ...errors import BoomTwinError, SolverError
from ...kernels.integrators import REST, X, prepare
from ...kernels.jit import SameTypes, hold
from ...kernels.tables import OK, State, Work
from ...kernels.transfer.time_step import ANEW, advance
from ...scene.edit import with_parameters
from ...scene.kinematics import joint_angles_of_strokes
from ...scene.schema import Scene
from ...types import Array, Mount
from .fault_catalogue import Form, Parameter, step_of
from .holds import HoldProblem, StillReadings

STROKE_STEP = 1e-5  # m
TOLERANCE, PASSES, LONGEST = 1e-7, np.int64(12), 0.1  # of a pass, rad
MODES, WIDTH = 4, 1e-6  # natural frequencies that are compared, and their relative accuracy
NEAR = 0.25  # a measured frequency is that of the nearest mode, if it is no further from it than this share


class Signature(NamedTuple):
    """At one posture; n joints, c = n + 2 channels (angles, IMU).

    Attributes
    ----------
    strokes : ndarray, shape (n,)
        m.
    channels : ndarray, shape (c, parameters)
        Derivative of measured minus predicted; the columns that depend on motion or time are 0.
    tip : ndarray, shape (2, parameters)
        Likewise of the tip's place, m.
    by_stroke : ndarray, shape (c, n)
        Derivative of what sensors should read by the strokes, 1/m.
    tip_by_stroke : ndarray, shape (2, n)
    """

    strokes: Array
    channels: Array
    tip: Array
    by_stroke: Array
    tip_by_stroke: Array


class Posture(NamedTuple):
    """Where columns are worked out: a boom of n joints at rest.

    Attributes
    ----------
    joints : int
        n.
    strokes, forces : ndarray, shape (n,)
        m; of the cylinders, N.
    readings : ndarray, shape (n + 4,)
        See `boom_twin.deviation.sensor_model.Reading`.
    by_stroke : ndarray, shape (n + 4, n)
        Their derivative, 1/m.
    """

    joints: int
    strokes: Array
    readings: Array
    forces: Array
    by_stroke: Array

    def unit(self, place: int) -> Array:
        """A column that adds 1 to the reading at `place`, shape (n + 4,)."""
        column = np.zeros(self.joints + 4)
        column[place] = 1.0
        return column


COLUMNS: dict[Form, Callable[[Posture, int], Array]] = {
    Form.ANGLE: lambda at, i: at.unit(i),
    Form.IMU: lambda at, i: at.unit(at.joints + i),
    Form.STROKE: lambda at, i: -at.by_stroke[:, i],
    Form.SCALE: lambda at, i: -at.by_stroke[:, i] * at.strokes[i],
    Form.ANGLE_SCALE: lambda at, i: at.unit(i) * at.readings[i],
    Form.IMU_SCALE: lambda at, _: at.unit(-4) * at.readings[-4] + at.unit(-3) * at.readings[-3],
    Form.IMU_TURN: lambda at, _: at.unit(-4) * at.readings[-3] - at.unit(-3) * at.readings[-4],
    Form.PLAY: lambda at, i: at.by_stroke[:, i] * np.sign(at.forces[i]),
}
"""Derivative of the readings by a parameter of that form and index; of `Form.SCENE` it comes from another boom at rest, and
those that depend on motion or time are 0 here."""


class _Boom:
    """One boom with a state of its own."""

    def __init__(self, scene: Scene, mounts: tuple[Mount | None, ...]) -> None:
        self.scene = scene
        self.plan: Plan = compile_scene(scene)
        self.state: State = self.plan.state()
        self.work: Work = self.plan.work()
        self._still = np.zeros(self.plan.joints)
        self._advance = SameTypes(advance)
        scheme = prepare(REST, 0.0, 0.0, self.work.weights)
        self._held = tuple(map(hold, (self.plan.tables, self.state, self.work, scheme)))
        self._closed = self.plan.closed_lengths
        self.reading = Reading(self.plan, Mounting(self.plan, scene.base.inclination, mounts))

    def start(self, strokes: Array) -> None:
        """Rest there, from nothing; SolverError or UsageError if there is no equilibrium."""
        settle(self.plan, self.state, self.work, strokes, joint_angles_of_strokes(self.scene, strokes))

    def rest(self, strokes: Array) -> Array | None:
        """What sensors read at rest there, next to where the boom is; None without an equilibrium."""
        drive = self._closed + strokes
        status, _, _ = self._advance(*self._held, drive, self._still, TOLERANCE, PASSES, LONGEST, None, ANEW)
        return self.reading.of(self.state) if status == OK else None

    def follow(self, other: Stand) -> None:
        """Be where a boom with the same unknowns is; it may lack point masses that this one has."""
        self.state.z[:] = other.z
        self.state.history[X, : len(self.state.z)] = self.state.z
        self.state.contacts[:], self.state.drives[:] = other.contacts, other.drives

    def stand(self) -> Stand:
        """Where it is."""
        return Stand(self.state.z.copy(), self.state.contacts.copy(), self.state.drives.copy())


class Stand(NamedTuple):
    """Where a boom rests: see `kernels.tables.State`."""

    z: Array
    contacts: Array
    drives: Array


@dataclass
class HoldInWork:
    """A hold of which derivatives of natural frequencies are still to be made.

    Attributes
    ----------
    problem : HoldProblem
        Its `frequencies` are filled as they come.
    stand : Stand
        Of the nominal boom.
    model : ndarray, shape (m,)
        Its natural frequencies that were measured, Hz.
    made : int
        Of the changed booms.
    """

    problem: HoldProblem
    stand: Stand
    model: Array
    made: int = 0


def _frequencies(boom: _Boom) -> Array:
    """The lowest natural frequencies (Hz) of a boom where it is."""
    return natural_frequencies(boom.plan, boom.state, boom.work, MODES, WIDTH)


class Signatures:
    """Follows the posture of a boom.

    Parameters
    ----------
    scene : Scene
        With its load.
    known : tuple of Parameter
    mounts : tuple of Mount or None
        Of the angle sensors.
    """

    def __init__(self, scene: Scene, known: tuple[Parameter, ...], mounts: tuple[Mount | None, ...]) -> None:
        self.scene, self.known = scene, known
        self.nominal = _Boom(scene, mounts)
        self._changed: list[tuple[int, float, _Boom]] = []
        for place, each in enumerate(known):
            if each.form is Form.SCENE:
                step, values = step_of(each, scene)
                self._changed.append((place, step, _Boom(with_parameters(scene, values), mounts)))
        self._is_settled = False

    def hold(self, readings: StillReadings) -> HoldInWork | None:
        """A hold with the derivatives of means there; None where there is no equilibrium."""
        try:
            return self._hold(readings)
        except BoomTwinError:
            return None

    def go_on(self, work: HoldInWork) -> bool:
        """Make the derivatives by one more parameter; whether there are more to come. SolverError without an equilibrium.

        One a call: a changed boom takes 2 ms, all of them together would keep a sample waiting.
        """
        if work.made == len(self._changed) or not len(work.model):
            return False
        place, step, boom = self._changed[work.made]
        boom.follow(work.stand)
        if boom.rest(work.problem.strokes) is None:
            raise SolverError("a changed boom finds no rest")
        changed = frequencies_near(boom.plan, boom.state, boom.work, work.problem.modes.tolist(), work.model, WIDTH)
        work.problem.frequencies[:, 1 + place] = (changed / work.model - 1.0) / step
        work.made += 1
        return work.made < len(self._changed)

    def _hold(self, readings: StillReadings) -> HoldInWork | None:
        there = self.at(readings.strokes)
        if there is None:
            return None
        table = np.column_stack([readings.left, there.channels])
        model = _frequencies(self.nominal)
        sensed: dict[int, tuple[float, float]] = {}
        for each in readings.vibrations:
            mode = int(np.argmin(np.abs(model - each.frequency)))
            off, sigma = each.frequency / model[mode] - 1.0, each.frequency_sigma / model[mode]
            if abs(off) < NEAR and (mode not in sensed or sigma < sensed[mode][1]):
                sensed[mode] = off, sigma
        modes = np.array(sorted(sensed), np.int64)
        frequencies = np.zeros((len(modes), 1 + len(self.known)))
        frequencies[:, 0] = [sensed[mode][0] for mode in modes.tolist()]
        sigmas = np.array([sensed[mode][1] for mode in modes.tolist()])
        start, end, strokes = readings.start, readings.end, readings.strokes
        problem = HoldProblem(start, end, strokes, table, readings.unrest, modes, frequencies, sigmas, there.tip)
        return HoldInWork(problem, self.nominal.stand(), model[modes])

    def at(self, strokes: Array) -> Signature | None:
        """At `strokes` (m), shape (n,); None where there is no equilibrium."""
        try:
            return self._at(strokes)
        except BoomTwinError:
            self._is_settled = False
            return None

    def _at(self, strokes: Array) -> Signature | None:
        n = len(strokes)
        base = self._rest(strokes)
        if base is None:
            return None
        forces = self.nominal.reading.forces(self.nominal.state)
        by_stroke = np.empty((n + 4, n))
        probe = strokes.copy()
        for i in range(n):
            probe[i] = strokes[i] + STROKE_STEP
            moved = self.nominal.rest(probe)
            probe[i] = strokes[i]
            if moved is None:
                return None
            by_stroke[:, i] = (moved - base) / STROKE_STEP
        if self.nominal.rest(strokes) is None:
            return None
        table, stand = np.zeros((n + 4, len(self.known))), self.nominal.stand()
        for place, step, boom in self._changed:
            boom.follow(stand)
            moved = boom.rest(strokes)
            if moved is None:
                return None
            table[:, place] = (moved - base) / step
        posture = Posture(n, strokes, base, forces, by_stroke)
        for place, each in enumerate(self.known):
            if (column := COLUMNS.get(each.form)) is not None:
                table[:, place] += column(posture, each.index)
        return Signature(strokes.copy(), table[: n + 2], table[n + 2 :], by_stroke[: n + 2], by_stroke[n + 2 :])

    def _rest(self, strokes: Array) -> Array | None:
        """The nominal boom there: next to where it was, else from nothing."""
        if self._is_settled and (found := self.nominal.rest(strokes)) is not None:
            return found
        self.nominal.start(strokes)
        self._is_settled = True
        return self.nominal.rest(strokes)
