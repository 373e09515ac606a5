"""A report whose parts are made when they are asked for is any other report, and is encoded to the same bytes."""

from __future__ import annotations

import copy
import pickle
from dataclasses import fields, replace

import numpy as np
import pytest
from drive_twin import drive_twin
from studies.clearance.scenes import with_play

from boom_twin import Sample, Stream, load_scene
from boom_twin.config.settings import Settings
from boom_twin.messages.report_encoder import ReportEncoder
from boom_twin.messages.topic_table import Output
from boom_twin.scene.kinematics import strokes_of_posture
from boom_twin.scene.schema import Scene
from boom_twin.types import Prediction, Report


def reports(scene: Scene, count: int = 120) -> list[Report]:
    """Of strokes, angles, accelerations and forces, which come late too."""
    twin, random, rest = drive_twin(scene), np.random.default_rng(1), strokes_of_posture(scene, "arch")
    joints, found = len(scene.joints), []
    for k in range(count):
        stamp = 10**18 + k * 5_000_000
        move = 1e-3 * np.sin(0.05 * k)
        given = [
            Sample(Stream.ANGLES, stamp + 1000, random.normal(size=joints)),
            Sample(Stream.STROKES, stamp, rest + move + random.normal(0.0, 2e-5, joints)),
            Sample(Stream.IMU, stamp, np.array([np.nan if k == 7 else 0.1, 9.8])),
            Sample(Stream.FORCES, stamp, random.normal(size=joints) * 1e4),
        ]
        found += [twin.update(each) for each in given]
    return found


def plain() -> list[Sample]:
    """Strokes and angles in turn."""
    random, rest, found = np.random.default_rng(2), strokes_of_posture(load_scene(), "arch"), []
    for k in range(50):
        found.append(Sample(Stream.STROKES, 10**18 + k * 5_000_000, rest + random.normal(0.0, 2e-5, 4)))
        found.append(Sample(Stream.ANGLES, 10**18 + k * 5_000_000, random.normal(size=4)))
    return found


@pytest.fixture(scope="module")
def given() -> list[Report]:
    return reports(load_scene())


def is_made(report: Report, name: str) -> bool:
    """Whether the field is there already."""
    try:
        object.__getattribute__(report, name)
    except AttributeError:
        return False
    return True


def test_nothing_is_made_that_nobody_asks_for() -> None:
    encoder, found = ReportEncoder(load_scene(), Settings()), reports(load_scene(), 10)
    for report in found:
        encoder.fill(report)
        assert report.is_predicted or report.has_residuals or not report.events or not report.accepted
    quiet = [report for report in found if report.rows is not None and report.rows.outline is None]
    assert len(quiet) > 20
    assert not any(is_made(report, name) for report in quiet for name in ("prediction", "estimate", "residuals"))


def test_what_is_made_is_kept(given: list[Report]) -> None:
    report = next(each for each in given if each.rows is not None and each.is_predicted)
    assert isinstance(report.prediction, Prediction) and report.prediction is report.prediction
    assert report.estimate is not None and report.estimate is report.estimate
    with pytest.raises(AttributeError, match="Report has no tip"):
        _ = report.tip


def test_it_is_any_other_report(given: list[Report]) -> None:
    """Made anew, sent to another process, told as text."""
    for report in given[-40:]:
        made, sent = replace(report), pickle.loads(pickle.dumps(report))
        assert made.rows is None and sent.rows is None and report.rows is not None
        assert repr(made) == repr(report) == repr(sent)
        assert made.is_predicted == report.is_predicted and made.has_residuals == report.has_residuals
        assert [field.name for field in fields(report)] == [field.name for field in fields(made)]


def test_it_keeps_what_it_was_made_of() -> None:
    """Samples that come later change nothing: made long after, it is what it is when made at once."""
    at_once = [repr(replace(report)) for report in map(drive_twin(load_scene()).update, plain())]
    assert [repr(report) for report in list(map(drive_twin(load_scene()).update, plain()))] == at_once


@pytest.mark.parametrize("is_worn", [False, True])
def test_rows_are_encoded_as_what_is_made_of_them(is_worn: bool, given: list[Report]) -> None:
    """To the byte, wherever an outline, residuals that waited and missing values come."""
    scene = with_play(load_scene()) if is_worn else load_scene()
    found = reports(scene, 30) if is_worn else given
    straight, made = (ReportEncoder(scene, Settings()) for _ in range(2))
    told = set()
    for report in found:
        messages = straight.fill(report)
        assert messages == made.fill(replace(report))
        told |= {(key, len(data)) for key, data in messages}
    assert {key for key, _ in told} >= {Output.SHAPE, Output.RESIDUALS, Output.ESTIMATE_POSE, Output.TIP_POSITION}
    assert len([key for key, _ in told if key is Output.JOINT_STATES]) == 2
    assert len([key for key, _ in told if key is Output.RESIDUALS]) == 4


def test_only_what_is_wanted_is_encoded_of_rows(given: list[Report]) -> None:
    one, other = (ReportEncoder(load_scene(), Settings()) for _ in range(2))
    for report in given[:20]:
        everything = one.fill(report)
        for wanted in (Output.TIP_POSITION, Output.ESTIMATE_LOAD, Output.RESIDUALS):
            assert other.fill(report, wanted.__eq__) == [each for each in everything if each[0] is wanted]
        assert other.fill(report, lambda output: False) == []


def test_a_copy_of_a_twin_goes_on_by_itself() -> None:
    """It shares nothing with the one that it was made of, which goes on, or is gone."""
    samples = plain()
    twin = drive_twin(load_scene())
    whole = [repr(twin.update(sample)) for sample in samples]
    twin = drive_twin(load_scene())
    for sample in samples[:60]:
        twin.update(sample)
    other = copy.deepcopy(twin)
    for sample in reversed(samples):
        twin.update(sample)
    del twin
    assert [repr(other.update(sample)) for sample in samples[60:]] == whole[60:]
