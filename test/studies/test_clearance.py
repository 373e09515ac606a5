"""The study of play in the pins: the independent model agrees."""

from __future__ import annotations

from studies.clearance.convergence import convergence, one_pin
from studies.clearance.scenes import with_play

from boom_twin import Scene


def test_the_independent_model_agrees(two_sections: Scene) -> None:
    found = convergence(with_play(two_sections), True)
    assert [(line.program, line.against) for line in found.lines] == [
        ("boom_twin", "own"), ("boom_twin", "independent"), ("SciPy", "independent"),
    ]  # fmt: skip
    against = found.lines[1]
    assert against.errors[-1, 0] < 0.01 and against.errors[-1, 2] < 1.0
    assert not one_pin(with_play(two_sections), 0).is_flexible(0)
