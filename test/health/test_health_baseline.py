"""Baselines: read, taken over, refused."""

from __future__ import annotations

import json

import numpy as np
import pytest
from health.gaussian import covariance_of

from boom_twin import load_scene
from boom_twin.errors import UsageError
from boom_twin.health.baseline import Baseline, load_baseline
from boom_twin.health.inference.fault_catalogue import parameters, variances

KNOWN = parameters(load_scene())
NAMES = ("cylinder_2.k:softer", "joint_1.sensor:bias")


def learnt() -> Baseline:
    covariance = 1e-6 * covariance_of(np.random.default_rng(1), 2)
    return Baseline(names=NAMES, mean=[0.01, -2e-4], covariance=covariance.tolist(), sessions=("a", "b"), angle_error=7e-5)


def test_without_a_file_nothing_is_learnt():
    mean, covariance = load_baseline().healthy(KNOWN)
    assert load_baseline() == Baseline() and not mean.any()
    assert covariance == pytest.approx(np.diag(variances(KNOWN, "healthy")))


def test_written_and_read(tmp_path):
    path = tmp_path / "baseline.yaml"
    path.write_text(learnt().model_dump_json())
    assert load_baseline(path) == learnt()


def test_what_was_learnt_takes_its_place():
    baseline, at = learnt(), [[each.name for each in KNOWN].index(name) for name in NAMES]
    mean, covariance = baseline.healthy(KNOWN)
    assert mean[at].tolist() == baseline.mean and np.count_nonzero(mean) == 2
    assert covariance[np.ix_(at, at)] == pytest.approx(np.array(baseline.covariance))
    others = np.delete(np.arange(len(KNOWN)), at)
    assert not covariance[np.ix_(at, others)].any()
    assert np.diag(covariance)[others] == pytest.approx(variances(KNOWN, "healthy")[others])


def test_channels():
    baseline = Baseline(angle_error=1e-4, force_error=0.1, angle_noise=1.1, force_noise=2.0)
    assert baseline.errors(3).tolist() == [1e-4, 1e-4, 1e-4, 0.1, 0.1]
    assert baseline.noise(3).tolist() == [1.1, 1.1, 1.1, 2.0, 2.0]


@pytest.mark.parametrize(
    "changes, told",
    [
        ({"angle_error": -1.0}, r"angle_error = -1\.0"),
        ({"detuning": 0.0}, r"detuning = 0\.0"),
        ({"force_noise": float("inf")}, "force_noise"),
        ({"mean": [float("nan"), 0.0]}, r"mean\.0"),
        ({"colour": 3}, "colour.*Known parameters: .*angle_error"),
        ({"names": "abc"}, "names"),
    ],
)
def test_a_value_that_cannot_be(tmp_path, changes, told):
    path = tmp_path / "baseline.yaml"
    path.write_text(json.dumps({**learnt().model_dump(), **changes}).replace("NaN", ".nan").replace("Infinity", ".inf"))
    with pytest.raises(UsageError, match=rf"(?s)baseline\.yaml.*{told}"):
        load_baseline(path)


@pytest.mark.parametrize("text", ["", "[1, 2]", "just words", "a: [", "\x00"])
def test_a_file_that_is_no_baseline(tmp_path, text):
    path = tmp_path / "baseline.yaml"
    path.write_text(text)
    with pytest.raises(UsageError, match=r"baseline\.yaml.*calibrate --baseline"):
        load_baseline(path)


def test_no_file(tmp_path):
    with pytest.raises(UsageError, match=r"none\.yaml: No such file"):
        load_baseline(tmp_path / "none.yaml")


def test_of_another_boom():
    with pytest.raises(UsageError, match=r"this boom has no cylinder_9\.k:softer\. Learn a baseline with its own scene"):
        Baseline(names=("cylinder_9.k:softer",), mean=[0.0], covariance=[[1.0]]).healthy(KNOWN)


@pytest.mark.parametrize("changes", [{"mean": [0.0]}, {"covariance": [[1.0, 0.0]]}, {"covariance": [[1.0], [1.0]]}])
def test_sizes_that_do_not_agree(changes):
    with pytest.raises(UsageError, match="mean and covariance are not of the size of names"):
        learnt().model_copy(update=changes).healthy(KNOWN)


@pytest.mark.parametrize("covariance", [[[1.0, 2.0], [2.0, 1.0]], [[1.0, 0.5], [0.0, 1.0]], [[-1.0, 0.0], [0.0, 1.0]]])
def test_a_covariance_that_is_none(covariance):
    with pytest.raises(UsageError, match="covariance"):
        learnt().model_copy(update={"covariance": covariance}).healthy(KNOWN)
