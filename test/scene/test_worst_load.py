"""The largest push and pull of every cylinder over the working range: by hand, against postures tried, against the model."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from default_boom import examine_text, example_text

from boom_twin import Scene, load_scene, statics
from boom_twin.scene.boom_table import read_table
from boom_twin.scene.first_scene import first_scene
from boom_twin.scene.kinematics import cylinder_length, linkage
from boom_twin.scene.worst_load import worst_loads

TABLE = Path(__file__).parents[2] / "examples/z_fold_28m_table.yaml"
Z_FOLD = examine_text(example_text("five_section_z_fold"), "scene")[0]


def test_of_one_section_it_is_weight_times_arm_over_lever() -> None:
    whole = load_scene()
    first = whole.sections[0].model_copy(update={"root": None, "head": None})
    one = whole.model_copy(update={"sections": (first,), "joints": whole.joints[:1], "postures": {}})
    ((push, pull),) = worst_loads(one)
    angles = np.arange(-5, 86)
    levers = cylinder_length(linkage(one, 0), np.radians(angles))[1]
    forces = -9.81 * 52.0 * 3.0 * 2.1 * np.cos(np.radians(angles)) / levers
    assert push.force == pytest.approx(forces.min(), rel=1e-12) and push.angles == (int(angles[forces.argmin()]),)
    assert pull.force == 0.0


@pytest.mark.parametrize("scene", [load_scene(), Z_FOLD], ids=["default", "z fold"])
def test_no_posture_that_is_tried_has_more_and_its_own_has_as_much(scene: Scene) -> None:
    rng = np.random.default_rng(5)
    loads = worst_loads(scene)
    tried = [np.array([rng.integers(*np.round(joint.range_deg).astype(int)) for joint in scene.joints]) for _ in range(2000)]
    tried += [np.diff(load.angles, prepend=0) for pair in loads for load in pair if load.angles]
    forces = np.array([_forces(scene, np.radians(angles)) for angles in tried])
    for i, (push, pull) in enumerate(loads):
        assert push.force == pytest.approx(forces[:, i].min(), rel=1e-9)
        assert pull.force == pytest.approx(forces[:, i].max(), rel=1e-9)


def _forces(scene: Scene, angles: Any) -> list[float]:
    """Weights of all parts, hung as the module says, times their arms about each pivot, over the levers."""
    headings, found = np.cumsum(angles), []
    starts = np.concatenate(
        [[0j], np.cumsum([s.length * np.exp(1j * h) for s, h in zip(scene.sections, headings, strict=True)])]
    )
    for i in range(len(scene.joints)):
        moment = 9.81 * (scene.tip.payload or 0.0 if scene.tip else 0.0) * (starts[-1] - starts[i]).real
        for k in range(i, len(scene.sections)):
            section, turn = scene.sections[k], np.exp(1j * headings[k])
            assert section.beam is not None and section.rho_A is not None
            parts = [(part.mass, complex(*part.com)) for part in (section.root, section.head) if part is not None]
            parts.append((section.rho_A * (section.beam[1] - section.beam[0]), complex(sum(section.beam) / 2)))
            hung = scene.joints[k]
            mass = sum(part.mass for part in (hung.cylinder.barrel, hung.cylinder.rod) if part is not None)
            parts.append((mass + (hung.mL or 0.0) + (hung.mR or 0.0), 0j))
            moment += sum(9.81 * mass * (starts[k] + centre * turn - starts[i]).real for mass, centre in parts)
        found.append(-moment / float(cylinder_length(linkage(scene, i), angles[i])[1]))
    return found


def test_a_pull_on_the_ring_away_from_the_stretched_posture_is_warned_of(tmp_path: Path) -> None:
    path = tmp_path / "table.yaml"
    text = TABLE.read_text(encoding="utf-8")
    path.write_text(text.replace("bore: 190 mm, rod: 110 mm", "bore: 180 mm, rod: 110 mm"), encoding="utf-8")
    _, scene, (told,) = first_scene(*read_table(path), "table")
    assert told.path == "joints[1].bore" and "pulls most, with 758 kN, 47.6 MPa on the rod side" in told.bound
    assert "With this rod a bore of 0.184 m would do" in told.remedy  # sqrt(4 / pi 758 kN / 45 MPa + 0.11^2)
    stretched = statics(scene, posture="stretched", modes=0).cylinder_forces[1]
    oil = scene.joints[1].cylinder.oil
    assert oil is not None and stretched / oil.rod_area < 30e6, "stretched out it passes"
    path.write_text(text.replace("bore: 170 mm, rod: 115 mm", "bore: 100 mm, rod: 60 mm"), encoding="utf-8")
    (push,) = first_scene(*read_table(path), "table")[2]
    assert push.path == "joints[0].bore" and "pushes most" in push.bound and "on the cap side" in push.bound
