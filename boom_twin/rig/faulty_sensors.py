"""Sensor faults: what they make of the readings of a session.

They act on readings that are rounded already, as a fault behind the sensor does.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..records import Array
from .faults import Fault
from .sensors import NANO
from .session import Session

SPIKE_SHARE = 0.02  # of the readings


def spoil(session: Session, faults: Sequence[Fault], seed: int) -> Session:
    """The session with the sensor faults among `faults`; readings before an onset stay, bit for bit, and so does the truth.

    Parameters
    ----------
    seed : int
        Of spikes and dropouts; each fault draws from a stream of its own.
    """
    sensed = [fault for fault in faults if not fault.is_physical]
    for fault, rng in zip(sensed, np.random.default_rng([seed, 1]).spawn(len(sensed)), strict=True):
        session = _with_one(session, fault, rng)
    return session


def _with_one(session: Session, fault: Fault, rng: np.random.Generator) -> Session:
    after = session.truth["t"] >= fault.onset
    if fault.kind == "late":
        late = np.where(after, round(fault.size * NANO), 0)
        return replace(session, angle_stamps=session.angle_stamps + late)
    name = "joints" if fault.cause.startswith("joint") else "strokes"
    values: Array = getattr(session, name).copy()
    if fault.kind == "missing":
        values[after & (rng.random(len(after)) < fault.size)] = np.nan
    else:
        column = fault.number - 1
        true = session.truth[name][:, column]
        values[after, column] = _spoiled(fault, session.truth["t"], values[:, column], true, after, rng)[after]
    return replace(session, joints=values) if name == "joints" else replace(session, strokes=values)


def _spoiled(
    fault: Fault, times: Array, read: Array, true: Array, after: NDArray[np.bool_], rng: np.random.Generator
) -> Array:
    """Readings (m,) of the one sensor as if the fault had always been there; those before the onset are not used."""
    match fault.kind:
        case "bias":
            return read + fault.size
        case "drift":
            return read + fault.size * (times - fault.onset)
        case "scale":
            return read * (1.0 + fault.size)
        case "stuck":
            last = max(0, int(np.argmax(after)) - 1)
            return np.full_like(read, read[last])
        case "noisy":
            return true + fault.size * (read - true)
        case "spikes":
            hit = rng.random(len(read)) < SPIKE_SHARE
            return np.asarray(read + fault.size * hit * rng.choice([-1.0, 1.0], len(read)))
        case _:  # dropout
            return np.where(rng.random(len(read)) < fault.size, np.nan, read)
