"""Errors of statics and of a move of the default scene against the independent reference numbers in test/data/reference."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from boom_twin import load_scene, simulate, statics
from boom_twin.types import Array

FOLDER = Path(__file__).parents[1] / "data" / "reference"
POSTURES = ("horizontal", "arch")
AT_REST = {"tip": 2e-5, "joints": 2e-6, "forces": 2e-5, "frequencies 1-4": 2e-4, "frequencies 5-6": 2e-3}
"""Bounds of `at_rest`: joints in rad, others relative."""
MOVING = {"tip": 2e-4, "acceleration": 3e-3, "joints": 1e-5, "forces": 2e-3}
"""Bounds of `moving`: tip in m, joints in rad, others relative."""


def at_rest(posture: str, by_strokes: bool = False) -> dict[str, float]:
    """Return the largest errors of statics."""
    numbers = json.loads((FOLDER / "statics.json").read_text())[posture]
    found = statics(load_scene(), **({"strokes": np.array(numbers["stroke_m"])} if by_strokes else {"posture": posture}))
    assert np.abs(found.strokes - numbers["stroke_m"]).max() < 1e-9
    assert np.abs(found.tip_rigid - numbers["tip_rigid_m"]).max() < 1e-7
    sag = np.subtract(numbers["tip_m"], numbers["tip_rigid_m"])
    forces, frequencies = (np.abs(np.divide(*pair) - 1.0) for pair in (
        (found.cylinder_forces, numbers["cylinder_force_N"]), (found.frequencies, numbers["frequencies_Hz"]),
    ))  # fmt: skip
    return {
        "tip": float(np.linalg.norm(found.tip - found.tip_rigid - sag) / np.linalg.norm(sag)),
        "joints": float(np.abs(found.joints - numbers["joint_rad"]).max()),
        "forces": float(forces.max()),
        "frequencies 1-4": float(frequencies[:4].max()),
        "frequencies 5-6": float(frequencies[4:].max()),
    }


def moving() -> dict[str, float]:
    """Return the root mean square errors of the move; of joints and forces those of the worst."""
    rows = np.genfromtxt(FOLDER / "arch_move.csv.gz", delimiter=",", names=True)
    strokes, joints, forces = (_stack(rows, each) for each in ("stroke_{}_m", "joint_{}_rad", "cylinder_force_{}_N"))
    position, acceleration = (np.column_stack([rows[f"tip_{axis}"] for axis in each]) for each in (
        ("x_m", "y_m"), ("ax_m_s2", "ay_m_s2"),
    ))  # fmt: skip
    found = simulate(load_scene(), rows["t_s"], strokes, dt=1e-3)
    force_errors = np.mean((found.cylinder_forces - forces) ** 2, axis=0) / np.mean(forces**2, axis=0)
    return {
        "tip": rms(found.tip[:, :2] - position),
        "acceleration": rms(found.tip_acceleration[:, :2] - acceleration) / rms(acceleration),
        "joints": float(np.sqrt(np.mean((found.joints - joints) ** 2, axis=0)).max()),
        "forces": float(np.sqrt(force_errors).max()),
    }


def rms(vectors: Array) -> float:
    """Return the root mean square of vectors (k, 2)."""
    return float(np.sqrt(np.mean(np.sum(np.square(vectors), axis=-1))))


def _stack(rows: Array, pattern: str) -> Array:
    return np.column_stack([rows[pattern.format(i + 1)] for i in range(4)])
