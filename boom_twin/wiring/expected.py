"""Expected readings at rest: angles, forces and gravity at the IMUs for measured strokes."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from ..analysis.cylinder_drives import drives_as_read
from ..analysis.equilibrium import settle
from ..compiler.compile import compile_scene
from ..compiler.plan import first_row, taken_apart
from ..config.settings import Settings
from ..deviation.channels import READS_ACCELERATION, measurement_of
from ..deviation.posture import locate
from ..deviation.sensor_model import mounting_of
from ..errors import BoomTwinError
from ..scene.edit import with_rigid_cylinders
from ..scene.kinematics import gravity_in_base, joint_angles_of_strokes, stroke_curve
from ..scene.schema import Scene
from ..types import NO_PLACES, Array, Mount, Place, Stream, StrokeReading


class Expected(NamedTuple):
    """Expected readings in every block, NaN if no posture has its strokes."""

    angles: dict[Mount | None, Array]  # (blocks, n), encoders (None), inclinometers at root and head of each section, rad
    forces: Array  # (blocks, n), N
    gravity: dict[Stream, Array]  # (blocks,), at rest at every IMU, along its section and (imaginary) across, m/s^2
    compression: Array  # (blocks, n), turn of each joint if the strokes are drives instead of lengths, rad; 0 without a posture


class RestModel:
    """Model of a scene, with its load, at rest; `reads` is what the strokes are. For `places` see `boom_twin.Twin`."""

    def __init__(self, scene: Scene, reads: StrokeReading, places: Mapping[str, Place] = NO_PLACES) -> None:
        self.scene = scene
        self._boom, self._struts = compile_scene(scene), compile_scene(with_rigid_cylinders(scene))
        self._plan = self._struts if reads is StrokeReading.LENGTH else self._boom
        self._state, self._work = self._plan.state(), self._plan.work()
        joints = self._plan.joints
        kinds: tuple[Mount, ...] = "root", "head"
        self._frames = {kind: mounting_of(self._plan, [kind] * joints).frames for kind in kinds}
        self._measured = measurement_of(self._plan, Settings(), mounting_of(self._plan, ()), places)
        streams, channels = tuple(Stream), self._measured.channels
        self._imus = {streams[row.stream]: int(row.site) for row in channels[channels.kind == READS_ACCELERATION]}

    def expected(self, strokes: Array) -> Expected:
        """Return the expected readings for strokes (blocks, n), m."""
        blocks, n = strokes.shape
        angles: dict[Mount | None, Array] = {kind: np.full((blocks, n), np.nan) for kind in (None, "root", "head")}
        gravity = {stream: np.full(blocks, np.nan, complex) for stream in self._imus}
        forces, compression = np.full((blocks, n), np.nan), np.zeros((blocks, n))
        inclination = self.scene.base.inclination
        up = -complex(*gravity_in_base(self.scene))
        for row, values in enumerate(strokes):
            try:
                near = joint_angles_of_strokes(self.scene, values)
                settle(self._plan, self._state, self._work, values, near)
            except BoomTwinError:
                continue
            found, frames = taken_apart(self._plan, first_row(self._plan, self._state)), self._state.frames
            angles[None][row], forces[row] = found.joints, found.cylinder_forces
            for kind, places in self._frames.items():
                angles[kind][row] = frames[places, 2] + inclination
            for stream, site in self._imus.items():
                _, _, angle = locate(self._plan.tables, self._state, self._measured, site)
                gravity[stream][row] = up * np.exp(-1j * angle)
            compression[row] = self._compression(values, near, found.cylinder_forces)
        return Expected(angles, forces, gravity, compression)

    def _compression(self, strokes: Array, angles: Array, forces: Array) -> Array:
        """Return the rotation of each joint by the compression of its oil, rad."""
        drives = drives_as_read(self._boom, strokes, forces, StrokeReading.LENGTH)
        step = 1e-4
        slopes = [np.diff(stroke_curve(self.scene, i, each + np.array([-step, step])))[0] for i, each in enumerate(angles)]
        return np.asarray((strokes - drives).reshape(-1) * 2.0 * step / np.array(slopes))
