"""What `check --need` proposes keeps its word, is final, and refuses nonsense."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from command import main
from default_boom import motion_of
from oracle import booms
from ruamel.yaml import YAML

from boom_twin import Scene, UsageError, load_scene, simulate, statics
from boom_twin.reduction.search import Proposal, propose
from boom_twin.scene.edit import edited

TWO_SECTIONS = booms.short_boom(2)


def measured_anew(full: Scene, lean: Scene) -> float:
    """Largest distance of two models' tips (m) at rest in all postures and in the move, by the commands' own functions."""
    off = [
        np.linalg.norm(statics(full, posture=name, modes=0).tip - statics(lean, posture=name, modes=0).tip)
        for name in full.postures
    ]
    motion = motion_of(full)
    times = np.arange(0.0, motion.duration + 1e-9, 2e-3)
    strokes, _ = motion(times)
    tips = [simulate(scene, times, strokes, angles=motion.angles).tip[:, :2] for scene in (full, lean)]
    return float(max(*off, np.linalg.norm(tips[0] - tips[1], axis=1).max()))


@pytest.fixture(scope="module")
def proposal() -> Proposal:
    """For 1 mm, of the default scene."""
    return propose(load_scene(), 1e-3)


def test_the_stated_error_is_kept(proposal: Proposal) -> None:
    found = measured_anew(load_scene(), proposal.scene)
    assert found <= 1e-3
    assert found == pytest.approx(proposal.deviation.worst, rel=0.01)


def test_the_proposal_leaves_something_out_and_is_faster(proposal: Proposal) -> None:
    assert len(proposal.edits) >= 5 and proposal.scene == edited(load_scene(), proposal.edits)
    assert proposal.unknowns[1] < proposal.unknowns[0]
    assert proposal.next is not None and proposal.next[1] > 1e-3


def test_all_that_costs_goes_at_a_huge_error() -> None:
    found = propose(TWO_SECTIONS, 10.0)
    assert found.next is None
    assert [found.scene.is_flexible(i) for i in range(2)] == [False, False]
    assert all(joint.mL is joint.cylinder.rod is joint.cylinder.barrel is None for joint in found.scene.joints)
    assert all(joint.cylinder.k is not None for joint in found.scene.joints)  # costs nothing


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(12))
def test_it_is_kept_on_booms_of_all_kinds(seed: int) -> None:
    scene = booms.random_boom(seed)
    for most in (1e-4, 3e-3):
        found = propose(scene, most)
        assert measured_anew(scene, found.scene) <= 1.001 * most


def test_an_error_that_is_none_is_refused() -> None:
    for most in (0.0, float("nan"), float("inf")):
        with pytest.raises(UsageError, match=r"need = .* m: must be positive"):
            propose(TWO_SECTIONS, most)


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """A scene file and where its lean one goes."""
    folder = tmp_path_factory.mktemp("need")
    with (folder / "full.yaml").open("w", encoding="utf-8") as stream:
        YAML(typ="safe").dump(json.loads(TWO_SECTIONS.model_dump_json(exclude_none=True)), stream)
    return folder / "full.yaml", folder / "lean.yaml"


def test_the_command_writes_a_scene_that_loads(written: tuple[Path, Path], capsys: pytest.CaptureFixture[str]) -> None:
    full, lean = map(str, written)
    assert main(["check", full, "--need", "tip = 0.2 cm", "--out", lean, "--json"]) == 0
    out, err = capsys.readouterr()
    values = json.loads(out)
    assert err == "" and out.count("\n") == 1 and not any(isinstance(value, dict) for value in values.values())
    assert values["need_tip_m"] == 2e-3 and values["lean_edits"] and values["mass_kg"] > 0.0
    assert values["lean_tip_error_m"] == max(values["lean_rest_error_m"], values["lean_move_error_max_m"]) <= 2e-3
    assert "posture" in values["measured_in_move"] and "Another motion may differ" in values["note"]
    assert measured_anew(TWO_SECTIONS, load_scene(lean)) == pytest.approx(values["lean_tip_error_m"], rel=0.01)
