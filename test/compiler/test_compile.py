"""What a scene names is in the tables, what it does not name is not."""

from __future__ import annotations

import numpy as np
import pytest
from oracle import booms

from boom_twin import load_scene
from boom_twin.compiler.compile import compile_scene
from boom_twin.kernels import tables as program
from boom_twin.scene.segmentation import flexible_parts


def total_mass(scene):
    """All that is named, kg."""
    mass = scene.tip.payload if scene.tip is not None and scene.tip.payload else 0.0
    for section in scene.sections:
        mass += (scene.line_fill or 0.0) * section.length
        mass += sum(part.mass for part in (section.root, section.head) if part is not None)
        if section.beam is not None:
            mass += section.rho_A * (section.beam[1] - section.beam[0])
    for joint in scene.joints:
        mass += (joint.mL or 0.0) + (joint.mR or 0.0)
        mass += sum(part.mass for part in (joint.cylinder.barrel, joint.cylinder.rod) if part is not None)
    return mass


@pytest.mark.parametrize("seed", range(20))
def test_weight_is_that_of_all_named_masses(seed):
    scene = booms.random_boom(seed)
    plan = compile_scene(scene)
    weights = plan.weights[plan.weights != 0.0]
    assert np.abs(weights).sum() > 0.0
    turned = np.array(
        [
            [np.cos(scene.base.inclination), np.sin(scene.base.inclination)],
            [-np.sin(scene.base.inclination), np.cos(scene.base.inclination)],
        ]
    ) @ np.array(scene.gravity)
    assert plan.tables.gravity == pytest.approx(turned, rel=1e-12)
    assert weights.sum() == pytest.approx(total_mass(scene) * turned.sum(), rel=1e-12)


@pytest.mark.parametrize("seed", range(20))
def test_beams_are_split_at_pins(seed):
    scene = booms.random_boom(seed)
    parts = [part for i in range(len(scene.sections)) for part in flexible_parts(scene, i)]
    beams = compile_scene(scene).tables.weights
    assert len(beams) == len(parts)
    lengths = [beams[k, scene_points(beams[k]), :].sum() for k in range(len(parts))]
    assert lengths == pytest.approx([b - a for a, b in parts], rel=1e-12)


def test_a_rigid_section_leaves_the_parts_of_the_others():
    def parts(*rigid: int) -> list:
        scene = load_scene()
        sections = [each.model_copy(update={"modes": 0}) if i in rigid else each for i, each in enumerate(scene.sections)]
        scene = scene.model_copy(update={"sections": sections})
        return [flexible_parts(scene, i) for i in range(4)]

    everywhere = parts()
    for rigid in ([0], [1, 3], [0, 2]):
        assert parts(*rigid) == [() if i in rigid else part for i, part in enumerate(everywhere)]
    assert [len(part) for part in parts(0, 1, 2)] == [0, 0, 0, 3]  # as few would not reach the sixth frequency


def scene_points(weights):
    """Row of the output end: the last one that is not padding."""
    return np.flatnonzero(np.abs(weights).sum(axis=1) > 0.0)[-1]


def test_nothing_named_nothing_there():
    spec = booms.document()
    spec["sections"] = [{"length": s["length"], "root": s["root"]} for s in spec["sections"]]
    spec["sections"][0]["rod_pin"] = [0.6, -0.12]
    for joint in spec["joints"]:
        joint.pop("mL", None), joint.pop("mR", None)
        joint["cylinder"] = {key: joint["cylinder"][key] for key in ("closed_length", "max_stroke")}
    plan = compile_scene(booms.scene_of(spec))
    t = plan.tables
    assert (len(t.beams), len(t.links), len(t.parts)) == (0, 0, 0)
    assert len(t.bodies) == 4
    assert np.all(t.cylinders.compliance == 0.0)
    assert plan.names == (
        "theta_1", "N_1",
        *(f"{name}_{i}" for i in (2, 3, 4) for name in ("theta", "alpha_L", "alpha_R", "lambda_x", "lambda_y", "N")),
    )  # fmt: skip


def test_unknowns_of_the_default_scene():
    plan = compile_scene(load_scene())
    parts = sum(len(flexible_parts(load_scene(), i)) for i in range(4))
    assert len(plan.names) == 2 + 3 * 6 + parts * 4
    kinds = list(plan.tables.operations.kind)
    assert kinds[0] == program.JOINT_A and kinds.count(program.JOINT_B) == 3
    assert kinds.count(program.STATION) == 3 and kinds.count(program.ROD_PIN) == 1


def test_zero_is_the_same_as_absent():
    spec = booms.document()
    plain = compile_scene(booms.scene_of(spec))
    spec |= {"line_fill": 0.0, "tip": {"payload": 0.0}}
    named = compile_scene(booms.scene_of(spec))
    for a, b in zip(plain.tables, named.tables, strict=True):
        assert np.array_equal(a, b)
