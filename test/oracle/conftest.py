"""Seeded random booms: any number of sections, any order of joints, parts left out at random."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from oracle import booms

from boom_twin import Scene
from boom_twin.scene.kinematics import stroke_curve


@pytest.fixture
def random_boom(seed: int) -> tuple[Scene, np.ndarray]:
    """The scene of a test's parameter `seed`, and strokes (m), shape (n,), well inside its ranges."""
    scene = random_scene(seed)
    return scene, random_strokes(scene, seed)


def random_scene(seed: int) -> Scene:
    """One to five sections made of the default scene's parts, some of them heavier, softer, rigid or missing."""
    rng = np.random.default_rng(seed)
    sections, joints = _parts("sections"), _parts("joints")
    count = 1 + seed % 5
    chosen = [_section(sections[i], rng) for i in np.sort(rng.integers(0, 4, count))]
    for section in chosen:
        section.pop("rod_pin", None)
    chosen[0]["rod_pin"] = [0.60, -0.12]
    mounted = [_joint(dict(joints[0]), rng), *(_joint(joints[i], rng) for i in rng.integers(1, 4, count - 1))]
    booms.vary_cylinders(mounted, seed)
    document: dict[str, Any] = booms.document()
    document |= {"sections": chosen, "joints": mounted, "postures": {}}
    document["base"] = document["base"] | {"inclination": float(rng.uniform(-0.1, 0.1))}
    if rng.random() < 0.5:
        document["tip"] = {"payload": float(rng.uniform(5.0, 60.0))}
    if rng.random() < 0.5:
        document["line_fill"] = float(rng.uniform(2.0, 12.0))
    return Scene.model_validate(document)


def random_strokes(scene: Scene, seed: int) -> np.ndarray:
    """Strokes (m), shape (n,), of joint angles well inside their ranges."""
    rng = np.random.default_rng(seed + 10_000)
    strokes = []
    for i, joint in enumerate(scene.joints):
        low, high = np.radians(joint.range_deg)
        angle = np.array([rng.uniform(low + 0.1 * (high - low), high - 0.1 * (high - low))])
        strokes.append(float(stroke_curve(scene, i, angle)[0]))
    return np.array(strokes)


def _parts(name: str) -> list[dict[str, Any]]:
    return booms.document()[name]


def _section(section: dict[str, Any], rng: np.random.Generator) -> dict[str, Any]:
    """A copy with other stiffness and mass, perhaps rigid, perhaps without some part."""
    section = dict(section)
    section["I"] *= float(rng.uniform(0.7, 1.5))
    section["rho_A"] *= float(rng.uniform(0.7, 1.5))
    for part in ("root", "head", "rho_I", "beta"):
        if rng.random() < 0.2:
            del section[part]
    kind = rng.random()
    if kind < 0.15:
        section["modes"] = 0
    elif kind < 0.3 and "root" in section:
        section["root"] = section["root"] | {"mass": 150.0, "com": [1.5, 0.03], "inertia": 120.0}
        for part in ("beam", "head", "A", "I", "rho_A", "rho_I", "beta"):
            section.pop(part, None)
    return section


def _joint(joint: dict[str, Any], rng: np.random.Generator) -> dict[str, Any]:
    """A copy with other oil springs, perhaps incompressible, perhaps with massless parts."""
    joint = dict(joint)
    cylinder = joint["cylinder"] = dict(joint["cylinder"])
    cylinder["k"] *= float(rng.uniform(0.6, 1.5))
    for part in ("barrel", "rod", "d"):
        if rng.random() < 0.2:
            del cylinder[part]
    if rng.random() < 0.2:
        cylinder.pop("k"), cylinder.pop("d", None)
    for part in ("mL", "mR"):
        if rng.random() < 0.3:
            joint.pop(part, None)
    return joint
