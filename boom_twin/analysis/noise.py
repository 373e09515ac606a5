"""Noise of the stroke sensors, propagated through the model to joint angles and to the acceleration of the tip.

Two ways lead from a stroke's noise to a predicted angle. The estimate of now is off by its own variance P, and turns the joint
by dphi/ds. And what the strokes did before, white noise of density r T (variance times sample interval) as far as the smoother
lets it through, has shaken the natural modes. Mode j with modal load N_ij by the drive of cylinder i (the increment of that
cylinder's force, unit modal mass) collects, after a time t,

    var eta_j = sum_i N_ij^2 / omega_j^4 . r T omega_j / (4 zeta_j) . G(omega_j)^2 (1 - exp(-2 zeta_j omega_j t)),
    G(omega) = 1 / (1 + (omega/omega_c)^6),   omega_c = (q / (r T))^(1/6),

G being the gain of the smoother for strokes that are integrated white jerk of density q. White noise through a resonance:
Crandall and Mark, Random Vibration in Mechanical Systems, 1963.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import spherical_jn

from ..chain.program import State, Work
from ..plan.plan import Plan
from ..records import Array
from .frequencies import Mode, joint_increments, natural_modes

BAND = 2.5  # modes are looked at up to this multiple of the smoother's own frequency
SWUNG = 0.3  # of the tip's deflection: how far a boom at work swings
TINY = 1e-300
WIDTH = 1e-3  # relative accuracy of their frequencies


@dataclass(frozen=True)
class StrokeNoise:
    """Variances that stroke noise gives predictions at one posture, per mode.

    Attributes
    ----------
    joints : ndarray, shape (modes, n)
        rad^2, once the mode has been shaken for long.
    swing : ndarray, shape (modes, 2)
        Deviation of the tip's acceleration, as a vector along the mode's motion there, m/s^2, likewise.
    decay : ndarray, shape (modes,)
        2 zeta omega, 1/s.
    collected : ndarray, shape (modes,)
        Of the modal coordinates, likewise, m^2 kg.
    modes : tuple of Mode
    """

    joints: Array
    swing: Array
    decay: Array
    collected: Array
    modes: tuple[Mode, ...]

    def after(self, time: float, angle: float) -> tuple[Array, Array]:
        """Variances of joint angles (n,), and of tip acceleration (2,) in axes turned by `angle`, `time` s from rest."""
        grown = 1.0 - np.exp(-self.decay * time)
        c, s = np.cos(angle), np.sin(angle)
        return grown @ self.joints, grown @ (self.swing @ np.array([[c, -s], [s, c]])) ** 2

    def of_start(self, plan: Plan, speeds: Array, sag: Array) -> Array:
        """Variances (modes,), m^2 kg, of vibration that a model lacks when it is started at rest.

        Strokes that went with `speeds` (n,) in m/s set off N_ij v_i / omega_j^3; and the first mode may have swung by
        `SWUNG` of the tip's deflection `sag` (2,) in m.
        """
        found = self._loads(plan) ** 2 @ speeds**2 / self._omegas() ** 6
        return found + self._of_tip(plan, SWUNG * float(np.hypot(*sag)))

    def of_pause(self, plan: Plan, span: float, densities: Array) -> Array:
        """Variances (modes,), m^2 kg, of vibration by what strokes did in a pause of `span` s beside what its ends tell.

        A stroke is known but for its jerk, white with `densities` (n,) in m^2/s^5. What a mode keeps of it is its transform
        at omega, less the three parts that stroke, speed and acceleration at the end tell (Legendre polynomials up to the
        second degree): N_ij^2 / omega_j^8 . q_i T (1 - sum_k (2k+1) j_k(omega_j T/2)^2), with spherical Bessel functions.
        """
        omegas = self._omegas()
        known = sum((2 * k + 1) * spherical_jn(k, 0.5 * omegas * span) ** 2 for k in range(3))
        return np.asarray(self._loads(plan) ** 2 @ densities * span * np.maximum(1.0 - known, 0.0) / omegas**8)

    def of_phase(self, plan: Plan, velocity: Array, acceleration: Array) -> Array:
        """Variances (modes,), m^2 kg, of a free vibration of unknown phase: how far two of them are apart, at the most.

        `velocity` and `acceleration` (2,) of the tip are taken to be those of the first mode.
        """
        if not self.modes:
            return np.zeros(0)
        omega = float(self._omegas()[0])
        amplitude2 = float(velocity @ velocity) / omega**2 + float(acceleration @ acceleration) / omega**4
        return self._of_tip(plan, float(np.sqrt(2.0 * amplitude2)))

    def _of_tip(self, plan: Plan, amplitude: float) -> Array:
        """Variances (modes,) of a first mode that moves the tip by `amplitude` (m)."""
        found = np.zeros(len(self.modes))
        if self.modes:
            motion = float(np.hypot(*self.modes[0].motion[plan.tables.tip : plan.tables.tip + 2]))
            found[0] = (amplitude / max(motion, TINY)) ** 2
        return found

    def _omegas(self) -> Array:
        return np.array([2.0 * np.pi * mode.frequency for mode in self.modes])

    def _loads(self, plan: Plan) -> Array:
        """N_ij, shape (modes, n)."""
        rows = [mode.increments[plan.tables.cylinders.z] for mode in self.modes]
        return np.array(rows).reshape(len(rows), plan.joints)

    def of(self, variances: Array, plan: Plan, angle: float) -> tuple[Array, Array, Array]:
        """What modal variances make of joint angles (n,), tip acceleration (2,) in axes turned by `angle`, tip (2,)."""
        share = variances / np.maximum(self.collected, TINY)
        c, s = np.cos(angle), np.sin(angle)
        swing = (self.swing @ np.array([[c, -s], [s, c]])) ** 2
        motions = np.array([mode.motion[plan.tables.tip : plan.tables.tip + 2] for mode in self.modes]).reshape(-1, 2)
        return share @ self.joints, share @ swing, variances @ motions**2


def stroke_noise(plan: Plan, state: State, work: Work, variance: float, interval: float, density: float) -> StrokeNoise:
    """Propagate strokes measured with `variance` (m^2) every `interval` s, smoothed for jerk `density` (m^2/s^5)."""
    spectrum = variance * interval
    corner = (density / spectrum) ** (1.0 / 6.0)
    modes = natural_modes(plan, state, work, len(plan.names), width=WIDTH, highest=BAND * corner)
    joints, swing, decay, variances = [], [], [], []
    tip = plan.tables.tip
    for mode in modes:
        omega, zeta = 2.0 * np.pi * mode.frequency, damping_ratio(plan, mode)
        load = float(np.sum(mode.increments[plan.tables.cylinders.z] ** 2))
        gain = 1.0 / (1.0 + (omega / corner) ** 6)
        collected = load / omega**4 * spectrum * omega / (4.0 * max(zeta, 1e-6)) * gain**2
        joints.append(collected * joint_increments(plan, state, work, mode) ** 2)
        swing.append(np.sqrt(collected) * omega**2 * mode.motion[tip : tip + 2])
        decay.append(2.0 * zeta * omega)
        variances.append(collected)
    n = plan.joints
    return StrokeNoise(
        np.array(joints).reshape(-1, n), np.array(swing).reshape(-1, 2), np.array(decay), np.array(variances), modes
    )


def damping_ratio(plan: Plan, mode: Mode) -> float:
    """Of critical, by the power that oil dampers and beams take from the mode at its own frequency."""
    t, omega = plan.tables, 2.0 * np.pi * mode.frequency
    loss = 0.0
    for cylinder in t.cylinders:
        loss += cylinder.lag * cylinder.compliance * mode.increments[cylinder.z] ** 2
    for row, beam in enumerate(t.beams):
        q = mode.increments[beam.z : beam.z + beam.bending]
        loss += beam.beta * float(q @ t.stiffness[row, : len(q), : len(q)] @ q)
        if beam.axial:
            loss += beam.beta * beam.axial_stiffness * mode.increments[beam.z + beam.bending] ** 2
    return float(loss / (2.0 * omega))
