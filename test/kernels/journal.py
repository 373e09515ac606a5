"""The model's law of a pin, run as Python for one journal."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np

from boom_twin.kernels.elements import pin_contact as contact

STEEL = 2.0 * (1.0 - 0.3**2) / 2.06e11  # s_i + s_j of two bodies of steel, 1/Pa


def row(law="lankarani-nikravesh", restitution=0.9, gap=1e-4, radius=0.030, softness=STEEL, exponent=1.5, friction=0.0):
    """A row of CLEARANCE for `bearing` run as Python."""
    return SimpleNamespace(
        gap=gap, radius=radius, stiffness=contact.contact_stiffness(radius, gap, softness), exponent=exponent,
        loss=contact.LAWS[law](restitution), friction=friction,
    )  # fmt: skip


def memory(entry=None, force=0.0):
    """What a pin remembers in contact that began at `entry` (m/s), or in flight."""
    kept = np.zeros(contact.COLUMNS)
    kept[contact.FORCE] = force
    if entry is not None:
        kept[contact.CLOSED], kept[contact.APPROACH] = 1.0, max(entry, contact.SLOWEST)
    return kept


def bearing(row, kept, x, y, vx, vy, turning=0.0, rate=0.0, axis=(1.0, 0.0)):
    """`contact.bearing` with the velocity at the start of the step equal to that at its end."""
    return contact.pin_force(row, kept, contact.Journal(x, y, vx, vy, vx, vy, turning, *axis), rate)
