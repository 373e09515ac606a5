"""Drive programmes: smooth, in range, slow enough."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("exudyn")

from default_boom import joint_angles_of_strokes

from boom_twin import UsageError, load_scene
from boom_twin.scene.kinematics import stroke_range
from boom_twin.validation.rig import BUNDLED_DURATION, Move, Programme, bundled, random_programme, through_postures
from boom_twin.validation.rig.motion import RANGE_SAMPLES, TIP_SPEED, tip_speed

SCENE = load_scene()


@pytest.fixture(scope="module", params=["bundled", 0, 1, 2])
def programme(request):
    """The bundled one, and random ones by their seeds."""
    return bundled(SCENE) if request.param == "bundled" else random_programme(SCENE, "arch", 60.0, request.param)


def test_move_starts_and_ends_where_told():
    programme = Programme((0.1, 0.2), (Move(1, 4.0, 1.0, 0.3), Move(1, 1.0, 2.0, 0.5)))
    strokes, rates = programme(np.array([0.0, 1.0, 2.0, 3.0, 4.0, 4.5, 9.0]))
    assert strokes[:, 0] == pytest.approx(0.1)
    assert strokes[:, 1] == pytest.approx([0.2, 0.2, 0.35, 0.5, 0.5, 0.4, 0.3])
    assert rates[[0, 1, 3, 4, 6]] == pytest.approx(0.0)
    assert rates[2, 1] == pytest.approx(1.875 * 0.3 / 2.0)


def test_overlapping_moves_are_refused():
    with pytest.raises(UsageError, match="moves of cylinder_1: the one at 2 s starts before"):
        Programme((0.0,), (Move(0, 1.0, 2.0, 0.2), Move(0, 2.0, 1.0, 0.1)))


def test_programmes_stay_in_range_and_slow_enough(programme):
    strokes = programme(np.linspace(0.0, 60.0, 121))[0]
    for cylinder in range(4):
        low, high = stroke_range(SCENE, cylinder, RANGE_SAMPLES)
        assert low < strokes[:, cylinder].min() and strokes[:, cylinder].max() < high
    assert np.isfinite([joint_angles_of_strokes(SCENE, row) for row in strokes[::10]]).all()  # raises if out of reach
    fastest = tip_speed(SCENE, programme, np.linspace(0.0, 60.0, 601)).max()
    assert 0.3 < fastest < 1.3


def test_holds_and_moves_last_as_long_as_asked():
    moves = random_programme(SCENE, "arch", 60.0, 0, (0.7, 4.0), (0.5, 2.0)).moves
    starts, ends = (np.unique([getattr(each, name) for each in moves]) for name in ("start", "end"))
    spans, holds = ends - starts, starts[1:] - ends[:-1]
    assert len(spans) > 10 and 0.5 <= spans.min() < spans.max() <= 2.0 and 0.7 <= holds.min() < holds.max() <= 4.0
    assert 0.7 <= 60.0 - ends[-1] <= 6.0


@pytest.mark.parametrize("sections", [1, 2, 3])
def test_another_boom_makes_moves_within_its_own_ranges(sections):
    postures = {"low": SCENE.postures["arch"][:sections]}
    scene = SCENE.model_copy(
        update={"sections": SCENE.sections[:sections], "joints": SCENE.joints[:sections], "postures": postures}
    )
    times, drive = np.linspace(0.0, BUNDLED_DURATION, 401), bundled(scene)
    strokes, _ = drive(times)
    for i in range(sections):
        low, high = stroke_range(scene, i, RANGE_SAMPLES)
        assert low <= strokes[:, i].min() < strokes[:, i].max() <= high
    assert np.ptp(strokes, axis=0).max() > 0.1 and tip_speed(scene, drive, times).max() <= TIP_SPEED
    with pytest.raises(UsageError, match="no posture to start from"):
        bundled(scene.model_copy(update={"postures": {}}))


def test_moves_through_postures_rest_in_each_and_keep_the_acceleration_of_the_tip():
    programme = through_postures(SCENE, ["arch", "low", "arch"], 60.0, 0.4)
    times = np.linspace(0.0, 60.0, 6001)
    acceleration = np.diff(tip_speed(SCENE, programme, times)) / 0.01
    assert 0.2 < np.abs(acceleration).max() < 0.41
    moving = np.abs(programme(times)[1]).max(axis=1) > 0.0
    starts = times[np.flatnonzero(np.diff(moving.astype(int)) == 1)]
    stops = times[np.flatnonzero(np.diff(moving.astype(int)) == -1)]
    assert len(starts) == len(stops) == 2
    rests = np.array([starts[0], starts[1] - stops[0], 60.0 - stops[1]])
    assert rests == pytest.approx(rests.mean(), abs=0.03)
    assert programme(np.array([30.0]))[0][0] == pytest.approx(through_postures(SCENE, ["low"], 60.0, 0.4).first)


def test_moves_that_take_longer_than_the_session_are_refused():
    with pytest.raises(UsageError, match="duration = 9 s"):
        through_postures(SCENE, ["arch", "low"], 9.0, 0.4)
    with pytest.raises(UsageError, match=r"--through: '60' is no posture of the scene\. Give names, of "):
        through_postures(SCENE, ["arch", "60", "30"], 60.0, 0.4)
