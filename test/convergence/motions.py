"""Smooth drives in closed form, and the model stepped along them without any interpolation."""

from __future__ import annotations

import numpy as np
from compiled import RHO, compile_scene, settle, stepped


def smooth_drive(start, travel, duration):
    """Drive from `start` lengths by `travel` (both (n,), m) with q(t) = 35x^4 - 84x^5 + 70x^6 - 20x^7, x = t/duration.

    Three derivatives vanish at both ends. Returns a function of time: lengths, rates, accelerations.
    """
    start, travel = np.asarray(start), np.asarray(travel)

    def drive(time):
        x = np.clip(time / duration, 0.0, 1.0)
        q = x**4 * (35 - 84 * x + 70 * x**2 - 20 * x**3)
        rate = 140 * x**3 * (1 - x) ** 3 / duration
        bend = 420 * x**2 * (1 - x) ** 2 * (1 - 2 * x) / duration**2
        return start + travel * q, travel * rate, travel * bend

    return drive


def follow(scene, drive, angles, step, count, every=1, rho=RHO):
    """Rows (count/every + 1, width) of `observe` along `drive`, from rest in equilibrium; steps of `step` s."""
    plan = compile_scene(scene)
    state, work = plan.state(), plan.work()
    settle(plan, state, work, drive(0.0)[0] - plan.closed_lengths, angles)
    lengths, rates, _ = drive(step * np.arange(1, count + 1)[:, None])
    return stepped(plan, state, work, step, every, lengths, rates, rho)
