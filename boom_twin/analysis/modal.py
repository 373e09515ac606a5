"""Natural frequencies and modes about an equilibrium by Wittrick-Williams counting; stroke noise through the model.

The sweep at A = -omega^2 condenses the dynamic stiffness K - omega^2 M with its full tangent. By Sylvester's law the number
of negative pivots of all that is condensed, less the number of forces among the unknowns, is the number of natural
frequencies below omega (the counting of Wittrick and Williams 1971). Bisection on that integer misses no mode and needs no
starting guess; a mode follows by inverse iteration with the same sweep.

Two ways lead from a stroke's noise to a predicted angle. The estimate of now is off by its own variance P, and turns the joint
by dphi/ds. And what the strokes did before, white noise of density r T (variance times sample interval) as far as the filter
lets it through, has shaken the natural modes. Mode j with modal load N_ij by the drive of cylinder i (the increment of that
cylinder's force, unit modal mass) collects, after a time t,

    var eta_j = sum_i N_ij^2 / omega_j^4 . S_i(omega_j) omega_j / (4 zeta_j) . (1 - exp(-2 zeta_j omega_j t)),
    S_i(omega) = T (r sum_m mu_im G_m(omega)^2 + e_i),   G_m(omega) = 1 / (1 + (omega/omega_m)^6),

G_m being the gain of the smoother with corner frequency omega_m, mu_im how probable it was for stroke i in this time, and e_i
the power of innovations beyond noise where a stroke was not followed (`boom_twin.estimation.stroke_filter`). White noise
through a resonance: Crandall and Mark, Random Vibration in Mechanical Systems, 1963.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from ..compiler.plan import Plan, first_row, taken_apart
from ..errors import SolverError
from ..kernels.tables import OK, SENTENCES, State, Work
from ..kernels.transfer.forward_kinematics import place
from ..kernels.transfer.natural_frequency import (
    NOT_COUNTED,
    bisect_frequency,
    count_below,
    inertia_response,
    position_change,
)
from ..types import Array

HIGHEST = 1e7  # rad/s; no mode is looked for above
RELATIVE_WIDTH = 1e-11  # of the last bracket
SHIFT = 1e-6  # relative distance from the frequency at which a mode is iterated
LOAD = 1e-9  # m, displacement whose inertia forces load the boom for that
ABSURD = "Look for values in the scene that are too large or too small by many orders of magnitude."
NUDGE = 1e-6  # rad, for the derivative of positions by unknowns


@dataclass(frozen=True)
class Mode:
    """One undamped mode, scaled to unit modal mass.

    Attributes
    ----------
    frequency : float
        Hz.
    increments : ndarray, shape (unknowns,)
        Of the unknowns, in the order of `Plan.names`, per unit of the modal coordinate (m sqrt(kg)).
    motion : ndarray, shape (histories,)
        Of every mass point and angle.
    drives : ndarray, shape (n,)
        Lengths of the drives at the equilibrium, m.
    """

    frequency: float
    increments: Array
    motion: Array
    drives: Array


def constraints(plan: Plan) -> int:
    """Number of forces among the unknowns."""
    return int(np.sum(plan.tables.moving == 0.0))


def negative_pivots(plan: Plan, state: State, work: Work, omega: float) -> int:
    """Negative pivots of K - omega^2 M at the present state; SolverError if it cannot be condensed."""
    return _AtRest(plan, state, work).count_below(omega)


class _AtRest:
    """A boom in equilibrium, as `boom_twin.kernels.transfer.natural_frequency` takes it, with scratch."""

    def __init__(self, plan: Plan, state: State, work: Work) -> None:
        place(plan.tables, state, work)
        position, inner = work.position.copy(), work.condensed.blocks.shape[1]
        still = np.zeros_like(position)
        self._boom = plan.tables, state, work, position, drive_at_rest(plan, state, work), still
        self._scratch, self._hat = np.zeros((inner + 1, inner)), np.zeros_like(position)

    def count_below(self, omega: float) -> int:
        """Natural frequencies below `omega` (rad/s), plus forces among the unknowns."""
        place(*self._boom[:3])
        _, count = _checked(*count_below(*self._boom, omega, self._scratch))
        return count

    def lowest(self, count: int, width: float, highest: float, known: Sequence[float] = ()) -> Iterator[float]:
        """The lowest `count` natural frequencies below `highest` (rad/s), ascending, to the relative accuracy `width`.

        Of the lowest, which are `known`, none is given.
        """
        base = self.count_below(0.0)
        low = known[-1] * (1.0 - 1e-9) if known else 0.0
        for k in range(len(known), min(count, self.count_below(highest) - base)):
            omega = self.frequency(base, k, low, width)
            yield omega
            low = omega * (1.0 - 1e-9)

    def frequency(self, base: int, number: int, low: float, width: float, near: float = 0.0) -> float:
        """The frequency (rad/s), above `low`, at which the count less `base` rises from at most `number` to more.

        `near` is what it is known to be about; 0 if it is not.
        """
        omega, _ = _checked(*bisect_frequency(*self._boom, base, number, low, near, width, self._scratch))
        return omega

    def those_near(self, numbers: Sequence[int], near: Sequence[float], width: float) -> Iterator[float]:
        """Natural frequencies by number, from 0, that are about `near` (rad/s); ascending."""
        base = self.count_below(0.0)
        for number, about in zip(numbers, near, strict=True):
            yield self.frequency(base, number, 0.0, width, about)

    def response(self, omega: float, load: Array) -> Array:
        """Solve (K - omega^2 M) dz = M load, up to a factor.

        Half the difference of two small loads: the tangent holds forces too, so a large one would change K, and what the
        state lacks to equilibrium cancels.
        """
        found = np.zeros_like(self._boom[1].z)
        inertia_response(*self._boom, omega, load, LOAD, self._hat, found)
        return found


def _checked(status: int, count: int, omega: float) -> tuple[float, int]:
    """A frequency (rad/s), and the count there; SolverError if it could not be counted."""
    if status != OK:
        told = f"vibration at {omega / (2.0 * math.pi):.6g} Hz cannot be computed"
        raise SolverError(f"{told}: {SENTENCES[status]}. {ABSURD}")
    if count == NOT_COUNTED:
        raise SolverError(f"the stiffness of the boom is not finite. {ABSURD}")
    return omega, count


def drive_at_rest(plan: Plan, state: State, work: Work) -> Array:
    """Drive lengths (m) at which the present state is in equilibrium: its own, less the oil's compression."""
    cylinders, (compliances, _) = plan.tables.cylinders, plan.compliances_and_lags(state.drives[0])
    return np.asarray(work.position[cylinders.history] - compliances * state.z[cylinders.z])


def natural_modes(
    plan: Plan, state: State, work: Work, count: int, width: float = RELATIVE_WIDTH, highest: float = HIGHEST
) -> tuple[Mode, ...]:
    """The lowest `count` modes below `highest` (rad/s) about the equilibrium in `state`, or all if there are fewer.

    `width` is the relative accuracy of the frequencies. The state stays as it is.
    """
    return ModeSeries(plan, state, work, width).lowest(count, highest)


class ModeSeries:
    """Natural modes about the equilibrium in `state`, computed from the lowest on as they are asked for, and kept.

    Parameters
    ----------
    plan : Plan
    state : State
        Stays as it is, and must.
    work : Work
        Scratch.
    width : float
        Relative accuracy of the frequencies.
    """

    def __init__(self, plan: Plan, state: State, work: Work, width: float) -> None:
        self._plan, self._state, self._work, self._width = plan, state, work, width
        self._boom, self._omegas, self._modes = _AtRest(plan, state, work), list[float](), list[Mode]()

    def lowest(self, count: int, highest: float) -> tuple[Mode, ...]:
        """The lowest `count` modes below `highest` (rad/s), or all if there are fewer."""
        parts, below = (self._plan, self._state, self._work), sum(omega < highest for omega in self._omegas)
        if below == len(self._omegas) < count:
            for omega in self._boom.lowest(count, self._width, highest, tuple(self._omegas)):
                self._modes.append(_mode(*parts, self._boom, omega, self._modes))
                self._omegas.append(omega)
            place(self._plan.tables, self._state, self._work)
            below = len(self._omegas)
        return tuple(self._modes[: min(count, below)])


def natural_frequencies(plan: Plan, state: State, work: Work, count: int, width: float) -> Array:
    """The lowest `count` natural frequencies (Hz) alone, or all if there are fewer; see `natural_modes`."""
    found = np.array(list(_AtRest(plan, state, work).lowest(count, width, HIGHEST)))
    place(plan.tables, state, work)
    return found / (2.0 * math.pi)


def frequencies_near(plan: Plan, state: State, work: Work, numbers: Sequence[int], near: Array, width: float) -> Array:
    """Natural frequencies (Hz) by number, from 0 and ascending, where it is known what they are about: `near` (Hz)."""
    found = np.array(list(_AtRest(plan, state, work).those_near(numbers, (2.0 * math.pi * near).tolist(), width)))
    place(plan.tables, state, work)
    return found / (2.0 * math.pi)


def _mode(plan: Plan, state: State, work: Work, boom: _AtRest, omega: float, lower: list[Mode]) -> Mode:
    """Inverse iteration from a random inertial load, a little beside `omega`, free of the `lower` modes."""
    rng = np.random.default_rng(1)
    motion = rng.standard_normal(len(plan.masses)) * (plan.masses > 0.0)
    increments = np.zeros(len(plan.names))
    for _ in range(3):
        for mode in lower:
            motion = motion - mode.motion * ((plan.masses * motion) @ mode.motion)
        increments, motion = boom.response(omega * (1.0 - SHIFT), motion), np.zeros_like(motion)
        position_change(plan.tables, state, work, state.z.copy(), increments, _nudge(plan, increments), motion)
        size = math.sqrt(float(plan.masses @ motion**2))
        if not 0.0 < size < math.inf:
            raise SolverError(f"the mode at {omega / (2.0 * math.pi):.6g} Hz cannot be computed. {ABSURD}")
        motion, increments = motion / size, increments / size
    return Mode(omega / (2.0 * math.pi), increments, motion, state.drives[0].copy())


def joint_increments(plan: Plan, state: State, work: Work, increments: Array) -> Array:
    """Change of the joint angles, shape (n,), rad, with `increments` of the unknowns."""
    return along(plan, state, work, increments, lambda: taken_apart(plan, first_row(plan, state)).joints)


def along(plan: Plan, state: State, work: Work, increments: Array, read: Callable[[], Array]) -> Array:
    """Derivative of what `read` returns along `increments` of the unknowns, by central differences."""
    z = state.z.copy()
    size, sides = _nudge(plan, increments), []
    for sign in (1.0, -1.0):
        state.z[:] = z + sign * size * increments
        place(plan.tables, state, work)
        sides.append(read())
    state.z[:] = z
    place(plan.tables, state, work)
    return np.asarray((sides[0] - sides[1]) / (2.0 * size))


def _nudge(plan: Plan, increments: Array) -> float:
    """Of how many `increments` of the unknowns derivatives are taken."""
    return NUDGE / max(float(np.max(plan.tables.scale * np.abs(increments))), 1e-300)


SWUNG = 0.3  # of the tip's deflection: how far a boom at work swings
TINY = 1e-300
WIDTH = 1e-3  # relative accuracy of their frequencies


class StrokeSpectrum(NamedTuple):
    """Noise in the estimates of n strokes by frequency, see the module; m smoothers.

    Attributes
    ----------
    variance, interval : float
        Of a reading, m^2; time between samples, s.
    corners : ndarray, shape (m,)
        rad/s, ascending.
    shares : ndarray, shape (n, m)
        How probable each smoother was.
    excess : ndarray, shape (n,)
        Power of what was not followed, m^2.
    """

    variance: float
    interval: float
    corners: Array
    shares: Array
    excess: Array

    def at(self, omegas: Array) -> Array:
        """Power spectral density of every stroke, m^2 s, at frequencies (k,) in rad/s; shape (k, n)."""
        gains = 1.0 / (1.0 + (omegas[:, None] / self.corners) ** 6)
        return np.asarray(self.interval * (self.variance * gains**2 @ self.shares.T + self.excess))


@dataclass(frozen=True)
class StrokeNoise:
    """Variances that stroke noise gives predictions at one posture, per mode.

    Attributes
    ----------
    joints : ndarray, shape (modes, n)
        Of the joint angles, rad^2 for a variance of the modal coordinate of 1 m^2 kg.
    decay : ndarray, shape (modes,)
        2 zeta omega, 1/s.
    response : ndarray, shape (modes, n)
        Variance of the modal coordinates, m^2 kg, that white noise of 1 m^2 s in a stroke gives in the long run.
    collected : ndarray, shape (modes,)
        That of the modal coordinates in the long run, m^2 kg.
    modes : tuple of Mode
    omegas : ndarray, shape (modes,)
        Of these, rad/s.
    loads : ndarray, shape (modes, n)
        N_ij: increments of the cylinders' forces per unit of the modal coordinates.
    motions : ndarray, shape (modes, 2)
        Those of the tip, along x and y.
    """

    joints: Array
    decay: Array
    response: Array
    collected: Array
    modes: tuple[Mode, ...]
    omegas: Array
    loads: Array
    motions: Array

    def collected_of(self, spectrum: StrokeSpectrum) -> Array:
        """Variances (modes,) of the modal coordinates, m^2 kg, in the long run under other noise of the strokes."""
        return np.asarray((self.response * spectrum.at(self.omegas)).sum(axis=1))

    def pushes(self, angle: float) -> Array:
        """What an error of the present strokes, too short for any mode to follow, makes of the tip's acceleration.

        In axes turned by `angle`, (m/s^2)^2 for a variance of 1 m^2; shape (n, 2).
        """
        return np.asarray((self.loads.T @ self._turned(angle)) ** 2)

    def _turned(self, angle: float) -> Array:
        """The tip's motions in axes turned by `angle`, shape (modes, 2)."""
        c, s = math.cos(angle), math.sin(angle)
        return np.asarray(self.motions @ np.array([[c, -s], [s, c]]))

    def of_start(self, speeds: Array, sag: Array) -> Array:
        """Variances (modes,), m^2 kg, of vibration that a model lacks when it is started at rest.

        Strokes that went with `speeds` (n,) in m/s set off N_ij v_i / omega_j^3; and the first mode may have swung by
        `SWUNG` of the tip's deflection `sag` (2,) in m.
        """
        found = self.loads**2 @ speeds**2 / self.omegas**6
        return found + self._of_tip(SWUNG * float(np.hypot(*sag)))

    def of_pause(self, span: float, densities: Array) -> Array:
        """Variances (modes,), m^2 kg, of vibration by what strokes did in a pause of `span` s beside what its ends tell.

        A stroke is known but for its jerk, white with `densities` (n,) in m^2/s^5. What a mode keeps of it is its transform
        at omega, less the three parts that stroke, speed and acceleration at the end tell (Legendre polynomials up to the
        second degree): N_ij^2 / omega_j^8 . q_i T (1 - sum_k (2k+1) j_k(omega_j T/2)^2), with spherical Bessel functions.
        """
        from scipy.special import spherical_jn  # takes longer to import than all else that a twin starts with

        known = sum((2 * k + 1) * spherical_jn(k, 0.5 * self.omegas * span) ** 2 for k in range(3))
        return np.asarray(self.loads**2 @ densities * span * np.maximum(1.0 - known, 0.0) / self.omegas**8)

    def of_phase(self, velocity: Array, acceleration: Array) -> Array:
        """Variances (modes,), m^2 kg, of a free vibration of unknown phase: how far two of them are apart, at the most.

        `velocity` and `acceleration` (2,) of the tip are taken to be those of the first mode.
        """
        if not self.modes:
            return np.zeros(0)
        omega = float(self.omegas[0])
        amplitude2 = float(velocity @ velocity) / omega**2 + float(acceleration @ acceleration) / omega**4
        return self._of_tip(float(np.sqrt(2.0 * amplitude2)))

    def _of_tip(self, amplitude: float) -> Array:
        """Variances (modes,) of a first mode that moves the tip by `amplitude` (m)."""
        found = np.zeros(len(self.modes))
        if self.modes:
            found[0] = (amplitude / max(float(np.hypot(*self.motions[0])), TINY)) ** 2
        return found

    def of(self, variances: Array, angle: float) -> tuple[Array, Array, Array, Array]:
        """What modal variances make of joint angles (n,), tip acceleration (2,) in axes turned by `angle`, forces (n,), tip."""
        swing = self.omegas[:, None] ** 2 * self._turned(angle)
        tip, forces = variances @ self.motions**2, variances @ self.loads**2
        return variances @ self.joints, variances @ swing**2, forces, tip


def stroke_noise(plan: Plan, state: State, work: Work, spectrum: StrokeSpectrum) -> StrokeNoise:
    """Propagate noise of the strokes to the natural modes within the band of the quickest smoother."""
    modes = natural_modes(plan, state, work, len(plan.names), width=WIDTH, highest=float(spectrum.corners[-1]))
    found = [(mode, damping_ratio(plan, mode), joint_increments(plan, state, work, mode.increments)) for mode in modes]
    return stroke_noise_of(plan, found, spectrum)


def stroke_noise_of(plan: Plan, found: Sequence[tuple[Mode, float, Array]], spectrum: StrokeSpectrum) -> StrokeNoise:
    """Propagate noise of the strokes to modes with their damping ratios, and what they turn the joints by (n,)."""
    n, tip, cylinders = plan.joints, plan.tables.tip, plan.tables.cylinders.z
    modes = tuple(mode for mode, _, _ in found)
    omegas = np.array([2.0 * np.pi * mode.frequency for mode in modes])
    loads = np.array([mode.increments[cylinders] for mode in modes]).reshape(-1, n)
    motions = np.array([mode.motion[tip : tip + 2] for mode in modes]).reshape(-1, 2)
    zetas, joints = np.array([zeta for _, zeta, _ in found]), np.array([turns**2 for _, _, turns in found]).reshape(-1, n)
    response = loads**2 / (4.0 * np.maximum(zetas, 1e-6) * omegas**3)[:, None]
    noise = StrokeNoise(joints, 2.0 * zetas * omegas, response, np.zeros(len(modes)), modes, omegas, loads, motions)
    return replace(noise, collected=noise.collected_of(spectrum))


def damping_ratio(plan: Plan, mode: Mode) -> float:
    """Of critical, by the power that oil dampers and beams take from the mode at its own frequency."""
    t, omega = plan.tables, 2.0 * np.pi * mode.frequency
    compliances, lags = plan.compliances_and_lags(mode.drives)
    loss = sum((lags * compliances * mode.increments[t.cylinders.z] ** 2).tolist())
    columns = (t.beams[name].tolist() for name in ("z", "bending", "beta", "axial", "axial_stiffness"))
    for row, (z, bending, beta, axial, stiffness) in enumerate(zip(*columns, strict=True)):
        q = mode.increments[z : z + bending]
        loss += beta * float(q @ t.stiffness[row, :bending, :bending] @ q)
        if axial:
            loss += beta * stiffness * mode.increments[z + bending] ** 2
    return float(loss / (2.0 * omega))
