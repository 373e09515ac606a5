"""Read tip, joints and cylinder forces from the Exudyn boom."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from ...types import Array
from . import exudyn, items
from .system import Boom, Site, Station

_FORCE = {"distance": exudyn.OutputVariableType.Force, "referenceLength": exudyn.OutputVariableType.ForceLocal}
"""Exudyn output with the cylinder force, by the name of the connector's length parameter."""


@dataclass(frozen=True, slots=True)
class Probes:
    """Exudyn sensor numbers of all recorded quantities."""

    tip: tuple[int, int]  # position, acceleration
    head: int  # velocity of the last head's node
    roots: tuple[int, ...]
    heads: tuple[int, ...]
    forces: tuple[int, ...]
    lengths: tuple[int, ...]
    moments: tuple[tuple[tuple[int, float], ...], ...]  # of every site: sensors of elements about it, and their shares
    sites: tuple[
        tuple[int, int, int, int], ...
    ]  # position and acceleration of every site, coordinates of its frame, their rates
    base: int | None  # of an elastic base


def attach(boom: Boom) -> Probes:
    """Add all sensors. Call this before the system is assembled."""
    kind = exudyn.OutputVariableType
    return Probes(
        tip=(_at_tip(boom, kind.Position), _at_tip(boom, kind.Acceleration)),
        head=_on_node(boom, boom.sections[-1].head, kind.Coordinates_t),
        roots=tuple(_on_node(boom, section.root, kind.Coordinates) for section in boom.sections),
        heads=tuple(_on_node(boom, section.head, kind.Coordinates) for section in boom.sections),
        forces=tuple(_on_drive(boom, drive, _FORCE[name]) for drive, name in boom.drives),
        lengths=tuple(_on_drive(boom, drive, kind.Distance) for drive, _ in boom.drives),
        moments=tuple(_about_site(boom, site) for site in boom.sites),
        sites=tuple(_at_site(boom, site) for site in boom.sites),
        base=None if boom.base.node is None else _sensor(boom, kind.Coordinates, items.SensorNode, nodeNumber=boom.base.node),
    )


def read(boom: Boom, probes: Probes, at_rest: bool) -> dict[str, Array]:
    """Return all recorded rows (m); if `at_rest`, one row with the present equilibrium. SI.

    Keys: ``t`` (m,); ``tip``, ``tip_acc`` (m, 2); ``tip_angle``, ``tip_rate`` (m,); ``joints``, ``forces``
    (tension), ``lengths`` (m, n; pin to pin less `closed_length`); ``sites`` (m, k, 7): x, y, their accelerations, angle, its
    rate, bending moment by the curvature (NaN off a beam).
    """
    data = partial(_data, boom, at_rest=at_rest)
    roots = np.column_stack([_angle(data(p), s.root) for p, s in zip(probes.roots, boom.sections, strict=True)])
    heads = np.column_stack([_angle(data(p), s.head) for p, s in zip(probes.heads, boom.sections, strict=True)])
    cylinders = [joint.cylinder for joint in boom.scene.joints]
    base = np.zeros(len(heads)) if probes.base is None else data(probes.base)[:, 3]
    before = np.column_stack([base, heads[:, :-1]])
    return {
        "t": data(probes.tip[0])[:, 0],
        "tip": data(probes.tip[0])[:, 1:3],
        "tip_acc": data(probes.tip[1])[:, 1:3],
        "tip_angle": heads[:, -1],
        "tip_rate": data(probes.head)[:, 3],
        "joints": roots - before,
        "forces": np.column_stack([_force(boom, i, p, at_rest) for i, p in enumerate(probes.forces)]),
        "lengths": np.column_stack([data(p)[:, 1] - c.closed_length for p, c in zip(probes.lengths, cylinders, strict=True)]),
        "sites": np.array(
            [
                np.column_stack([_motion(boom, site, *map(data, each)), _moment(boom, site, around, data, len(heads))])
                for site, each, around in zip(boom.sites, probes.sites, probes.moments, strict=True)
            ]
        )
        .reshape(len(boom.sites), len(heads), 7)
        .swapaxes(0, 1),
    }


def _data(boom: Boom, number: int, at_rest: bool) -> Array:
    """Return time (column 0) and sensor values: the recorded rows, or one row of the present state (time 0)."""
    if at_rest:
        return np.hstack([0.0, boom.system.GetSensorValues(number)])[None, :]
    return np.asarray(boom.system.GetSensorStoredData(number), float)


def _angle(data: Array, station: Station) -> Array:
    """Return the absolute angle (rad) of a rigid frame. The node stores only the change from its reference."""
    return np.asarray(data[:, 3] + station.angle)


def _force(boom: Boom, index: int, number: int, at_rest: bool) -> Array:
    """Return the cylinder force (N), positive in tension.

    Exudyn's distance multiplier is positive in tension in the dynamic solver, but in compression in the static one (1.13.6).
    """
    force = _data(boom, number, at_rest)[:, 1]
    return -force if at_rest and not boom.scene.joints[index].cylinder.is_compressible else force


def _motion(boom: Boom, site: Site, position: Array, acceleration: Array, frame: Array, rates: Array) -> Array:
    """Return x, y (m), their accelerations, angle and rate (rad, rad/s) of a site, (m, 6)."""
    angle = _angle(frame, boom.sections[site.section].at(site.at))
    return np.column_stack([position[:, 1:3], acceleration[:, 1:3], angle, rates[:, 3]])


def _moment(boom: Boom, site: Site, around: Sequence[tuple[int, float]], data: Callable[[int], Array], rows: int) -> Array:
    """Return the bending moment (N m) at a site, (m,): EI times curvature, linear between the middles of elements."""
    section = boom.scene.sections[site.section]
    if not around or section.I is None:
        return np.full(rows, np.nan)
    return np.asarray(boom.scene.material.E * section.I * sum(share * data(number)[:, 3] for number, share in around))


def _about_site(boom: Boom, site: Site) -> tuple[tuple[int, float], ...]:
    """Add sensors of the curvature of the elements about a site; return them with their shares. There are none off a beam."""
    built = boom.sections[site.section]
    if built.beam is None or not built.beam[0] < site.at < built.beam[1]:
        return ()
    near = sorted(built.beams, key=lambda beam: abs(0.5 * (beam[0] + beam[1]) - site.at))[:2]
    first, second = (0.5 * (start + end) for start, end, _ in near)
    kind, share = exudyn.OutputVariableType.CurvatureLocal, (site.at - first) / (second - first)
    numbers = [_sensor(boom, kind, items.SensorBody, bodyNumber=body, localPosition=[0.0, 0.0, 0.0]) for *_, body in near]
    return (numbers[0], 1.0 - share), (numbers[1], share)


def _at_site(boom: Boom, site: Site) -> tuple[int, int, int, int]:
    kind, station = exudyn.OutputVariableType, boom.sections[site.section].at(site.at)
    place = {"bodyNumber": station.body, "localPosition": [site.at - station.x, 0.0, 0.0]}
    position, acceleration = (_sensor(boom, each, items.SensorBody, **place) for each in (kind.Position, kind.Acceleration))
    frame, rates = (_on_node(boom, station, each) for each in (kind.Coordinates, kind.Coordinates_t))
    return position, acceleration, frame, rates


def _at_tip(boom: Boom, kind: Any) -> int:
    head, length = boom.sections[-1].head, boom.scene.sections[-1].length
    return _sensor(boom, kind, items.SensorBody, bodyNumber=head.body, localPosition=[length - head.x, 0.0, 0.0])


def _on_node(boom: Boom, station: Station, kind: Any) -> int:
    return _sensor(boom, kind, items.SensorNode, nodeNumber=station.node)


def _on_drive(boom: Boom, drive: int, kind: Any) -> int:
    return _sensor(boom, kind, items.SensorObject, objectNumber=drive)


def _sensor(boom: Boom, kind: Any, item: Any, **where: Any) -> int:
    return int(boom.system.AddSensor(item(outputVariableType=kind, storeInternal=True, writeToFile=False, **where)))
