"""Seeded random booms: any number of sections, any order of joints, parts left out at random."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from default_boom import strokes_of_angles
from oracle import booms

from boom_twin import Scene

RIGID = {"mass": 150.0, "com": [1.5, 0.03], "inertia": 120.0}


@pytest.fixture
def random_boom(seed: int) -> tuple[Scene, np.ndarray]:
    """The scene of a test's parameter `seed`, every third on an elastic base; strokes (m), shape (n,), inside its ranges."""
    scene = random_scene(seed)
    if seed % 3 == 2:
        rng = np.random.default_rng([seed, 2])
        scene = booms.on_elastic_base(scene, 10.0 ** rng.uniform(6.5, 8.0), 10.0 ** rng.uniform(4.0, 5.0))
    return scene, random_strokes(scene, seed)


def random_scene(seed: int) -> Scene:
    """One to five sections made of the default scene's parts, some of them heavier, softer, rigid or missing."""
    rng = np.random.default_rng(seed)
    document: dict[str, Any] = booms.document()
    sections, joints, count = document["sections"], document["joints"], 1 + seed % 5
    milder = {"spread": (0.7, 1.5), "missing": 0.2, "rigid": RIGID, "in_place_of_a_root": True}
    chosen = [booms.varied_section(sections[i], rng, **milder) for i in np.sort(rng.integers(0, 4, count))]
    for section in chosen:
        section.pop("rod_pin", None)
    chosen[0]["rod_pin"] = [0.60, -0.12]
    mounted = [booms.varied_joint(joints[0], rng, (0.6, 1.5), 0.2)]
    mounted += [booms.varied_joint(joints[i], rng, (0.6, 1.5), 0.2) for i in rng.integers(1, 4, count - 1)]
    booms.vary_cylinders(mounted, seed)
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
    low, high = np.radians([joint.range_deg for joint in scene.joints]).T
    inside = [rng.uniform(a + 0.1 * (b - a), b - 0.1 * (b - a)) for a, b in zip(low, high, strict=True)]
    return strokes_of_angles(scene, np.array(inside))
