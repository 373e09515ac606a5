"""Expected readings at rest: angles, forces and gravity at the IMUs for measured strokes."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from ..analysis.drive import drives_as_read
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
        self._known: dict[bytes, Array] = {}  # rows of `_at_rest`, by strokes

    def expected(self, strokes: Array) -> Expected:
        """Return the expected readings for strokes (blocks, n), m; those of earlier calls are looked up."""
        blocks, n = strokes.shape
        keys = [row.tobytes() for row in strokes]
        for key, row in zip(keys, strokes, strict=True):
            if key not in self._known:
                self._known[key] = self._at_rest(row)
        found = np.array([self._known[key] for key in keys]).reshape(blocks, 5 * n + len(self._imus))
        near, joints, root, head, forces = found[:, : 5 * n].reshape(blocks, 5, n).swapaxes(0, 1)
        angles: dict[Mount | None, Array] = {None: joints, "root": root, "head": head}
        up = -complex(*gravity_in_base(self.scene))
        gravity = {stream: up * np.exp(-1j * angle) for stream, angle in zip(self._imus, found[:, 5 * n :].T, strict=True)}
        return Expected(angles, forces, gravity, self._compression(strokes, near, forces))

    def _at_rest(self, strokes: Array) -> Array:
        """Return joint angles (undeformed, deflected), inclinations (root, head), forces, and angles of IMUs; NaN if none."""
        try:
            near = joint_angles_of_strokes(self.scene, strokes)
            settle(self._plan, self._state, self._work, strokes, near)
        except BoomTwinError:
            return np.full(5 * len(strokes) + len(self._imus), np.nan)
        found, frames = taken_apart(self._plan, first_row(self._plan, self._state)), self._state.frames
        mounted = [frames[places, 2] + self.scene.base.inclination for places in self._frames.values()]
        imus = [locate(self._plan.tables, self._state, self._measured, site)[2] for site in self._imus.values()]
        return np.concatenate([near, found.joints, *mounted, found.cylinder_forces, imus])

    def _compression(self, strokes: Array, angles: Array, forces: Array) -> Array:
        """Return the rotation of each joint by the compression of its oil, rad."""
        drives, step = drives_as_read(self._boom, strokes, forces, StrokeReading.LENGTH), np.array([-1e-4, 1e-4])
        ends = [stroke_curve(self.scene, i, each[:, None] + step) for i, each in enumerate(angles.T)]
        return np.asarray(np.nan_to_num((strokes - drives) * np.ptp(step) / np.diff(ends)[:, :, 0].T))
