"""What play in a cylinder's rod pin does to the resting tip, in closed form: lever x (clearance + penetration)."""

from __future__ import annotations

import numpy as np
from reference.worn_pin.geometry import levers, pins


def lengthening(contact, force, axis):
    """How much longer (m) a cylinder along `axis` (complex, from the barrel pin) acts than one with an ideal pin.

    `force` (N, complex) is the bush's on the rod's pin: along the axis in a pulled cylinder, which acts longer; against it
    in a pushed one, which acts shorter. Across the axis the pin carries the cylinder's own weight alone.
    """
    return -(contact.resting_offset(-force) * np.conj(axis)).real / abs(axis)


def tip_shift(document, headings, index, contact, force):
    """Complex, m: the resting tip with play in cylinder `index` (0-based) minus the one with an ideal pin.

    `headings` (rad) of the sections at rest with an ideal pin, sag included; there the bush pushes the pin with `force` (N).
    """
    barrel, rod = pins(document, headings, index)
    return levers(document, headings)[index] * lengthening(contact, force, rod - barrel)
