"""Booms that are not those of their scene: physical faults, and parameters off at random."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from default_boom import parameter_names
from oracle import booms

pytest.importorskip("exudyn")

from default_boom import parameter, strokes_of_posture

from boom_twin import Scene, UsageError, load_scene
from boom_twin.validation.rig import Move, Programme, Sensors, record, simulate, statics
from boom_twin.validation.rig.faults import changes, parse, with_faults, wrong_by


def ratios(changed: Scene, scene: Scene) -> dict[str, float]:
    """New over old of every parameter that has a name and is not 0."""
    names = [name for name in parameter_names(scene) if parameter(scene, name)]
    return {name: parameter(changed, name) / parameter(scene, name) for name in names}


def test_faults_add_to_what_is_there():
    scene = with_faults(load_scene(), [parse("tip.payload:more:60"), parse("line_fill:more:2")])
    more = with_faults(scene, [parse("tip.payload:more:5"), parse("joint_1.sensor:bias:1")])
    less = with_faults(scene, [parse("tip.payload:less:20"), parse("line_fill:less:2")])
    assert (more.tip.payload, more.line_fill) == (65.0, 2.0) and less.tip.payload == 40.0 and not less.line_fill
    with pytest.raises(UsageError, match=r"cylinder_1\.k: the scene has no such parameter"):
        with_faults(booms.scene_of(booms.one_rigid()), [parse("cylinder_1.k:softer:0.3")])


CAUSES = ["cylinder_2.k:softer:0.4", "section_3.EI:softer:0.4", "tip.payload:more:20", "line_fill:more:2"]


@pytest.mark.parametrize("text", CAUSES)
def test_changes_over_a_time_to_the_equilibrium_of_the_changed_boom_and_back(text):
    """Slowly, with 4 elements a section; what is left is the swing that a change of some seconds leaves."""
    scene, fault = load_scene(), parse(f"{text}@0.5+4..7")
    strokes = strokes_of_posture(scene, "arch")
    start, changing = changes(scene, [fault])
    rows = simulate(start, Programme(tuple(strokes), ()), 13.0, 5e-3, 5e-3, 4, changes=changing)
    tip, times = rows["tip"], rows["t"]
    healthy, faulty = (statics(boom, strokes, 4)["tip"] for boom in (scene, with_faults(scene, [fault])))
    assert tip[0] == pytest.approx(healthy, abs=1e-8)
    moved = np.hypot(*(faulty - healthy))
    for first, last, expected in ((5.0, 7.0, faulty), (11.5, 13.0, healthy)):
        found = tip[(times > first) & (times < last)].mean(axis=0)
        assert np.hypot(*(found - expected)) < 0.03 * moved, (first, moved)


def test_stamps_and_noise_do_not_see_the_fault():
    scene, sensors = booms.scene_of(booms.one_rigid(k=2.0e6)), replace(Sensors(), angle_resolution=0.0, stroke_resolution=0.0)
    programme = Programme((0.5,), (Move(0, 0.1, 0.3, 0.52),))
    soft = with_faults(scene, [parse("cylinder_1.k:softer:0.5")])
    one, other = (record(boom, programme, 0.5, sensors, 7, 1e-3) for boom in (scene, soft))
    assert np.array_equal(one.stamps, other.stamps) and np.array_equal(one.truth["drives"], other.truth["drives"])
    assert np.abs(one.truth["joints"] - other.truth["joints"])[0] > 1e-4
    for name in ("joints", "strokes"):
        noise = [getattr(session, name) - session.truth[name] for session in (one, other)]
        assert noise[0] == pytest.approx(noise[1], abs=1e-14), name


def test_wrong_within_twice_the_share_and_repeatable():
    scene = load_scene()
    found = [wrong_by(scene, 0.02, seed) for seed in range(40)]
    assert found[3] == wrong_by(scene, 0.02, 3) != found[4]
    assert wrong_by(scene, 0.0, 1) == scene
    off = np.array([list(ratios(boom, scene).values()) for boom in found]) - 1.0
    moved = off[:, np.any(off, axis=0)]
    assert moved.shape[1] == 16  # k, d, EI and mass, four times each
    assert np.abs(off).max() < 0.04 and moved.std() == pytest.approx(0.02 * 0.88, rel=0.1)
    assert np.abs(np.corrcoef(moved.T) - np.eye(16)).max() < 0.6
    links = [boom.joints[1].mL / scene.joints[1].mL - 1.0 for boom in found]
    rods = [boom.joints[3].cylinder.rod.mass / scene.joints[3].cylinder.rod.mass - 1.0 for boom in found]
    assert 0.01 < np.std(links) < 0.03 and 0.01 < np.std(rods) < 0.03
    assert found[0].base == scene.base and found[0].sections[1].beta == scene.sections[1].beta
