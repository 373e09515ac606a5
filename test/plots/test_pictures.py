"""Pictures of a boom, its envelope, alarms and journals: what is drawn, and the geometry it is drawn from."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import boom_twin.plots.envelope as envelope_drawing
import boom_twin.plots.health as health_drawing
from boom_twin import Scene, load_scene
from boom_twin.analysis.envelope import Envelope
from boom_twin.analysis.undeflected import UndeflectedBoom
from boom_twin.compiler.compile import compile_scene
from boom_twin.plots import AlarmSpan
from boom_twin.plots.history import Orbits
from boom_twin.plots.posture import orbits_picture
from boom_twin.scene.kinematics import posture_angles, skeleton, strokes_of_posture

SCENE, ROWS = load_scene(), 40


@pytest.mark.parametrize("name", ["horizontal", "arch", "high", "low"])
def test_pins_agree_with_lengths_and_strokes(name: str) -> None:
    bones, strokes = skeleton(SCENE, posture_angles(SCENE, name)), strokes_of_posture(SCENE, name)
    for joint, part, stroke in zip(bones.joints, SCENE.joints, strokes, strict=True):
        length = np.hypot(*(joint.rod_pin - joint.barrel_pin))
        assert length == pytest.approx(part.cylinder.closed_length + stroke, abs=1e-9)
        if joint.d is not None and joint.e is not None and joint.q is not None:
            assert np.hypot(*(joint.q - joint.d)) == pytest.approx(part.lL, abs=1e-9)
            assert np.hypot(*(joint.q - joint.e)) == pytest.approx(part.lR, abs=1e-9)
            over, out = joint.e - joint.d, joint.q - joint.d
            assert over[0] * out[1] - over[1] * out[0] > 0.0, "Q is not to the left of D->E"
    sides = [part.length * np.exp(1j * np.radians(up)) for part, up in zip(SCENE.sections, SCENE.postures[name], strict=True)]
    assert complex(*bones.pivots[-1]) == pytest.approx(complex(*SCENE.base.pivot) + sum(sides), abs=1e-12)


def test_undeformed_outline_lies_on_the_sections() -> None:
    angles = posture_angles(SCENE, "arch")
    line, bones = UndeflectedBoom(SCENE, compile_scene(SCENE)).at(angles), skeleton(SCENE, angles)
    assert line[-1] == pytest.approx(bones.pivots[-1], abs=1e-9)
    along = np.diff(bones.pivots, axis=0)
    for point in line:
        shares = np.clip(np.sum((point - bones.pivots[:-1]) * along, axis=1) / np.sum(along**2, axis=1), 0.0, 1.0)
        assert np.hypot(*(point - bones.pivots[:-1] - shares[:, None] * along).T).min() < 1e-9


def envelope_of(scene: Scene) -> Envelope:
    """Made-up numbers as a boom of 28 m has them, one posture next to 0 degrees from below."""
    rng, n = np.random.default_rng(4), len(scene.sections)
    angles = rng.uniform(-400.0, 180.0, (ROWS, n))
    angles[0] = -0.03
    tips = rng.uniform(-15.0, 15.0, (ROWS, 2))
    forces = rng.uniform(-1430e3, 973e3, (ROWS, n)) * np.array([0.2, 1.0, 0.3, 0.1])
    stresses = rng.uniform(8e4, 1.7e8, (ROWS, n))
    frequencies = np.sort(rng.uniform(0.5, 6.0, (ROWS, 3)))
    deflections = rng.uniform(0.0, 1.4, ROWS)
    return Envelope(("",) * ROWS, angles, tips, deflections, forces, frequencies, stresses * 1e-3, stresses, {}, 0)


def test_words_fit_beside_the_bars_of_an_envelope_and_its_legend_covers_nothing(
    tmp_path: Path, figures_of: Callable[..., list[Any]]
) -> None:
    figures, found = figures_of(envelope_drawing), envelope_of(SCENE)
    assert found.posture(0) == "0,0,0,0", "an angle next to zero has no minus"
    found.frequencies[found.deflections.argmax(), 0] = 0.1  # the worst in two ways
    ranges = [(f"cylinder {i + 1} force, kN", 1e-3 * found.forces[:, i]) for i in range(4)]
    ranges += [(f"section {i + 1} bending stress, MPa", 1e-6 * found.stresses[:, i]) for i in range(4)]
    envelope_drawing.envelope_picture(tmp_path / "envelope.png", SCENE, found, ranges)
    tips, *bars = [axes for axes in figures[0].axes if axes.get_ylabel() == "y up, m" or axes.get_xlabel() in ("kN", "MPa")]
    assert len(bars) == 2 and tips.get_legend().get_window_extent().y0 >= tips.get_window_extent().y1
    labels = [text.get_text().partition(":")[0] for text in tips.get_legend().get_texts()]
    assert [label for label in labels if "largest" in label] == ["largest deflection and lowest frequency", "largest stress"]
    forces, stresses = (axes.get_xticks() for axes in bars)
    assert forces.min() < 0.0 and stresses.min() == 0.0, "stresses are not negative, so their axis begins at 0"
    for axes in bars:
        frame, words = axes.get_window_extent(), [text for text in axes.texts if text.get_text()]
        assert len(words) == 8 and not any("e+" in each.get_text() for each in words)
        for each in words:
            extent = each.get_window_extent()
            assert frame.x0 <= extent.x0 and extent.x1 <= frame.x1, each.get_text()


@pytest.mark.parametrize("count", [0, 12])
def test_every_alarm_has_a_row_with_its_channel_and_label(
    tmp_path: Path, figures_of: Callable[..., list[Any]], count: int
) -> None:
    figures = figures_of(health_drawing)
    alarms = [AlarmSpan(f"joint_{i + 1}", 0.5 * i, 9.0, "deviation") for i in range(count)]
    health_drawing.timeline_picture(tmp_path / "timeline.png", "session", 10.0, alarms, "synthetic")
    (axes,) = figures[0].axes
    assert [label.get_text() for label in axes.get_yticklabels()] == [alarm.channel for alarm in alarms]
    assert [text.get_text() for text in axes.texts] == (["deviation"] * count or ["no alarm"])
    assert axes.get_xlim() == (0.0, 10.0)


@pytest.mark.parametrize("pins, instants", [(1, 50), (17, 1)])
def test_journals_of_every_pin_are_drawn_and_the_same_bytes_again(tmp_path: Path, pins: int, instants: int) -> None:
    turn = np.linspace(0.0, 6.0, instants)
    rows = np.stack([1e-4 * np.cos(turn), 1e-4 * np.sin(turn), 1e3 + turn, (turn < 4.0).astype(float)], axis=1)
    names, gaps, lost = tuple(f"cylinder_{i + 1}.rod" for i in range(pins)), np.full(pins, 1e-4), np.ones(pins, np.int64)
    orbits = Orbits(np.linspace(0.0, 1.0, instants), names, gaps, np.tile(rows[:, None], (1, pins, 1)), lost)
    for name in ("a.png", "b.png"):
        orbits_picture(tmp_path / name, "journals", orbits)
    first, second = ((tmp_path / name).read_bytes() for name in ("a.png", "b.png"))
    assert first == second and first[:4] == b"\x89PNG"
