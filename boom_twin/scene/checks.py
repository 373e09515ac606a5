"""All checks of what single values cannot show, as a table."""

from __future__ import annotations

from collections.abc import Callable, Iterator

from . import clearance, consistency, placement, reach, units
from .draft import Draft
from .finding import Finding

CHECKS: tuple[Callable[[Draft], Iterator[Finding]], ...] = (
    consistency.counts,
    consistency.sections,
    consistency.modes,
    consistency.joints,
    placement.pins,
    placement.thin_parts,
    placement.centres,
    clearance.pins,
    reach.joints,
    units.suspects,
)
