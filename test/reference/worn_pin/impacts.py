"""Integrate a motion with one contact, cut at every touch and release, by SciPy's stiff solver."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, cast

import numpy as np
from scipy.integrate import solve_ivp

MOST = 20_000  # pieces of a motion

Rates = Callable[[float, np.ndarray, float | None], Sequence[float] | np.ndarray]
Gap = Callable[[float, np.ndarray], tuple[float, float]]
Piece = tuple[Any, float | None]


@dataclass(frozen=True)
class Episode:
    """Contact from a touch to the release, or to the end of the motion, s; greatest penetration, m.

    `entry`, `exit`: approach speed at the touch, speed of separation at the release (nan if none), m/s.
    """

    start: float
    end: float
    entry: float
    exit: float
    depth: float


@dataclass(frozen=True)
class ContactMotion:
    """States (m, n) at times (m,), the entry speed that held at each (nan in flight), and the episodes of contact."""

    times: np.ndarray
    states: np.ndarray
    entries: np.ndarray
    episodes: list[Episode]


def follow(
    rates: Rates,
    gap: Gap,
    start: Sequence[float] | np.ndarray,
    times: np.ndarray,
    rtol: float = 1e-8,
    atol: float | np.ndarray = 1e-10,
    breaks: Sequence[float] = (),
    longest: float = np.inf,
    method: str = "Radau",
) -> ContactMotion:
    """Follow a motion with one contact, to ascending `times`; `breaks`: where the drive is not smooth; steps <= `longest`; s.

    `rates`: (time, state, approach speed at the last touch or None in flight) -> derivative of the state.
    `gap`: (time, state) -> gap (m, positive in contact) and its rate (m/s).
    """
    stops = [*sorted(t for t in breaks if times[0] < t < times[-1]), times[-1]]
    options = {"method": method, "rtol": rtol, "atol": atol, "max_step": longest}
    pieces = list(_pieces(rates, gap, times[0], np.array(start, dtype=float), stops, options))
    states, entries = _rows(pieces, times)
    return ContactMotion(times, states, entries, _episodes(pieces, gap))


def _pieces(
    rates: Rates, gap: Gap, now: float, state: np.ndarray, stops: Sequence[float], options: dict[str, Any]
) -> Iterator[Piece]:
    """Solutions between touches, releases and stops, each with the entry speed that held."""
    depth, rate = gap(now, state)
    entry = max(rate, 0.0) if depth >= 0.0 else None
    count = 0
    for stop in stops:
        while now < stop:
            events = _events(gap, entry is not None)
            found = solve_ivp(rates, (now, stop), state, dense_output=True, events=events, args=(entry,), **options)
            count += 1
            if not found.success or count > MOST:
                raise ArithmeticError(f"t = {found.t[-1]:g} s, after {count} pieces: {found.message}")
            yield found, entry
            now, state = found.t[-1], found.y[:, -1]
            if found.status == 1:
                entry = abs(gap(now, state)[1]) if entry is None else None


def _events(gap: Gap, touching: bool) -> tuple[Any, Any]:
    """Return the events of the gap's change of sign, which ends a piece, and of its maxima."""
    last: dict[float, tuple[float, float]] = {}

    def once(time: float, state: np.ndarray) -> tuple[float, float]:
        if time not in last:
            last.clear()
            last[time] = gap(time, state)
        return last[time]

    def crossing(time: float, state: np.ndarray, entry: float | None) -> float:
        return once(time, state)[0]

    def turning(time: float, state: np.ndarray, entry: float | None) -> float:
        return once(time, state)[1]

    end, top = cast(Any, crossing), cast(Any, turning)
    end.terminal, end.direction, top.direction = True, -1.0 if touching else 1.0, -1.0
    return end, top


def _rows(pieces: Sequence[Piece], times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """States and entry speeds at given times; a touch belongs to what follows it."""
    which = np.searchsorted([found.t[0] for found, _ in pieces], times, side="right") - 1
    states = [pieces[k][0].sol(time) for k, time in zip(which, times, strict=True)]
    entries = [np.nan if pieces[k][1] is None else pieces[k][1] for k in which]
    return np.array(states), np.array(entries)


def _episodes(pieces: Sequence[Piece], gap: Gap) -> list[Episode]:
    episodes: list[Episode] = []
    tops: list[float] = []
    begun: float | None = None
    for found, entry in pieces:
        if entry is None:
            continue
        begun = found.t[0] if begun is None else begun
        tops += [gap(*top)[0] for top in zip(found.t_events[1], found.y_events[1], strict=True)]
        left, released = gap(found.t[-1], found.y[:, -1]), found.status == 1
        if released or found is pieces[-1][0]:
            depth, speed = max([*tops, left[0]]), -left[1] if released else np.nan
            episodes.append(Episode(begun, found.t[-1], entry, speed, depth))
            begun, tops = None, []
    return episodes
