"""Integration of a motion with one contact, cut at every touch and every release; SciPy's stiff solver in between."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.integrate import solve_ivp

MOST = 20_000  # pieces of a motion


@dataclass(frozen=True)
class Episode:
    """From a touch to the release, or to the end of the motion.

    Attributes
    ----------
    start, end : float
        s.
    entry : float
        Approach speed at the touch, m/s.
    exit : float
        Speed of separation at the release, m/s.
    peaks : int
        Maxima of the penetration. One is an impact; several mean that the pin follows the bush.
    depth : float
        Greatest penetration, m.
    """

    start: float
    end: float
    entry: float
    exit: float
    peaks: int
    depth: float


@dataclass(frozen=True)
class Motion:
    """States (m, n) at times (m,), the entry speed that held at each (nan in flight), and the episodes of contact."""

    times: np.ndarray
    states: np.ndarray
    entries: np.ndarray
    episodes: list[Episode]


def follow(rates, gap, start, times, rtol=1e-8, atol=1e-10, breaks=(), longest=np.inf, method="Radau"):
    """Follow a motion with one contact.

    Parameters
    ----------
    rates : callable
        (time, state, entry) -> derivative of the state; `entry` is the approach speed at the last touch, None in flight.
    gap : callable
        (time, state) -> gap (m, positive in contact) and its rate (m/s).
    start : ndarray, shape (n,)
    times : ndarray, shape (m,)
        s, ascending, of the rows.
    breaks : sequence of float
        Times at which the drive is not smooth.
    longest : float
        Longest step, s.

    Returns
    -------
    Motion
    """
    now, end, state = float(times[0]), float(times[-1]), np.array(start, dtype=float)
    touching = gap(now, state)[0] >= 0.0
    entry = max(gap(now, state)[1], 0.0) if touching else None
    begun, peaks, deepest = now, 0, 0.0
    rows, entries, episodes = [], [], []
    stops = [*sorted(t for t in breaks if now < t < end), end]
    for _ in range(MOST):
        crossing, turning = _events(gap, touching)
        found = solve_ivp(
            rates, (now, stops[0]), state, method, dense_output=True, events=[crossing, turning], args=(entry,),
            rtol=rtol, atol=atol, max_step=longest,
        )  # fmt: skip
        if not found.success:
            raise ArithmeticError(f"t = {found.t[-1]:g} s: {found.message}")
        inside = times[(times >= now) & ((times < found.t[-1]) | (found.t[-1] == end))]
        rows += list(found.sol(inside).T) if len(inside) else []
        entries += [np.nan if entry is None else entry] * len(inside)
        now, state = float(found.t[-1]), found.y[:, -1]
        if touching:
            tops = [gap(t, y)[0] for t, y in zip(found.t_events[1], found.y_events[1], strict=True)]
            peaks, deepest = peaks + len(tops), max([deepest, *tops])
        if found.status == 1:
            speed = abs(gap(now, state)[1])
            if touching:
                episodes.append(Episode(begun, now, entry, speed, peaks, deepest))
            touching, begun, peaks, deepest = not touching, now, 0, 0.0
            entry = speed if touching else None
        elif now == end:
            if touching:
                episodes.append(Episode(begun, now, entry, np.nan, peaks, max(deepest, gap(now, state)[0])))
            return Motion(times, np.array(rows), np.array(entries), episodes)
        else:
            stops.pop(0)
    raise ArithmeticError(f"more than {MOST} touches by t = {now:g} s")


def _events(gap, touching):
    """Of the gap's change of sign, which ends a piece, and of its maxima."""
    last = {}

    def once(time, state):
        if time not in last:
            last.clear()
            last[time] = gap(time, state)
        return last[time]

    def crossing(time, state, entry):
        return once(time, state)[0]

    def turning(time, state, entry):
        return once(time, state)[1]

    crossing.terminal, crossing.direction = True, -1.0 if touching else 1.0
    turning.direction = -1.0
    return crossing, turning
