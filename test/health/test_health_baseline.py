"""Baselines: read, taken over, refused."""

from __future__ import annotations

import json

import pytest

from boom_twin.errors import UsageError
from boom_twin.health.baseline import Baseline, load_baseline

NAMES = ("cylinder_2.k:softer", "joint_1.sensor:bias")


def learnt() -> Baseline:
    covariance = [[2e-6, 1e-7], [1e-7, 1e-6]]
    return Baseline(names=NAMES, mean=[0.01, -2e-4], covariance=covariance, sessions=("a", "b"), angle_error=7e-5)


def test_without_a_file_nothing_is_learnt():
    assert load_baseline() == Baseline()


def test_written_and_read(tmp_path):
    path = tmp_path / "baseline.yaml"
    path.write_text(learnt().model_dump_json())
    assert load_baseline(path) == learnt()


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
    with pytest.raises(UsageError, match=r"baseline\.yaml.*msg_config"):
        load_baseline(path)


def test_no_file(tmp_path):
    with pytest.raises(UsageError, match=r"none\.yaml: No such file"):
        load_baseline(tmp_path / "none.yaml")
