"""Natural frequencies, damping ratios and mode shapes of a session's rest periods, under any excitation.

Stochastic subspace identification with covariances (B. Peeters and G. De Roeck, Mech. Syst. Signal Process. 13 (1999),
855-878), by pyOMA-2. Poles are computed for model orders up to 40. A pole that stays the same from one order to
the next is stable. Stable poles of one frequency are a mode. Deviations follow from the covariance of the output covariances.
"""

from __future__ import annotations

import logging
from contextlib import redirect_stderr
from dataclasses import dataclass
from io import StringIO
from typing import Any

import numpy as np

from ..analysis.posture_modes import nearest_mode
from ..calibration.sessions import MeasuredSession, RestPeriod, Rigging, channel_names, rest_periods
from ..deviation.predictor import BoomPredictor
from ..errors import BagError, UsageError
from ..scene.schema import Scene
from ..types import Array

RATE = 40.0  # Hz, rate of the averaged samples
SHORTEST_REST = 20.0  # s


@dataclass(frozen=True, slots=True)
class MeasuredRest:
    """Modes of one rest period."""

    start: float  # s since the first stroke sample of the session
    stop: float
    model: Array  # natural frequencies of the model, Hz
    poles: Array  # (poles, 3), frequency (Hz), model order, and 1 if the pole is stable, else 0
    modes: list[dict[str, Any]]  # as in ``modes.json``


def measured_rests(session: MeasuredSession, scene: Scene, rigging: Rigging) -> list[MeasuredRest]:
    """Return the modes of every rest period of at least `SHORTEST_REST` seconds; BagError without one, or without sensors."""
    periods = rest_periods(session, scene, rigging, needed=0.0)
    long_enough = [each for each in periods if each.times[-1] >= SHORTEST_REST]
    if not long_enough:
        longest = max((float(each.times[-1]) for each in periods), default=0.0)
        raise BagError(
            f"{session.name}: the longest rest period has {longest:.1f} s; {SHORTEST_REST:g} s are needed. Record a minute or "
            "more at rest, in wind or under the pump."
        )
    return [_measured(session.name, period, scene, rigging) for period in long_enough]


def _measured(name: str, period: RestPeriod, scene: Scene, rigging: Rigging) -> MeasuredRest:
    names = channel_names(len(scene.joints))
    columns = {names[k]: column for k in np.unique(period.channels) if (column := _even(period, int(k))) is not None}
    columns = {key: column for key, column in columns.items() if not key.startswith("cylinder_") or "force" in key}
    leading = [key for key in columns if key.startswith("tip_imu")] or list(columns)
    if not columns:
        raise BagError(f"{name}: neither IMU nor angles nor forces. Record one of them.")
    order = leading + [key for key in columns if key not in leading]
    values = np.column_stack([columns[key] for key in order])
    poles, groups = _stable_groups(values[:, : len(leading)])
    shapes = _shapes(values, len(leading), [float(np.median(each[:, 0])) for each in groups])
    boom = BoomPredictor(scene, rigging.settings, rigging.mounts, rigging.reads)
    boom.start(period.strokes)
    model = boom.posture.omega[: boom.posture.modes[0]] / (2.0 * np.pi)
    named = [dict(zip(order, shape.tolist(), strict=True)) for shape in shapes]
    modes = [_mode(each, shape, model) for each, shape in zip(groups, named, strict=True)]
    return MeasuredRest(period.start, period.start + float(period.times[-1]), model.copy(), poles, modes)


def _even(period: RestPeriod, channel: int) -> Array | None:
    """Return readings of a channel averaged to `RATE`, with mean 0 and deviation 1, or None if they are constant."""
    settling = 1.0  # s, left out at the start of a rest period
    own = (period.channels == channel) & (period.times >= settling)
    count = int((period.times[-1] - settling) * RATE)
    places = np.minimum(((period.times[own] - settling) * RATE).astype(int), count - 1)
    sums, counts = (np.bincount(places, weights, count) for weights in (period.values[own], None))
    there = np.flatnonzero(counts)
    if len(there) < 2:
        return None
    found = np.interp(np.arange(count), there, sums[there] / counts[there])
    deviation = float(found.std())
    return np.asarray((found - found.mean()) / deviation) if deviation > 0.0 else None


def _identified(values: Array, leading: int, with_deviations: bool) -> tuple[Array, ...]:
    """Return frequencies (Hz), damping ratios, labels, deviations of the first two, shapes, by row and order of the poles."""
    largest_damping, largest_variation = 0.1, 0.05  # damping ratio; relative deviation of the frequency
    try:
        from pyoma2.algorithms.ssi import SSI
        from pyoma2.setup.single import SingleSetup
    except ImportError:
        raise UsageError("pyOMA-2 is not installed. Install it: pip install 'boom_twin[modal]'.") from None
    limits: Any = {"xi_max": largest_damping, "mpc_lim": None, "mpd_lim": None, "CoV_max": largest_variation}
    block_rows, highest_order, record_parts = 25, 40, 10
    method: Any = SSI(
        name="ssi", br=block_rows, ordmax=highest_order, ref_ind=list(range(leading)), hc=limits,
        calc_unc=with_deviations, nb=record_parts,
    )  # fmt: skip
    silenced, setup = logging.root.manager.disable, SingleSetup(values, fs=RATE)
    logging.disable(logging.INFO)
    try:
        with redirect_stderr(StringIO()):  # hides progress bars
            setup.add_algorithms(method)
            setup.run_by_name("ssi")
    finally:
        logging.disable(silenced)
    found = method.result
    return found.Fn_poles, found.Xi_poles, found.Lab, found.Fn_poles_std, found.Xi_poles_std, found.Phi_poles


def _stable_groups(values: Array) -> tuple[Array, list[Array]]:
    """Return all poles as in `MeasuredRest.poles`, and the stable ones of each mode: frequency, damping, deviations."""
    fewest_orders = 10  # model orders with a stable pole of a mode
    apart = 0.02  # relative difference that separates two modes
    frequencies, dampings, labels, frequency_sigmas, damping_sigmas, _ = _identified(values, values.shape[1], True)
    known = np.isfinite(frequencies)
    orders = np.broadcast_to(np.arange(frequencies.shape[1]), frequencies.shape)
    poles = np.column_stack([each[known] for each in (frequencies, orders, labels == 1)]).astype(float)
    stable = known & (labels == 1)
    rows = np.column_stack([each[stable] for each in (frequencies, dampings, frequency_sigmas, damping_sigmas)])
    rows = rows[np.argsort(rows[:, 0])]
    cuts = np.flatnonzero(np.diff(rows[:, 0]) > apart * rows[1:, 0]) + 1
    return poles, [part for part in np.split(rows, cuts) if len(part) >= fewest_orders]


def _shapes(values: Array, leading: int, frequencies: list[float]) -> list[Array]:
    """Return, for each frequency, the real shape at all channels of the nearest pole."""
    if not frequencies:
        return []
    found, _, _, _, _, shapes = _identified(values, leading, False)
    off = [np.where(np.isfinite(found), np.abs(found - frequency), np.inf) for frequency in frequencies]
    picked = [shapes[np.unravel_index(int(np.argmin(each)), each.shape)] for each in off]
    return [np.real(each / each[np.argmax(np.abs(each))]) for each in picked]


def _mode(group: Array, shape: dict[str, float], model: Array) -> dict[str, Any]:
    """Return the mode of stable poles. `shape` has amplitudes in each sensor's standard deviations, relative to the largest."""
    line_damping = 0.002  # damping ratio below which it is a pump's line
    frequency, damping, frequency_sigma, damping_sigma = np.median(group, axis=0).tolist()
    mode = nearest_mode(frequency, model.tolist())
    return {
        "frequency_Hz": frequency,
        "frequency_sigma_Hz": frequency_sigma,
        "damping_ratio": damping,
        "damping_ratio_sigma": damping_sigma,
        "orders": len(group),  # model orders at which its pole is stable
        "is_line_of_a_load": damping < line_damping,
        "model_Hz": None if mode is None else float(model[mode]),
        "shape": shape,
    }
