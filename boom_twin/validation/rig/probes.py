"""Read tip, joints, cylinder forces and places of sensors from the Exudyn boom."""

from __future__ import annotations

from typing import Any

import numpy as np

from ...types import Array
from . import exudyn, items
from .system import Boom, Site, Station

Share = tuple[int, float]  # a sensor and its share in a reading


class Probes:
    """Exudyn sensors of all recorded quantities. They are added before the system is assembled."""

    def __init__(self, boom: Boom) -> None:
        self._boom, kind, last = boom, exudyn.OutputVariableType, boom.sections[-1].head
        length = boom.scene.sections[-1].length
        self._tip, self._tip_acc = (self._on_body(last, length, each) for each in (kind.Position, kind.Acceleration))
        self._tip_rate = self._on_node(last.node, kind.Coordinates_t)
        self._roots = [self._on_node(section.root.node, kind.Coordinates) for section in boom.sections]
        self._heads = [self._on_node(section.head.node, kind.Coordinates) for section in boom.sections]
        force = {"distance": kind.Force, "referenceLength": kind.ForceLocal}  # by the name of the connector's length
        self._forces = [self._add(items.SensorObject, force[name], objectNumber=drive) for drive, name in boom.drives]
        self._lengths = [self._add(items.SensorObject, kind.Distance, objectNumber=drive) for drive, _ in boom.drives]
        self._sites = [(*self._at_site(site), self._about_site(site)) for site in boom.sites]
        self._base = None if boom.base.node is None else self._on_node(boom.base.node, kind.Coordinates)

    def read(self, at_rest: bool) -> dict[str, Array]:
        """Return all recorded rows (m); if `at_rest`, one row with the present equilibrium. SI.

        Keys: ``t`` (m,); ``tip``, ``tip_acc`` (m, 2); ``tip_angle``, ``tip_rate`` (m,); ``joints``, ``forces`` (tension),
        ``lengths`` (m, n; pin to pin less `closed_length`); ``sites`` (m, k, 7): x, y, their accelerations, angle, its rate,
        bending moment by the curvature (NaN off a beam).
        """

        def data(number: int) -> Array:
            """Return time (column 0; 0 at rest) and the sensor's values."""
            if at_rest:
                return np.hstack([0.0, self._boom.system.GetSensorValues(number)])[None, :]
            return np.asarray(self._boom.system.GetSensorStoredData(number), float)

        def angle(number: int, station: Station) -> Array:
            """Return the absolute angle (rad) of a rigid frame. The node stores only the change from its reference."""
            return np.asarray(data(number)[:, 3] + station.angle)

        def force(number: int, is_compressible: bool) -> Array:
            """Return the cylinder force (N), positive in tension.

            Exudyn's distance multiplier is positive in tension in the dynamic solver, but in compression in the static one.
            """
            return data(number)[:, 1] * (-1.0 if at_rest and not is_compressible else 1.0)

        def site(place: Site, position: int, acceleration: int, frame: int, rate: int, around: tuple[Share, ...]) -> Array:
            section, station = scene.sections[place.section], self._boom.sections[place.section].at(place.at)
            moment: Any = np.full(len(heads), np.nan)
            if around and section.I is not None:
                moment = scene.material.E * section.I * sum(share * data(number)[:, 3] for number, share in around)
            motion = data(position)[:, 1:3], data(acceleration)[:, 1:3], angle(frame, station), data(rate)[:, 3]
            return np.column_stack([*motion, moment])

        scene, sections = self._boom.scene, self._boom.sections
        cylinders = [joint.cylinder for joint in scene.joints]
        roots = np.column_stack([angle(number, each.root) for number, each in zip(self._roots, sections, strict=True)])
        heads = np.column_stack([angle(number, each.head) for number, each in zip(self._heads, sections, strict=True)])
        base = np.zeros(len(heads)) if self._base is None else data(self._base)[:, 3]
        forces = [force(number, each.is_compressible) for number, each in zip(self._forces, cylinders, strict=True)]
        lengths = [data(number)[:, 1] - each.closed_length for number, each in zip(self._lengths, cylinders, strict=True)]
        sites = [site(place, *numbers) for place, numbers in zip(self._boom.sites, self._sites, strict=True)]
        return {
            "t": data(self._tip)[:, 0],
            "tip": data(self._tip)[:, 1:3],
            "tip_acc": data(self._tip_acc)[:, 1:3],
            "tip_angle": heads[:, -1],
            "tip_rate": data(self._tip_rate)[:, 3],
            "joints": roots - np.column_stack([base, heads[:, :-1]]),
            "forces": np.column_stack(forces),
            "lengths": np.column_stack(lengths),
            "sites": np.stack(sites, axis=1) if sites else np.empty((len(heads), 0, 7)),
        }

    def _about_site(self, site: Site) -> tuple[Share, ...]:
        """Add sensors of the curvature of the elements about a site, linear between their middles; none off a beam."""
        built = self._boom.sections[site.section]
        if built.beam is None or not built.beam[0] < site.at < built.beam[1]:
            return ()
        near = sorted(built.beams, key=lambda beam: abs(0.5 * (beam[0] + beam[1]) - site.at))[:2]
        first, second = (0.5 * (start + end) for start, end, _ in near)
        kind, share = exudyn.OutputVariableType.CurvatureLocal, (site.at - first) / (second - first)
        numbers = [self._add(items.SensorBody, kind, bodyNumber=body, localPosition=[0.0, 0.0, 0.0]) for *_, body in near]
        return (numbers[0], 1.0 - share), (numbers[1], share)

    def _at_site(self, site: Site) -> tuple[int, int, int, int]:
        kind, station = exudyn.OutputVariableType, self._boom.sections[site.section].at(site.at)
        position, acceleration = (self._on_body(station, site.at, each) for each in (kind.Position, kind.Acceleration))
        frame, rate = (self._on_node(station.node, each) for each in (kind.Coordinates, kind.Coordinates_t))
        return position, acceleration, frame, rate

    def _on_body(self, station: Station, x: float, kind: Any) -> int:
        """Add a sensor at `x` (m) of a section, on the axis, which is on the rigid frame `station`."""
        return self._add(items.SensorBody, kind, bodyNumber=station.body, localPosition=[x - station.x, 0.0, 0.0])

    def _on_node(self, node: int, kind: Any) -> int:
        return self._add(items.SensorNode, kind, nodeNumber=node)

    def _add(self, item: Any, kind: Any, **where: Any) -> int:
        sensor = item(outputVariableType=kind, storeInternal=True, writeToFile=False, **where)
        return int(self._boom.system.AddSensor(sensor))
