"""The study of play in the pins: its scenes, its drive, its measures, its files."""

from __future__ import annotations

import numpy as np
import pytest
from studies.clearance.convergence import convergence, one_pin
from studies.clearance.rest_stop_cost import shifts, swings
from studies.clearance.scenes import ideal, pins_of, rods_and_joints, treated, with_play

from boom_twin import Scene, load_scene
from boom_twin.scene.schema import IDEAL_BELOW


def test_a_scene_without_play_gets_the_package_s_pins(two_sections: Scene) -> None:
    scene = with_play(two_sections)
    assert [pin.at for pin in pins_of(scene).pins] == ["cylinder_1.rod", "cylinder_2.rod"]
    assert with_play(scene) == scene and ideal(scene) == two_sections
    assert pins_of(treated(scene, "spring-damper")).treatment == "spring-damper"
    assert len(rods_and_joints(load_scene())) == 17


def test_play_at_rest_follows_the_lever_down_to_the_switch(two_sections: Scene) -> None:
    found = shifts(with_play(two_sections), ("low",), 4)
    assert [own.pin for own in found] == ["cylinder_1.rod", "cylinder_2.rod"]
    for own in found:
        assert own.clearances[-1] == IDEAL_BELOW and np.all(np.diff(own.shifts) < 0.0)
        assert own.ratios == pytest.approx(1.0, abs=0.01)
        assert own.loaded == pytest.approx(own.lever, rel=0.05)
        assert own.jump == own.shifts[-1] > 0.0


def test_swings_of_a_stop(two_sections: Scene) -> None:
    found = {own.model: own for own in swings(with_play(two_sections), ("arch",), 0.3)}
    assert list(found) == ["ideal", "contact", "spring-damper"]
    assert found["ideal"].rest == 0.0 and found["contact"].rest == found["spring-damper"].rest < 0.0
    assert all(own.peak > own.rms > 0.0 and own.effective > 0.0 for own in found.values())


def test_the_independent_model_agrees(two_sections: Scene) -> None:
    found = convergence(with_play(two_sections), True)
    assert [(line.program, line.against) for line in found.lines] == [
        ("boom_twin", "own"), ("boom_twin", "own"), ("boom_twin", "independent"), ("SciPy", "independent"),
    ]  # fmt: skip
    against = found.lines[2]
    assert against.errors[-1, 0] < 0.01 and against.errors[-1, 2] < 1.0
    assert not one_pin(with_play(two_sections), 0).is_flexible(0)
