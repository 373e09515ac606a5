"""Read tip, joints and cylinder forces from the Exudyn boom."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from ....types import Array
from .module import exudyn, items
from .system import Boom, Station

_FORCE = {"distance": exudyn.OutputVariableType.Force, "referenceLength": exudyn.OutputVariableType.ForceLocal}
"""Output that is the cylinder force, by the name of the connector's length parameter."""


@dataclass(frozen=True, slots=True)
class Probes:
    """Numbers of the sensors that record while the boom moves."""

    tip: tuple[int, int]  # position, acceleration
    head: tuple[int, int]  # velocities and accelerations of the last head's node
    roots: tuple[int, ...]
    heads: tuple[int, ...]
    forces: tuple[int, ...]
    lengths: tuple[int, ...]
    pins: tuple[tuple[int, int], ...]  # places of hole and journal of every pin with play


def attach(boom: Boom) -> Probes:
    """Add all sensors; to be called before the system is assembled."""
    kind, last = exudyn.OutputVariableType, boom.sections[-1].head
    return Probes(
        tip=(_at_tip(boom, kind.Position), _at_tip(boom, kind.Acceleration)),
        head=(_on_node(boom, last, kind.Coordinates_t), _on_node(boom, last, kind.Coordinates_tt)),
        roots=tuple(_on_node(boom, section.root, kind.Coordinates) for section in boom.sections),
        heads=tuple(_on_node(boom, section.head, kind.Coordinates) for section in boom.sections),
        forces=tuple(_on_drive(boom, drive, _FORCE[name]) for drive, name in boom.drives),
        lengths=tuple(_on_drive(boom, drive, kind.Distance) for drive, _ in boom.drives),
        pins=tuple((_on_marker(boom, bush.sides[0]), _on_marker(boom, bush.sides[1])) for bush in boom.bushes),
    )


def read(boom: Boom, probes: Probes, at_rest: bool) -> dict[str, Array]:
    """All that was recorded, m rows; or, `at_rest`, the equilibrium just found, one row.

    Returns
    -------
    dict
        ``t`` (m,) s; ``tip``, ``tip_acc`` (m, 2) m, m/s^2; ``tip_angle``, ``tip_rate``, ``tip_rate_dot`` (m,) rad,
        rad/s, rad/s^2; ``joints`` (m, n) rad; ``forces`` (m, n) N, positive in tension; ``lengths`` (m, n) m, pin to pin,
        less the closed length; ``pins`` (m, k, 2) m, offsets of the journals that have play.
    """
    data = partial(_data, boom, at_rest=at_rest)
    roots = np.column_stack([_angle(data(p), s.root) for p, s in zip(probes.roots, boom.sections, strict=True)])
    heads = np.column_stack([_angle(data(p), s.head) for p, s in zip(probes.heads, boom.sections, strict=True)])
    cylinders = [joint.cylinder for joint in boom.scene.joints]
    before = np.column_stack([np.zeros(len(heads)), heads[:, :-1]])
    return {
        "t": data(probes.tip[0])[:, 0],
        "tip": data(probes.tip[0])[:, 1:3],
        "tip_acc": data(probes.tip[1])[:, 1:3],
        "tip_angle": heads[:, -1],
        "tip_rate": data(probes.head[0])[:, 3],
        "tip_rate_dot": data(probes.head[1])[:, 3],
        "joints": roots - before,
        "forces": np.column_stack([_force(boom, i, p, at_rest) for i, p in enumerate(probes.forces)]),
        "lengths": np.column_stack([data(p)[:, 1] - c.closed_length for p, c in zip(probes.lengths, cylinders, strict=True)]),
        "pins": np.array([data(journal)[:, 1:3] - data(hole)[:, 1:3] for hole, journal in probes.pins])
        .reshape(len(probes.pins), len(heads), 2)
        .swapaxes(0, 1),
    }


def _data(boom: Boom, number: int, at_rest: bool) -> Array:
    """Time in column 0, then the sensor's values: what was recorded, or one row of the present state."""
    if at_rest:
        return np.hstack([0.0, boom.system.GetSensorValues(number)])[None, :]
    return np.asarray(boom.system.GetSensorStoredData(number), float)


def _angle(data: Array, station: Station) -> Array:
    """Absolute angle of a rigid frame (rad): the node keeps only the change from its reference."""
    return np.asarray(data[:, 3] + station.angle)


def _force(boom: Boom, index: int, number: int, at_rest: bool) -> Array:
    """Cylinder force (N), positive in tension.

    The multiplier of a distance is positive in tension in Exudyn's dynamic solver, in compression in its static one
    (seen in 1.13.6).
    """
    force = _data(boom, number, at_rest)[:, 1]
    return -force if at_rest and not boom.scene.joints[index].cylinder.is_compressible else force


def _at_tip(boom: Boom, kind: Any) -> int:
    head, length = boom.sections[-1].head, boom.scene.sections[-1].length
    return _sensor(boom, kind, items.SensorBody, bodyNumber=head.body, localPosition=[length - head.x, 0.0, 0.0])


def _on_node(boom: Boom, station: Station, kind: Any) -> int:
    return _sensor(boom, kind, items.SensorNode, nodeNumber=station.node)


def _on_marker(boom: Boom, marker: int) -> int:
    return _sensor(boom, exudyn.OutputVariableType.Position, items.SensorMarker, markerNumber=marker)


def _on_drive(boom: Boom, drive: int, kind: Any) -> int:
    return _sensor(boom, kind, items.SensorObject, objectNumber=drive)


def _sensor(boom: Boom, kind: Any, item: Any, **where: Any) -> int:
    """Add a sensor that keeps its values in memory and writes no file."""
    return int(boom.system.AddSensor(item(outputVariableType=kind, storeInternal=True, writeToFile=False, **where)))
