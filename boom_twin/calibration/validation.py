"""Validate a calibration on the sessions held out: the twin's residuals before and after."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from ..config.settings import Settings
from ..errors import BagError
from ..scene.schema import Scene
from ..twin.driver import drive
from ..twin.twin import Twin
from ..types import NANO, Array, Mount, Residuals, Stream
from .forward_model import CalibrationProblem
from .least_squares import Fit
from .sessions import MeasuredSession
from .unknown_load import with_load


@dataclass(frozen=True)
class HeldOutResult:
    """Residuals of k samples in c channels, NaN where not measured.

    Attributes
    ----------
    names : tuple of str
    times : ndarray, shape (k,)
        s after the first of them.
    values, sigmas : ndarray, shape (k, c)
        In the unit of the sensor, and expected.
    discounted : dict of str to float
        Root mean square by channel once noise and an unknown load are discounted; empty if none was taken into account.
    """

    names: tuple[str, ...]
    times: Array
    values: Array
    sigmas: Array
    discounted: Mapping[str, float] = field(default_factory=dict)

    @property
    def spread(self) -> Array:
        """Root mean square of the normalised residuals of every channel, shape (c,); 1 where all is as expected."""
        if self.discounted:
            return np.array([self.discounted.get(name, np.nan) for name in self.names])
        return np.array([_rms(column) for column in (self.values / self.sigmas).T])


def judged(
    scene: Scene,
    settings: Settings,
    mounts: Sequence[Mount | None],
    session: MeasuredSession,
    zeros: Mapping[str, float],
    start: int,
) -> HeldOutResult:
    """Run a session through the twin of `scene`, and keep the residuals from stamp `start` on.

    Parameters
    ----------
    zeros : dict of str to float
        What sensors read too much, by channel.

    Raises
    ------
    BagError
        The twin predicts nothing there.
    """
    twin = Twin(scene, settings, mounts)
    found: dict[Stream, list[Residuals]] = {stream: [] for stream in Stream}
    for step in drive(twin, session.samples(zeros)):
        for residuals in (each for report in step.report.all for each in report.residuals):
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


def discounted(problem: CalibrationProblem, fit: Fit, trials: Sequence[Array], start: int) -> list[dict[str, float]]:
    """White residuals of the one session of `problem` from stamp `start` on, with the noise and the load of a fit.

    Returns
    -------
    list of dict of str to float
        Root mean square by channel, for every trial of the unknowns' deviations.
    """
    whitenings, _ = with_load(problem, fit.deviations, fit.whitening, fit.level)
    ((course, blocks),) = problem.parts
    late = blocks.times[len(fit.whitening.past) :] >= (start - course.start) * NANO
    found = []
    for deviations in trials:
        white = problem.moving(deviations, whitenings)[0].reshape(len(late), -1)[late]
        found.append(dict(zip(problem.channels, map(_rms, np.where(white == 0.0, np.nan, white).T), strict=True)))
    return found


def _rms(values: Array) -> float:
    known = values[np.isfinite(values)]
    return float(np.sqrt(np.mean(known**2))) if len(known) else float("nan")
