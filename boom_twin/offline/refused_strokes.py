"""Tell which stroke of a session could not be used first, and which unit it is likely in."""

from __future__ import annotations

import numpy as np

from ..scene.load import DEFAULT_NAME
from ..scene.schema import Scene
from ..twin.blocks import CODES, SampleBlock
from ..types import SENSORS, Array, Stream, channels_of

NEAR = 5.0  # times the travel: within that a stroke is rather one of another boom than in another unit


class RefusedStrokes:
    """Looks for the first sample of strokes with a value outside the travel of its cylinder.

    Parameters
    ----------
    scene : Scene
    source : str
        Where that is from.
    """

    def __init__(self, scene: Scene, source: str = "") -> None:
        self._is_default = source == DEFAULT_NAME
        self._names = channels_of(len(scene.joints))[Stream.STROKES]
        self._travel = np.array([joint.cylinder.max_stroke for joint in scene.joints])
        self._first: Array | None = None

    def take(self, block: SampleBlock) -> None:
        """Look at samples."""
        if self._first is not None:
            return
        strokes = block.values[block.streams == CODES[Stream.STROKES], : len(self._names)]
        outside = np.flatnonzero(((strokes < 0.0) | (strokes > self._travel)).any(axis=1))
        if len(outside):
            self._first = strokes[outside[0]]

    @property
    def told(self) -> str:
        """A sentence with the value, its bound and the likely unit; empty if there was none."""
        if self._first is None:
            return ""
        i = int(np.flatnonzero((self._first < 0.0) | (self._first > self._travel))[0])
        said = f" The first refused value: {self._names[i]} = {self._first[i]:.6g} m, its travel is 0 to {self._travel[i]:g} m."
        if self._fits_in_other_order():
            return f"{said} In another order the strokes would fit: look for cylinders whose names or columns are swapped."
        if self._is_default and self._first[i] < NEAR * self._travel[i]:
            return f"{said} The session names no scene and was read with the {DEFAULT_NAME}: for another boom give --scene."
        unit = next((unit for unit, factor in self._by_size() if self._fits(factor)), None)
        if unit is None:
            return said
        remedy = f"give by --mapping `sensors: {{{self._names[i]}: {{unit: {unit}}}}}`, .."
        return f"{said} With the unit `{unit}` it would fit: {remedy}"

    def _fits_in_other_order(self) -> bool:
        """Whether every stroke is within the travel of a cylinder of its own, if not of the one that it is named after."""
        assert self._first is not None
        known = np.isfinite(self._first)
        return bool(known.all() and self._first.min() >= 0.0 and (np.sort(self._first) <= np.sort(self._travel)).all())

    @staticmethod
    def _by_size() -> list[tuple[str, float]]:
        """Units of strokes below 1 m, the largest first."""
        units = SENSORS[Stream.STROKES].units.items()
        return sorted(((unit, factor) for unit, factor in units if factor < 1.0), key=lambda pair: -pair[1])

    def _fits(self, factor: float) -> bool:
        assert self._first is not None
        known = np.isfinite(self._first)
        return bool(((self._first >= 0.0) & (factor * self._first <= self._travel))[known].all())
