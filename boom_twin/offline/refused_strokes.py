"""Report the first stroke, or angle that drives the model, that could not be used in a session, and its likely unit."""

from __future__ import annotations

import numpy as np

from ..scene.load import DEFAULT_NAME
from ..scene.schema import Scene
from ..twin.blocks import CODES, SampleBlock
from ..types import GIVE, SENSORS, Array, Stream, StrokeReading, channels_of

OTHER_BOOM = 5.0  # times the travel: within that a stroke is rather one of another boom than in another unit


class RefusedStrokes:
    """Finder of the first sample of what drives the model with a value outside a cylinder's travel or a joint's range.

    Parameters
    ----------
    scene : Scene
    source : str
        Where that is from.
    reads : StrokeReading
        What drives the model.
    """

    def __init__(self, scene: Scene, source: str = "", reads: StrokeReading = StrokeReading.LENGTH) -> None:
        self._reads = reads
        self._is_default = source == DEFAULT_NAME
        self._names = channels_of(len(scene.joints))[reads.stream]
        self._closed = np.array([joint.cylinder.closed_length for joint in scene.joints])
        self._travel = np.array([joint.cylinder.max_stroke for joint in scene.joints])
        self._lowest = np.zeros(len(scene.joints))
        if reads is StrokeReading.ANGLE:
            low, high = np.radians([joint.range_deg for joint in scene.joints]).T
            self._lowest, self._travel = low - GIVE, high + GIVE
        self._first: Array | None = None
        self._is_read = np.zeros(len(scene.joints), bool)

    def take(self, block: SampleBlock) -> None:
        """Look at samples."""
        strokes = block.values[block.streams == CODES[self._reads.stream], : len(self._names)]
        self._is_read |= np.isfinite(strokes).any(axis=0)
        if self._first is not None:
            return
        outside = np.flatnonzero(((strokes < self._lowest) | (strokes > self._travel)).any(axis=1))
        if len(outside):
            self._first = strokes[outside[0]]

    @property
    def never_read(self) -> str:
        """Clause on the cylinders that never had a value, if others had; else empty."""
        silent = [name for name, is_read in zip(self._names, self._is_read, strict=True) if not is_read]
        return f", because {', '.join(silent)} never had a value" if silent and self._is_read.any() else ""

    @property
    def told(self) -> str:
        """Sentence with the value, its bound and the likely unit; empty if there was none."""
        if self._first is None:
            return ""
        i = int(np.flatnonzero((self._first < self._lowest) | (self._first > self._travel))[0])
        if self._reads is StrokeReading.ANGLE:
            low, high = np.degrees([self._lowest[i], self._travel[i]])
            value, bounds = f"{self._names[i]} = {self._first[i]:.6g} rad", f"{low:.4g} to {high:.4g} deg"
            said = f" The first refused value: {value}, its sensor can read {bounds}."
            if not low <= self._first[i] <= high:
                return said
            return f"{said} In degrees it would fit: give by --mapping `sensors: {{{self._names[i]}: {{unit: deg}}}}`, .."
        said = f" The first refused value: {self._names[i]} = {self._first[i]:.6g} m, its travel is 0 to {self._travel[i]:g} m."
        if self._fits(1.0, self._closed):
            return f"{said} {self._remedy(1.0, 'm', self._closed)}"
        if self._fits_in_other_order():
            return f"{said} In another order the strokes would fit: look for cylinders whose names or columns are swapped."
        if self._is_default and self._first[i] < OTHER_BOOM * self._travel[i]:
            return f"{said} The session names no scene and was read with the {DEFAULT_NAME}: for another boom give --scene."
        units = sorted(SENSORS[Stream.STROKES].units.items(), key=lambda pair: -pair[1])[1:]
        fits = ((factor, unit, closed) for closed in (0.0, self._closed) for unit, factor in units[:-1])
        for factor, unit, closed in (*fits, (units[-1][1], units[-1][0], 0.0)):
            if self._fits(factor, closed):
                return f"{said} {self._remedy(factor, unit, closed)}"
        return said

    def _remedy(self, factor: float, unit: str, closed: Array | float) -> str:
        """Return the quantity that the values fit as, and the mapping by which they do."""
        if np.ndim(closed):
            zeros = zip(self._names, np.asarray(closed) / factor, strict=True)
            sensors = ", ".join(f"{name}: {{unit: {unit}, zero: {zero:g}}}" for name, zero in zeros)
            return f"They fit as lengths from pin to pin: take closed_length off, by --mapping `sensors: {{{sensors}}}`."
        return f"With the unit `{unit}` it would fit: give by --mapping `sensors: {{{self._names[0]}: {{unit: {unit}}}}}`, .."

    def _fits_in_other_order(self) -> bool:
        """Return True if the strokes fit the cylinders' travels in some other order."""
        assert self._first is not None
        known = np.isfinite(self._first)
        return bool(known.all() and self._first.min() >= 0.0 and (np.sort(self._first) <= np.sort(self._travel)).all())

    def _fits(self, factor: float, closed: Array | float = 0.0) -> bool:
        """Return True if the values times `factor`, less the lengths `closed` (m), are within the travel."""
        assert self._first is not None
        strokes, known = factor * self._first - closed, np.isfinite(self._first)
        return bool(((strokes >= 0.0) & (strokes <= self._travel))[known].all())
