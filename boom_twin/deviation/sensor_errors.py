"""Errors of sensors as the filters of a boom estimate them: zeros, lags, drifts of clocks."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping

import numpy as np

from ..predictions import Clock
from ..types import SENSORS, Array, Stream
from .channels import DRIFT_FIRST, LAG_FIRST, READS_FORCE
from .posture import Posture
from .states import ESTIMATE, FED, Filters, zero_place

DOUBTED_DRIFT = 1000.0  # times the usual variance of the drift of a zero, of a sensor in doubt
LAG_FLOOR = 2e-3  # s, error of an estimated lag by errors of the model: measured on sessions of the virtual rig


class SensorErrors:
    """Errors of the sensors of a boom, by the names of their channels; `channels` are those of every stream."""

    def __init__(self, posture: Posture, filters: Filters, channels: Mapping[Stream, tuple[str, ...]]) -> None:
        self._posture, self._filters = posture, filters
        names = [name for stream, names in channels.items() if stream is not Stream.STROKES for name in names]
        self._zeros = {name: int(row.zero) for name, row in zip(names, posture.channels, strict=True)}

    def _places(self, channels: Collection[str]) -> list[int]:
        """Return the places of the zeros of these sensors among those of all."""
        return sorted(zero for name, zero in self._zeros.items() if name in channels)

    def doubt(self, channels: Collection[str]) -> None:
        """Allow a large drift of the zeros of these sensors alone: angles, forces, axes of the IMU."""
        self._filters.drift[:] = 1.0
        self._filters.drift[self._places(channels)] = DOUBTED_DRIFT

    def zeros(self, channels: Collection[str]) -> tuple[Array, Array, Array]:
        """Return the estimated zeros of these sensors, in their units, their variances, and deviations by errors of the scene.

        They are in the order of the states. The variances are at given mount and scale of the tip IMU, which do not change.
        Errors of the scene look like a zero of a force: as a share of the force, which is the same at all times.
        """
        f, first, places = self._filters, zero_place(self._posture), self._places(channels)
        covariance, at, fixed = f.spread[ESTIMATE], first + np.array(places), first + np.array([2, 3])
        shared = covariance[np.ix_(at, fixed)]
        variances = covariance[at, at] - (shared @ np.linalg.pinv(covariance[np.ix_(fixed, fixed)]) * shared).sum(axis=1)
        errors = np.zeros(len(places))
        for row in self._posture.channels:
            if row.kind == READS_FORCE and row.zero in places:
                errors[places.index(row.zero)] = f.noise.scene_error * f.pulls[row.index]
        return f.mean[ESTIMATE, at], variances, errors

    @property
    def clocks(self) -> dict[Stream, Clock]:
        """Lags and drifts of the lagging streams, as estimated."""
        f, p, found, streams = self._filters, self._posture, dict[Stream, Clock](), tuple(Stream)
        for row in p.channels[p.channels.lag >= 0]:
            lag, is_there = zero_place(p) + int(row.lag), p.behind[0] > row.lag and f.status[FED] == 1
            sigmas = np.sqrt(f.spread[ESTIMATE].diagonal()[lag : lag + 2]) if is_there else (LAG_FIRST, DRIFT_FIRST)
            numbers = (
                f.lags[row.stream] + f.mean[ESTIMATE, lag],
                math.hypot(sigmas[0], LAG_FLOOR),
                f.mean[ESTIMATE, lag + 1],
                sigmas[1],
            )
            found.setdefault(streams[row.stream], Clock(*map(float, numbers)))
        return {stream: clock for stream, clock in found.items() if not SENSORS[stream].beside}
