"""The envelope against `statics`, against moments by hand, and its command."""

from __future__ import annotations

import csv
import json
from itertools import product
from pathlib import Path

import numpy as np
import pytest
from command import main

from boom_twin import Scene, SolverError, load_scene, statics
from boom_twin.analysis.envelope import Envelope, envelope


@pytest.fixture(scope="module")
def boom() -> Scene:
    """Two sections of the default boom, the first of them with a height."""
    scene = load_scene()
    sections = (scene.sections[0].model_copy(update={"height": 0.2}), scene.sections[1])
    update = {"sections": sections, "joints": scene.joints[:2], "postures": {"flat": (0.0, 0.0), "up": (60.0, 20.0)}}
    return scene.model_copy(update=update)


@pytest.fixture(scope="module")
def found(boom: Scene) -> Envelope:
    return envelope(boom)


def test_every_named_posture_is_that_of_statics(boom: Scene, found: Envelope) -> None:
    assert found.names[:2] == ("flat", "up") and set(found.names[2:]) == {""}
    for row, name in enumerate(("flat", "up")):
        rest = statics(boom, posture=name, modes=3)
        assert found.tips[row] == pytest.approx(rest.tip, abs=1e-9)
        assert found.deflections[row] == pytest.approx(np.hypot(*(rest.tip - rest.tip_rigid)), abs=1e-9)
        assert found.forces[row] == pytest.approx(rest.cylinder_forces, rel=1e-9)
        assert found.frequencies[row] == pytest.approx(rest.frequencies, rel=1e-4)
        assert found.angles[row] == pytest.approx(boom.postures[name])


def test_the_grid_covers_the_ranges(boom: Scene, found: Envelope) -> None:
    relative = np.diff(found.angles, prepend=0.0, axis=1)
    for i, joint in enumerate(boom.joints):
        assert relative[:, i].min() == pytest.approx(joint.range_deg[0])
        assert relative[:, i].max() == pytest.approx(joint.range_deg[1])
    assert len(found.names) - found.searched + sum(found.skipped.values()) == 2 + 11**2


def test_extremes_between_the_postures_of_the_grid_are_found(boom: Scene, found: Envelope) -> None:
    """Against a grid three times as fine, which `statics` solves: the coarse one was 0.1 to 0.6 % short."""
    fine = [np.linspace(*joint.range_deg, 31) for joint in boom.joints]
    angles = [np.cumsum(relative) for relative in product(*fine)]
    forces = np.array([statics(boom, posture=f"{one},{two}", modes=1).cylinder_forces for one, two in angles])
    for own, best in ((found.forces.max(axis=0), forces.max(axis=0)), (-found.forces.min(axis=0), -forces.min(axis=0))):
        assert (own >= best - 1e-4 * np.abs(best)).all()
    row = int(found.forces[:, 0].argmin())
    assert row >= len(found.names) - found.searched
    assert statics(boom, posture=found.posture(row)).cylinder_forces[0] == pytest.approx(found.forces[row, 0], rel=2e-3)


def by_hand(boom: Scene) -> float:
    """Moment of all that lies outboard of the root of section 2, held there: the cylinder's lever is in the section before."""
    section = boom.sections[1]
    assert section.beam is not None and section.rho_A is not None and section.head is not None
    x0, x1 = section.beam
    return 9.81 * (section.rho_A * (x1 - x0) ** 2 / 2 + section.head.mass * (section.head.com[0] - x0))


def test_rigid_sections_have_moments_if_they_have_beams(
    boom: Scene, found: Envelope, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    rigid = envelope(boom.with_({"modes": 0}))
    assert -rigid.moments[0, 1] == pytest.approx(by_hand(boom), rel=1e-3)
    assert rigid.moments[:2] == pytest.approx(found.moments[:2], rel=5e-3)
    assert rigid.frequencies.shape[1] == 2 and rigid.stresses[0, 0] == pytest.approx(found.stresses[0, 0], rel=5e-3)
    block = {"length": 5.0, "root": {"mass": 100.0, "com": [2.5, 0.0], "inertia": 200.0}}
    path = tmp_path / "block.json"
    one = boom.model_dump(exclude_none=True) | {"modes": 0}
    path.write_text(json.dumps(one | {"sections": [one["sections"][0], block]}), encoding="utf-8")
    assert main(["envelope", str(path)]) == 0
    told = capsys.readouterr().out
    assert "section 1 bending moment" in told and "section 2 bending moment" not in told
    assert "No moments of section 2: it has no beam." in told and "No stresses" not in told


def test_moment_and_stress_at_the_root_are_those_by_hand(boom: Scene, found: Envelope) -> None:
    assert -found.moments[0, 1] == pytest.approx(by_hand(boom), rel=5e-3)
    inertia = boom.sections[0].I
    assert inertia is not None
    assert found.stresses[:, 0] == pytest.approx(np.abs(found.moments[:, 0]) * 0.1 / inertia)
    assert np.isnan(found.stresses[:, 1]).all()


def test_postures_out_of_travel_are_counted(boom: Scene) -> None:
    short = boom.joints[1].model_copy(update={"cylinder": boom.joints[1].cylinder.model_copy(update={"max_stroke": 0.2})})
    found = envelope(boom.model_copy(update={"joints": (boom.joints[0], short), "modes": 0}))
    assert found.skipped["out of a cylinder's travel"] > 20
    with pytest.raises(SolverError, match="none of"):
        none = short.model_copy(update={"cylinder": short.cylinder.model_copy(update={"max_stroke": 1e-4})})
        envelope(boom.model_copy(update={"joints": (boom.joints[0], none)}))


@pytest.fixture(scope="module")
def rigid(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A file of the guide's boom with heights and without modes, which is quick."""
    text = (Path(__file__).parents[2] / "examples" / "two_section_boom.yaml").read_text(encoding="utf-8")
    path = tmp_path_factory.mktemp("boom") / "boom.yaml"
    path.write_text(text.replace("beta: 1.0e-3", "height: 0.2") + "modes: 0\n", encoding="utf-8")
    return path


def test_the_command_names_worst_postures_and_writes_files(
    rigid: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    assert main(["envelope", str(rigid), "--out", str(out), "--json"]) == 0
    captured = capsys.readouterr()
    values = json.loads(captured.out)
    assert 0 < values["searched"] < values["postures"]
    assert json.loads((out / "envelope.json").read_text(encoding="utf-8")) == values
    with (out / "envelope.csv").open(encoding="utf-8") as stream:
        rows = list(csv.DictReader(stream))
    assert len(rows) == values["postures"] and rows[0]["posture"] == "reach"
    forces = [float(row["cylinder_2_force_N"]) for row in rows]
    assert max(forces) == pytest.approx(values["cylinder_2_force_N_greatest"], rel=1e-8)
    worst = rows[forces.index(max(forces))]
    assert [float(worst[f"section_{i + 1}_deg"]) for i in range(2)] == pytest.approx(
        values["cylinder_2_force_N_greatest_angles_deg"], rel=1e-8, abs=1e-8
    )
    assert (out / "envelope.png").read_bytes().startswith(b"\x89PNG")
