"""Integrate a motion with one contact, cut at every touch and release, by SciPy's stiff solver."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Any, cast

import numpy as np
from scipy.integrate import solve_ivp

MOST = 20_000  # pieces of a motion

Rates = Callable[[float, np.ndarray, float | None], Sequence[float] | np.ndarray]
Gap = Callable[[float, np.ndarray], tuple[float, float]]


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
) -> np.ndarray:
    """States (m, n) of a motion with one contact at ascending `times`.

    `breaks`: where the drive is not smooth; steps <= `longest`; s.

    `rates`: (time, state, approach speed at the last touch or None in flight) -> derivative of the state.
    `gap`: (time, state) -> gap (m, positive in contact) and its rate (m/s).
    """
    stops = [*sorted(t for t in breaks if times[0] < t < times[-1]), times[-1]]
    options = {"method": method, "rtol": rtol, "atol": atol, "max_step": longest}
    pieces = list(_pieces(rates, gap, times[0], np.array(start, dtype=float), stops, options))
    which = np.searchsorted([found.t[0] for found in pieces], times, side="right") - 1
    return np.array([pieces[k].sol(time) for k, time in zip(which, times, strict=True)])


def _pieces(
    rates: Rates, gap: Gap, now: float, state: np.ndarray, stops: Sequence[float], options: dict[str, Any]
) -> Iterator[Any]:
    """Solutions between touches, releases and stops."""
    depth, rate = gap(now, state)
    entry = max(rate, 0.0) if depth >= 0.0 else None
    count = 0
    for stop in stops:
        while now < stop:
            event = _crossing(gap, entry is not None)
            found = solve_ivp(rates, (now, stop), state, dense_output=True, events=event, args=(entry,), **options)
            count += 1
            if not found.success or count > MOST:
                raise ArithmeticError(f"t = {found.t[-1]:g} s, after {count} pieces: {found.message}")
            yield found
            now, state = found.t[-1], found.y[:, -1]
            if found.status == 1:
                entry = abs(gap(now, state)[1]) if entry is None else None


def _crossing(gap: Gap, touching: bool) -> Any:
    """Return the event of the gap's change of sign, which ends a piece."""

    def crossing(time: float, state: np.ndarray, entry: float | None) -> float:
        return gap(time, state)[0]

    end = cast(Any, crossing)
    end.terminal, end.direction = True, -1.0 if touching else 1.0
    return end
