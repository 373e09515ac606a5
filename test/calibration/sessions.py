"""Booms and sessions of the virtual rig for the tests of calibration."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np
from default_boom import parameter, with_parameters
from drive_twin import drive_readings, note_drives
from recordings import write_session

from boom_twin import Scene
from boom_twin.validation import rig
from boom_twin.validation.rig.motion import parse_load, tip_load

ENCODERS = np.radians([0.1, -0.1, 0.1, -0.1])


class Made(NamedTuple):
    """A motion of the virtual rig: its boom, its programme and the rows of the simulation."""

    truth: Scene
    programme: rig.Programme
    rows: dict[str, np.ndarray]

    def write(self, path: Path, seed: int, zeros=0.0, imu=True, cut=slice(None), drives=False) -> Path:
        """A session of it with the sensors' noise of `seed`, encoders reading `zeros` (rad) too much."""
        seen = rig.observe(self.truth, self.programme, self.rows, rig.Sensors(), seed)
        force, joints = seen.imu[cut] if imu else None, seen.joints[cut] + zeros
        strokes = drive_readings(seen) if drives else seen.strokes
        write_session(path, seen.stamps[cut], strokes[cut], joints, force, {"origin": "synthetic, a test"})
        if drives:
            note_drives(path)
        return path


def made(truth: Scene, posture: str, duration: float, seed: int, loads: tuple[str, ...] = ()) -> Made:
    """Random moves; steps of 1 ms and 12 elements a section leave less error than the sensors' noise."""
    programme = rig.random_programme(truth, posture, duration, seed)
    pushes = tip_load(truth, [parse_load(load) for load in loads], duration, seed) if loads else None
    return Made(truth, programme, rig.simulate(truth, programme, duration, 1e-3, 2e-3, 12, pushes))


def off(scene: Scene, *factors: float, **others: float) -> Scene:
    """The scene with other cylinder stiffnesses."""
    values = {f"cylinder_{i}.k": factor * parameter(scene, f"cylinder_{i}.k") for i, factor in enumerate(factors, start=1)}
    return with_parameters(scene, values | others)
