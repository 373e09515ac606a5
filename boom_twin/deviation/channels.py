"""Table of measured channels: what each reads, where on the boom, with which noise, and which states are its errors."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.polynomial import legendre

from ..compiler.plan import Plan
from ..config.settings import Settings
from ..errors import UsageError
from ..kernels.elements.beam_shapes import integrals_to, rotations_at
from ..kernels.jit import inner, kernel
from ..kernels.tables import BEAM, FRAME_ANGLE, OFFSET
from ..types import SENSORS, Array, Place, Stream, channels_of, streams_of
from .delayed import begin_instant, copy_reading
from .rows import (
    SHAKEN_TIME,
    SWAY_SHARE,
    acceleration_row,
    add_sway,
    clear,
    column_row,
    force_row,
    rate_row,
    site_column,
    standing_variance,
    variance_of,
)
from .sensor_model import Mounting, section_frames
from .states import PREDICTION, all_states, zero_place

READS_ANGLE, READS_FORCE, READS_ACCELERATION, READS_RATE, READS_MOMENT, READS_COORDINATE, READS_NOTHING = range(7)
TIP_IMU_STATES, IMU_STATES = 4, 4  # zeros of two axes, mount, scale
IMU_ZERO, IMU_DRIFT = 0.3, 3e-3  # m/s^2; m/s^2 in a root second
IMU_TURN, IMU_SCALE = 0.1, 0.1  # rad, by which it may be mounted askew; share by which it may read too much
RATE_ZERO, RATE_DRIFT = 0.02, 1e-4  # rad/s; rad/s in a root second
POINT_ZERO, POINT_DRIFT = 1e-3, 1e-5  # m; m in a root second: of a prism, and of the model's statics
LAG_FIRST, LAG_WALK = 0.03, 3e-5  # s; s in a root second: of a driver whose load changes
DRIFT_FIRST, DRIFT_WALK = 5e-5, 1e-7  # of a quartz clock; in a root second, by its temperature
SAME_PLACE = 1e-9  # m

CHANNEL = np.dtype(
    [
        ("stream", np.int64),  # its place in `Stream`
        ("kind", np.int64),
        ("index", np.int64),  # joint, cylinder, axis, or station of `Measurement.bending`
        ("site", np.int64),  # row of `SITE`
        ("turned", float),  # of the sensor's x axis to the section, rad
        ("zero", np.int64),  # place of its zero among the states behind those of the prediction
        ("last", np.int64),  # place there of the last state that its reading depends on: an IMU's scale, behind its mount
        ("noise2", float),  # variance of its noise
        ("lag", np.int64),  # place there of the lag of its stream, behind which stands its drift; -1 without
    ]
)

SITE = np.dtype(
    [
        ("section", np.int64),
        ("frame", np.int64),  # row of `State.frames`
        ("beam", np.int64),  # row of the beam that begins in this frame; -1 on a rigid part
        ("x", float),  # distance from the frame on a rigid part, m
    ]
)

ERROR = np.dtype(
    [
        ("first", float),  # standard deviation at first
        ("walk", float),  # standard deviation of the walk in a root second
        ("drifts", np.bool_),  # its rate is the state behind
    ]
)


class Measurement(NamedTuple):
    """Measured channels of a boom, and their places.

    Attributes
    ----------
    channels, sites : recarray
        Rows of `CHANNEL` and of `SITE`; the tip is the first site.
    errors : recarray
        Rows of `ERROR`: states behind the zeros, mount and scale of the tip IMU, and the zeros of angles and forces. Uncertain
        zeros of strokes are the first.
    psi : ndarray, shape (sites, shapes)
        Rotation of a beam at the site by its bending coordinates.
    weights : ndarray, shape (sites, points)
        See `boom_twin.kernels.elements.beam_shapes.integrals_to`, m.
    bending : ndarray, shape (stations, unknowns)
        Bending moments that strain gauges read by the unknowns, N m.
    stroke_zero : int
        Place of the first zero of a stroke among the states behind those of the prediction; 0 if strokes have none.
    """

    channels: np.recarray
    sites: np.recarray
    errors: np.recarray
    psi: Array
    weights: Array
    bending: Array
    stroke_zero: int


@kernel
def measurement_row(p, f, c, row):
    """Write the row of the measured channel `c`, without its zero, at the prediction.

    Return the error of an inclinometer by its acceleration, rad; 0 for others.
    """
    channel = p.channels[c]
    if channel.kind == READS_ANGLE:
        column_row(p, p.readings, channel.index, 1.0, row)
        return add_sway(p, f, channel.index, f.mean[PREDICTION], row)
    if channel.kind == READS_FORCE:
        force_row(p, channel.index, row)
    elif channel.kind == READS_MOMENT:
        column_row(p, p.moments, channel.index, 1.0, row)
    elif channel.kind == READS_COORDINATE:
        column_row(p, p.readings, site_column(p, channel.site) + channel.index, 1.0, row)
    elif channel.kind == READS_NOTHING:
        clear(row, all_states(p))
    elif channel.kind == READS_RATE:
        rate_row(p, site_column(p, channel.site) + 2, row)
    else:
        specific_force_row(p, f, c, row)
    return 0.0


@inner
def specific_force_row(p, f, c, row):
    """Write the row of channel `c`, an axis of an accelerometer, with the mount and the scale of its IMU."""
    channel = p.channels[c]
    at, axis = site_column(p, channel.site), channel.index
    angle = f.motion[channel.site, 2] + channel.turned
    cosine, sine = math.cos(angle), math.sin(angle)
    acceleration_row(p, at, f.rows[0])
    acceleration_row(p, at + 1, f.rows[1])
    turn = f.felt[c + 1] if axis == 0 else -f.felt[c - 1]
    column_row(p, p.readings, at + 2, turn, row)
    along, across = (cosine, sine) if axis == 0 else (-sine, cosine)
    zero = zero_place(p)
    for k in range(zero):
        row[k] += along * f.rows[0, k] + across * f.rows[1, k]
    row[zero + channel.last - 1], row[zero + channel.last] = turn, f.felt[c]


@inner
def write_expected_readings(p, f, live, results, stamp, h, values, sigmas):
    """Write the expected readings of all sensors for the newest prediction, and the residuals' standard deviations.

    Parameters
    ----------
    results : Results
        Of the prediction.
    stamp : int
        ns.
    h : float
        Time since the prediction before, s.
    values, sigmas : ndarray, shape (measured channels,)
        In the order of the channels: rad, m/s^2, N, rad/s, N m, m.
    """
    size, copies = zero_place(p), begin_instant(p, f, stamp)
    for c in range(p.channels.shape[0]):
        channel, noise2, sway = p.channels[c], p.channels[c].noise2, measurement_row(p, f, c, f.row)
        if channel.kind == READS_ANGLE:
            i = channel.index
            values[c] = live.frames[p.frames[i], FRAME_ANGLE] + p.tilt[i] + sway if p.absolute[i] else results.joints[i]
            f.sway2[i] = max(f.sway2[i] * max(1.0 - h / SHAKEN_TIME, 0.0), sway * sway)
            noise2 += SWAY_SHARE * SWAY_SHARE * f.sway2[i]
        elif channel.kind == READS_FORCE:
            values[c] = results.cylinder_forces[channel.index]
        elif channel.kind == READS_MOMENT:
            values[c] = 0.0
            for k in range(live.z.shape[0]):
                values[c] += p.bending[channel.index, k] * live.z[k]
        elif channel.kind == READS_COORDINATE:
            values[c] = f.motion[channel.site, channel.index]
        elif channel.kind == READS_NOTHING:
            values[c] = math.nan
        elif channel.kind == READS_RATE:
            values[c] = f.motion[channel.site, 5]
        else:
            values[c] = f.felt[c]
        variance = variance_of(f.row, f.spread[PREDICTION], f.gain, size) + standing_variance(p, f, f.row)
        sigmas[c] = math.sqrt(noise2 + variance)
        note_curve(f.curves[c], values[c], h)
        if copies >= 0 and f.copies[c] >= 0:
            f.row[size + channel.zero] = 1.0
            copy_reading(p, f, copies + f.copies[c], 0.0 if channel.kind == READS_NOTHING else values[c])


@inner
def note_curve(curve, value, h):
    """Take an expected reading, `h` s after the one before, into the mean square of its second derivative."""
    rate, mean = 0.0, 0.0
    if h > 0.0:
        rate, mean = (value - curve[0]) / h, curve[2]
        mean += min(h / SHAKEN_TIME, 1.0) * (((rate - curve[1]) / h) ** 2 - mean)
    curve[0], curve[1], curve[2] = value, rate, mean


def measurement_of(
    plan: Plan,
    settings: Settings,
    mounting: Mounting,
    places: Mapping[str, Place],
    lagging: Collection[Stream] = (),
    zero_sigma: float = 0.0,
) -> Measurement:
    """Return the measured channels of a boom whose angle sensors have this mounting and others these places, by their names.

    The lag and the drift of `lagging` streams are states. So are the zeros of strokes if `zero_sigma`, their standard deviation
    (m), is above 0.

    Raises
    ------
    UsageError
        A place is not on the boom.
    """
    sites, rows, errors = _Sites(plan), list[tuple[float, ...]](), list[tuple[float, float, bool]]()
    bending = list[Array]()
    n, codes = plan.joints, {stream: code for code, stream in enumerate(Stream)}
    stroke_zero = TIP_IMU_STATES + 2 * n if zero_sigma > 0.0 else 0
    errors += [(zero_sigma, 0.0, False)] * n * (zero_sigma > 0.0)

    def add(stream: Stream, reads: int, index: int, site: int = 0, turned: float = 0.0, zero: int = 0, behind: int = 0) -> None:
        """Add a channel whose reading depends on its zero, and on as many states up to `behind` places further."""
        rows.append((codes[stream], reads, index, site, turned, zero, zero + behind, settings.variance(SENSORS[stream])))

    for stream, names in channels_of(n, streams_of(places)).items():
        kind, new = SENSORS[stream], TIP_IMU_STATES + 2 * n + len(errors)
        place = places.get(kind.stem, Place())
        if stream is Stream.ANGLES:
            for i in range(n):
                site = sites.fixed(i, int(mounting.frames[i])) if mounting.sways[i] else 0
                add(stream, READS_ANGLE, i, site, zero=TIP_IMU_STATES + i)
        elif stream is Stream.FORCES:
            for i in range(n):
                add(stream, READS_FORCE, i, zero=TIP_IMU_STATES + n + i)
        elif names and kind.is_accelerometer:
            first, site = 0 if stream is Stream.IMU else new, sites.of(place, kind.stem)
            for i in range(len(names)):
                add(stream, READS_ACCELERATION, i, site, place.turned, first + i, IMU_STATES - 1 - i)
            if stream is not Stream.IMU:
                errors += [(IMU_ZERO, IMU_DRIFT, False)] * 2 + [(IMU_TURN, 0.0, False), (IMU_SCALE, 0.0, False)]
        elif names and kind.field == "angular_velocity":
            add(stream, READS_RATE, 0, sites.of(place, kind.stem), place.turned, new)
            errors.append((RATE_ZERO, RATE_DRIFT, False))
        elif names and kind.field == "point":
            for i in range(len(names)):
                add(stream, READS_COORDINATE, i, sites.of(place, kind.stem), zero=new + i)
            errors += [(POINT_ZERO, POINT_DRIFT, False)] * len(names)
        elif stream is Stream.MOMENTS:
            for section, name in enumerate(names, start=1):
                if name not in places:
                    add(stream, READS_NOTHING, 0)
                    continue
                place = places[name]
                add(stream, READS_MOMENT, len(bending), zero=TIP_IMU_STATES + 2 * n + len(errors))
                bending.append(sites.bending(replace(place, section=place.section or section), name))
                errors.append((np.inf, 0.0, False))  # by the moment that is there, see `BoomPredictor.start`
    lags = dict[Stream, int]()
    for stream in lagging:
        lags[stream] = TIP_IMU_STATES + 2 * n + len(errors)
        errors += [(LAG_FIRST, LAG_WALK, True), (DRIFT_FIRST, DRIFT_WALK, False)]
    lag_of = {code: lags.get(Stream(SENSORS[stream].beside or stream), -1) for stream, code in codes.items()}
    rows = [(*row, lag_of[int(row[0])]) for row in rows]
    stations = np.array(bending).reshape(-1, len(plan.names))
    tables = _table(rows, CHANNEL), _table([row for row, _ in sites.found], SITE), _table(errors, ERROR)
    return Measurement(*tables, *sites.shapes(), stations, stroke_zero)


def _table(rows: Sequence[tuple[float, ...]], kind: np.dtype) -> np.recarray:
    return np.array(rows, kind).view(np.recarray)


_Found = tuple[tuple[int, int, int, float], float]
"""Row of `SITE`, and the share of a beam's length at which it is."""


class _Sites:
    """Collector of the sites of sensors, each once; the tip is the first."""

    def __init__(self, plan: Plan) -> None:
        self._plan = plan
        self._roots, self._heads = (frames.tolist() for frames in section_frames(plan))
        self.found: list[_Found] = [((plan.joints - 1, self._heads[-1], -1, 0.0), 0.0)]

    def of(self, place: Place, name: str) -> int:
        """Return the number of a place on the boom among those found; UsageError if it is not on it."""
        return self._number(self._checked(place, name))

    def fixed(self, section: int, frame: int) -> int:
        """Return the number of a frame of a section (0-based) among the places found."""
        return self._number(((section, frame, -1, 0.0), 0.0))

    def _number(self, found: _Found) -> int:
        if found not in self.found:
            self.found.append(found)
        return self.found.index(found)

    def _checked(self, place: Place, name: str) -> _Found:
        sections = self._plan.joints
        section = sections if place.section is None else place.section
        if not 1 <= section <= sections:
            raise UsageError(f"{name}: section = {section}, the boom has sections 1 to {sections}. Give one of them.")
        return self._looked_up(section - 1, place.at, name)

    def _looked_up(self, section: int, at: float | None, name: str) -> _Found:
        t, start, end = self._plan.tables, 0.0, self._heads[section]
        for frame in range(self._roots[section], end):
            operation = t.operations[frame]
            if operation.kind not in (OFFSET, BEAM):
                continue
            is_beam, row = operation.kind == BEAM, int(operation.row)
            length = float(t.weights[row, int(t.beams[row].points)].sum()) if is_beam else float(t.offsets[row].x)
            if at is not None and -SAME_PLACE <= at - start <= length - SAME_PLACE:
                inside = max(at - start, 0.0)
                return ((section, frame, row, 0.0), inside / length) if is_beam else ((section, frame, -1, inside), 0.0)
            start += length
        if at is not None and abs(at - start) > SAME_PLACE:
            raise UsageError(
                f"{name}: at = {at:g} m, section {section + 1} reaches from 0 to {start:g} m. "
                "Give the distance from its inboard pivot."
            )
        return (section, end, -1, 0.0), 0.0

    def bending(self, place: Place, name: str) -> Array:
        """Return the bending moment (N m) at a place by the unknowns; UsageError where nothing bends."""
        (section, _, beam, _), along = self._checked(place, name)
        if beam < 0:
            raise UsageError(
                f"{name}: section {section + 1} is rigid at {place.at} m, and has no strain there. Give a place on its beam."
            )
        t, found = self._plan.tables, np.zeros(len(self._plan.names))
        row = t.beams[beam]
        n, first = int(row.bending), int(row.z)
        found[first : first + n] = t.stiffness[beam, 0, 0] * legendre.legvander(np.array([2.0 * along - 1.0]), n - 1)[0]
        return found

    def shapes(self) -> tuple[Array, Array]:
        """Return the rotations and integrals of beams at the sites, see `Measurement`."""
        t = self._plan.tables
        psi = np.zeros((len(self.found), t.psi.shape[2]))
        weights = np.zeros((len(self.found), t.weights.shape[2]))
        for site, ((_, _, beam, _), along) in enumerate(self.found):
            if beam >= 0:
                n, points = int(t.beams[beam].bending), int(t.beams[beam].points)
                psi[site, :n] = rotations_at(n, np.array([along]))[0]
                weights[site, :points] = t.weights[beam, points].sum() * integrals_to(points, np.array([along]))[0]
        return psi, weights
