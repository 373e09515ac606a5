"""Validate a calibration on the sessions held out: the twin's residuals before and after."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ..errors import BagError
from ..scene.schema import Scene
from ..twin.twin import Twin
from ..types import NANO, Array, Residuals, Stream
from .rest_periods import Rigging
from .sessions import MeasuredSession


@dataclass(frozen=True)
class HeldOutResult:
    """Residuals of k samples in c channels, NaN where not measured."""

    names: tuple[str, ...]
    times: Array  # (k,), s after the first of them
    values: Array  # (k, c), in the unit of the sensor
    sigmas: Array  # (k, c), expected

    @property
    def spread(self) -> Array:
        """Root mean square of the normalised residuals of every channel, shape (c,); 1 if they are as expected."""
        return np.array([_rms(column) for column in (self.values / self.sigmas).T])


def judged(
    scene: Scene,
    rigging: Rigging,
    session: MeasuredSession,
    zeros: Mapping[str, float],
    start: int,
) -> HeldOutResult:
    """Run a session, less the sensors' `zeros`, through the twin of `scene`; keep the residuals from stamp `start` on.

    BagError if the twin predicts nothing there.
    """
    twin = Twin(scene, rigging.settings, rigging.mounts, reads=rigging.reads, places=rigging.places)
    found: dict[Stream, list[Residuals]] = {stream: [] for stream in Stream}
    for sample in session.samples(zeros):
        for residuals in (each for report in twin.update(sample).all for each in report.residuals):
            if residuals.stamp >= start:
                found[residuals.stream].append(residuals)
    every = [residuals for group in found.values() for residuals in group]
    if not every:
        raise BagError(f"{session.name}: the twin predicts nothing in the part held out. Are the strokes within the travel?")
    first = min(residuals.stamp for residuals in every)
    names = tuple(name for group in found.values() if group for name in group[0].names)
    times = np.array([(residuals.stamp - first) * NANO for residuals in every])
    values, sigmas = np.full((2, len(every), len(names)), np.nan)
    for row, residuals in enumerate(every):
        at = names.index(residuals.names[0])
        values[row, at : at + len(residuals.names)] = residuals.values
        sigmas[row, at : at + len(residuals.names)] = residuals.sigmas
    return HeldOutResult(names, times, values, sigmas)


def _rms(values: Array) -> float:
    known = values[np.isfinite(values)]
    return float(np.sqrt(np.mean(known**2))) if len(known) else float("nan")
