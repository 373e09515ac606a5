"""Input that cannot be calibrated from gives one clear error."""

from __future__ import annotations

import numpy as np
import pytest
from default_boom import strokes_of_posture
from recordings import write_session

from boom_twin import BagError, UsageError, load_scene
from boom_twin.calibration import Choice, calibrate
from boom_twin.validation import rig

SECOND = 200  # rows


def test_an_unknown_parameter(short, two_sections, tmp_path):
    bag = short.write(tmp_path / "bag", 0)
    with pytest.raises(UsageError, match=r"cylinder_3\.k: .* no such parameter\. It has cylinder_1\.k.*joint_2\.zero"):
        calibrate([bag], two_sections, Choice(names=("cylinder_3.k",)))
    with pytest.raises(UsageError, match="named 2 times"):
        calibrate([bag], two_sections, Choice(names=("cylinder_1.k", "cylinder_1.k")))


def test_a_session_that_is_too_short(short, two_sections, tmp_path):
    bag = short.write(tmp_path / "bag", 0, cut=slice(0, 5 * SECOND))
    with pytest.raises(BagError, match=r"bag: the boom rests for .* s in the part that is fitted.*5 s are needed"):
        calibrate([bag], two_sections)


def test_a_session_of_a_node_without_the_namespace(short, two_sections, tmp_path):
    with pytest.raises(BagError, match="/front/cylinder_strokes"):
        calibrate([short.write(tmp_path / "bag", 0)], two_sections, namespace="front")


def test_nothing_is_told_of_a_boom_that_stands_still(two_sections, tmp_path):
    stamps = 10**18 + 5_000_000 * np.arange(30 * SECOND)
    strokes = np.tile(strokes_of_posture(two_sections, "arch"), (len(stamps), 1))
    write_session(tmp_path / "bag", stamps, strokes, np.full_like(strokes, np.nan), None, {})
    with pytest.raises(UsageError, match="the sessions tell none of the parameters"):
        calibrate([tmp_path / "bag"], two_sections, Choice(zeros="none"))


def test_sessions_of_another_boom(short, two_sections, tmp_path):
    bag = short.write(tmp_path / "bag", 0)
    with pytest.raises(BagError, match=r"never names cylinder_3, cylinder_4, but cylinder_1, cylinder_2; the scene has 4"):
        calibrate([bag], load_scene())
    cylinder = two_sections.joints[1].cylinder.model_copy(update={"max_stroke": 0.05})
    joint = two_sections.joints[1].model_copy(update={"cylinder": cylinder})
    other = two_sections.model_copy(update={"joints": (two_sections.joints[0], joint)})
    with pytest.raises(BagError, match=r"cylinder_2 reads .* the scene's travels 0 to 0.05 m"):
        calibrate([bag], other)


def test_a_session_that_never_rests(two_sections, tmp_path):
    stamps = 10**18 + 5_000_000 * np.arange(30 * SECOND)
    swing = 0.02 * np.sin(np.arange(len(stamps)) / 30.0)
    strokes = strokes_of_posture(two_sections, "arch") + swing[:, None]
    write_session(tmp_path / "bag", stamps, strokes, np.zeros_like(strokes), None, {})
    with pytest.raises(BagError, match=r"the boom rests for 0\.0 s"):
        calibrate([tmp_path / "bag"], two_sections)


def test_sessions_of_lengths_and_of_drives(short, two_sections, tmp_path):
    bags = [short.write(tmp_path / name, 0, drives=name == "b") for name in ("a", "b")]
    with pytest.raises(UsageError, match=r"read drives, those of .* lengths\. Calibrate the two apart"):
        calibrate(bags, two_sections)


def test_missing_values_are_left_out(short, two_sections, tmp_path):
    rng = np.random.default_rng(0)
    lost = np.where(rng.random((30 * SECOND, 2)) < 0.02, np.nan, 0.0)
    found = calibrate([short.write(tmp_path / "bag", 3, zeros=lost)], two_sections, Choice(zeros="angles"))
    assert found.misfit < 1.15 and found.after.spread[0] == pytest.approx(1.0, abs=0.2)


def test_a_moving_load_or_fault_is_told_by_the_misfit(short, two_sections, tmp_path):
    drift = np.linspace(0.0, 0.01, 30 * SECOND)[:, None] * [1.0, 0.0]
    found = calibrate([short.write(tmp_path / "bag", 3, zeros=drift)], two_sections)
    assert found.misfit > 1.5 and "readings of joint_1" in found.remarks[0]


def test_what_cannot_be_told_apart_is_named_and_left(short, two_sections, tmp_path):
    """One cylinder moves a little: the others' stiffness and zeros look alike."""
    first = strokes_of_posture(two_sections, "arch")
    programme = rig.Programme(tuple(first), (rig.Move(1, 5.0, 2.0, first[1] + 0.015),))
    session = rig.record(short.truth, programme, 24.0, seed=1, step=1e-3, elements=8)
    write_session(tmp_path / "bag", session.stamps, session.strokes, session.joints, None, {})
    with pytest.raises(
        UsageError, match=r"joint_1\.zero, cylinder_1\.zero: these sessions cannot tell them apart\. Left as before"
    ):
        calibrate([tmp_path / "bag"], two_sections)
