"""Faults as they are written: what there is, what is refused and how it is told."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("exudyn")

from boom_twin import UsageError, load_scene
from boom_twin.validation.rig import Move, Programme
from boom_twin.validation.rig.faults import RigFault, check, drifting, parse


@pytest.mark.parametrize(
    "text, fault",
    [
        ("cylinder_2.k:softer:0.3", RigFault("cylinder_2.k", "softer", 0.3)),
        ("cylinder_1.sensor:stuck@12.5", RigFault("cylinder_1.sensor", "stuck", onset=12.5)),
        ("cylinder_2.k:softer:0.4@20+5", RigFault("cylinder_2.k", "softer", 0.4, 20.0, 5.0)),
        ("tip.payload:more:20@0+2..40", RigFault("tip.payload", "more", 20.0, 0.0, 2.0, 40.0)),
        ("cylinder_2.drive:drift:-0.0001@5..20", RigFault("cylinder_2.drive", "drift", -1e-4, 5.0, end=20.0)),
    ],
)
def test_text_and_back(text, fault):
    assert parse(text) == fault and str(fault) == text


@pytest.mark.parametrize(
    "text, told",
    [
        ("foo:bias:1", "fault foo: not a cause. Give one of cylinder_i.k, "),
        ("joint_1.sensor:bend:1", "joint_1.sensor:bend: not a kind of this cause. Give one of bias, drift, "),
        ("cylinder_2.k:softer:30", "size = 30, must be above 0 and below 1, a share"),
        ("tip.payload:more:x", "size, onset, ramp and end must be numbers. Write CAUSE:KIND"),
        ("tip.payload:more:20@5+2..7", "end = 7 s, must be after 7 s, when it is there in full"),
    ],
)
def test_refused(text, told):
    with pytest.raises(UsageError, match=told):
        parse(text)


@pytest.mark.parametrize(
    ("texts", "told"),
    [
        (["cylinder_5.k:softer:0.1"], r"cylinder_5\.k.*sections 1 to 4"),
        (["cylinder_1.k:softer:0.1@5", "cylinder_1.k:softer:0.2@9"], r"cylinder_1\.k changes by another fault too"),
        (["cylinder_2.drive:drift:0.05@50"], r"size = 0\.05, must be at most 0\.042 on this boom"),
        (["joint_4.sensor:bias:1@60"], "begins at 60 s, must be before the end at 60 s"),
        (["tip.payload:more:1e6"], "on this boom"),
        (["joint_angles.delay:late:3600"], "on this boom"),
    ],
)
def test_what_no_rig_can_have_is_refused(texts, told):
    check([parse("joint_4.sensor:bias:1@59")], load_scene(), 60.0)
    with pytest.raises(UsageError, match=told):
        check([parse(text) for text in texts], load_scene(), 60.0)


def test_a_leak_moves_the_drive_and_stays():
    programme = Programme((0.2, 0.3), (Move(0, 1.0, 2.0, 0.25),))
    times = np.linspace(0.0, 9.0, 91)
    leak = parse("cylinder_2.drive:drift:0.001@2..5")
    strokes, rates = drifting(programme, [leak, parse("cylinder_1.sensor:drift:0.001")])(times)
    still, pace = programme(times)
    assert np.array_equal(strokes[:, 0], still[:, 0]) and np.array_equal(rates[:, 0], pace[:, 0])
    assert strokes[:, 1] == pytest.approx(np.interp(times, [2.0, 5.0], [0.3, 0.303]), abs=1e-15)
    assert np.array_equal(rates[:, 1], np.where((times >= 2.0) & (times < 5.0), 0.001, 0.0))
