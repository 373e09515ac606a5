"""Studies of a scene's parts, their motions and their folders."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from command import main
from default_boom import joint_angles_of_strokes, motion_of, strokes_of_posture
from oracle import booms
from oracle.conftest import random_scene

from boom_twin import Scene, load_scene, statics
from boom_twin.analysis.methods import TURN
from boom_twin.cli.study import KINDS
from boom_twin.reduction import deviation
from boom_twin.reduction.search import variants
from boom_twin.validation.study import parts


@pytest.fixture(scope="module")
def found(two_sections: Scene) -> dict[str, Any]:
    return parts.measure(two_sections, deviation.course_of(two_sections), rounds=1)


def test_every_variant_is_there_ascending_in_error(found: dict[str, Any], two_sections: Scene) -> None:
    rows = found["variants"]
    assert {part["name"] for part in rows} == {variant.name for variant in variants(two_sections)}
    errors = [max(part["rest_error_m"], part["move_error_max_m"]) for part in rows]
    assert errors == sorted(errors) and all(np.isfinite(errors))
    assert all(part["status"] == "ok" and part["step_time_s"] > 0.0 for part in rows)


def test_its_numbers_are_those_of_the_edited_scene(found: dict[str, Any], two_sections: Scene) -> None:
    part = next(part for part in found["variants"] if part["name"] == "cylinder 2 incompressible")
    second = two_sections.joints[1]
    cylinder = second.cylinder.model_copy(update={"k": None, "d": None})
    hard = two_sections.model_copy(
        update={"joints": (two_sections.joints[0], second.model_copy(update={"cylinder": cylinder}))}
    )
    full, lean = (statics(scene, posture="arch", modes=3) for scene in (two_sections, hard))
    shifts = [part[f"f{k}_shift"] for k in (1, 2, 3)]
    assert shifts == pytest.approx(lean.frequencies / full.frequencies - 1.0, abs=1e-6)
    off = [np.linalg.norm(statics(two_sections, posture=n).tip - statics(hard, posture=n).tip) for n in ("arch", "low")]
    assert part["rest_error_m"] == pytest.approx(max(off), rel=1e-6)
    assert part["unknowns"] == found["full"]["unknowns"]


def test_the_files(found: dict[str, Any], two_sections: Scene, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(parts, "measure", lambda *_: found)
    out = tmp_path / "deep" / "out"
    written = parts.write(two_sections, out, quick=True)
    assert sorted(written) == sorted(out.iterdir())
    values = json.loads((out / "parts.json").read_text())
    assert len(values["variants"]) == len(found["variants"]) and values["machine"]["cpu"]
    first = values["variants"][0]
    assert first["edits"].startswith(("sections[", "remove ")) and first["step_time_s"] > 0.0
    text = (out / "parts.md").read_text()
    single = [part for part in found["variants"] if part["kind"] == "modes" and not part["name"].startswith("all")]
    assert text.count("\n| ") == len(found["variants"]) - len(single) + 1 and single
    assert "Leave out parts whose error you accept" in text and "surrogate" in text


def test_default_boom_moves_as_in_the_documentation():
    scene = load_scene()
    motion = motion_of(scene)
    strokes, rates = motion(np.array([0.0, 0.75, 1.5, 4.0]))
    assert motion.duration == 4.0 and "arch" in motion.label
    assert strokes[0] == pytest.approx(strokes_of_posture(scene, "arch"), abs=1e-12)
    assert strokes[1] - strokes[0] == pytest.approx([0.025, 0.0, 0.015, 0.0])
    assert strokes[3] - strokes[0] == pytest.approx([0.05, 0.0, 0.03, 0.0])
    assert not rates[[0, 2, 3]].any()


SCENES = [*(booms.random_boom(seed) for seed in range(10)), *(random_scene(seed) for seed in range(10))]


@pytest.mark.parametrize("scene", SCENES, ids=[f"booms{i}" for i in range(10)] + [f"scene{i}" for i in range(10)])
def test_motion_stays_inside(scene):
    motion = motion_of(scene)
    moved = np.flatnonzero(motion.travel)
    assert len(moved) and not np.any(moved % 2)
    strokes, _ = motion(np.linspace(0.0, motion.duration, 50))
    for i, joint in enumerate(scene.joints):
        assert strokes[0, i] == motion.first[i]
        assert strokes[:, i].min() >= -1e-9 and strokes[:, i].max() <= joint.cylinder.max_stroke + 1e-9
    turned = joint_angles_of_strokes(scene, strokes[-1], near=motion.angles) - motion.angles
    assert np.all(np.abs(turned[motion.travel == 0.0]) < 1e-7)
    halvings = np.log2(TURN / np.abs(turned[moved]))
    assert halvings == pytest.approx(np.round(halvings), abs=1e-4) and np.all(halvings < 3.5)


@pytest.mark.parametrize("kind", KINDS)
def test_a_file_that_is_there_is_kept(kind: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Which is found before the work begins: it may take minutes."""
    for name in (f"{kind}.md", f"{kind}.png", "notes.txt"):
        (out := tmp_path / name).mkdir()
        (out / name).write_text("mine")
        assert main(["study", kind, "--quick", "--out", str(out)]) == 1
        assert f"{out}: holds {name}, and no manifest of `boom_twin study {kind}`" in capsys.readouterr().err
        assert [path.read_text() for path in out.iterdir()] == ["mine"]
