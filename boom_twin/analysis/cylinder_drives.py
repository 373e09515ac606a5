"""Drives of cylinders from their lengths and forces: what the oil gives in is taken off again."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ..compiler.plan import Plan
from ..errors import SolverError
from ..kernels.elements.cylinder import compliance_and_lag
from ..kernels.jit import kernel
from ..system.summary_display import numbers
from ..types import Array, StrokeReading

CLOSE = 1e-13  # m, change of a drive in the last pass
PASSES = 60


def spring_free(plan: Plan, lengths: Array, forces: Array) -> Array:
    """Return the drives (m), shape (n,), of cylinders that are `lengths` (m) long at rest under `forces` (N)."""
    drives = drives_as_read(plan, lengths, forces, StrokeReading.LENGTH)
    if np.isfinite(drives).all():
        return drives
    raise SolverError(f"no drives for cylinder forces of {numbers(forces)} N: the oil gives too much. Check bulk_modulus.")


def drives_as_read(plan: Plan, strokes: Array, forces: Array, reads: StrokeReading) -> Array:
    """Return the drives (m) where transducers read `strokes` (m) under `forces` (N), all (.., n); NaN if there are none.

    At work lengths swing with the forces in the oil. Drives show how the boom is driven, and in which posture it would rest.
    The oil's damping is left out: its lag is some milliseconds.
    """
    drives = np.array(strokes)
    if reads is not StrokeReading.DRIVE:
        write_drives(
            plan.tables.cylinders, plan.tables.oils, np.ascontiguousarray(np.atleast_2d(forces)), np.atleast_2d(drives)
        )
    return drives


@kernel
def write_drives(cylinders: Any, oils: Any, forces: Array, lengths: Array) -> None:
    """Turn lengths (m) of cylinders under `forces` (N), both (k, n), into their drives; NaN if there are none.

    The compliance of `oil` is that at the drive. A pass leaves the share of the error that the oil's pressure is of its bulk
    modulus, a few percent.
    """
    for i in range(cylinders.shape[0]):
        closed = cylinders[i].closed_length
        for row in range(lengths.shape[0]):
            drive, change, passes = lengths[row, i], 1.0, 0
            while abs(change) >= CLOSE and passes < PASSES:
                change = lengths[row, i] - compliance_and_lag(cylinders[i], oils, closed + drive)[0] * forces[row, i] - drive
                drive, passes = drive + change, passes + 1
            lengths[row, i] = drive if abs(change) < CLOSE else math.nan


def drives_of(plan: Plan, times: Array, lengths: Array, forces: Array) -> Array:
    """Return the drives (m), shape (m, n), of cylinders with these lengths (m) and forces (N) at `times` (s), at rest at first.

    The extension x of an oil spring follows d x' + k x = F. The solution is exact for forces that are linear from row to row.
    """
    drives = [spring_free(plan, lengths[0], forces[0])]
    for span, now, before, after in zip(np.diff(times), lengths[1:], forces, forces[1:], strict=False):
        extension = lengths[len(drives) - 1] - drives[-1]
        compliance, lag = plan.compliances_and_lags(plan.closed_lengths + now - extension)
        with np.errstate(divide="ignore"):
            kept = np.exp(-span / lag)
        start, end = compliance * before, compliance * after
        lead = (end - start) / span * lag
        drives.append(now - (end - lead + (extension - start + lead) * kept))
    return np.array(drives)
