"""The model of another load is made beside the samples, and a twin that repeats the change gives the same to the bit."""

from __future__ import annotations

from threading import current_thread
from typing import Any

import numpy as np
import pytest
from default_boom import strokes_of_posture
from drive_twin import drive_twin

from boom_twin import Report, Sample, Stream, Twin, load_scene
from boom_twin.twin import loaded_model
from boom_twin.twin.loaded_model import ModelPreparation

from .test_changes import equal

STEP = 5_000_000  # ns


@pytest.fixture
def makers(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """The threads in which models are made."""
    found: list[str] = []
    original = loaded_model.BoomPredictor

    def noted(*arguments: Any) -> Any:
        found.append(current_thread().name)
        return original(*arguments)

    monkeypatch.setattr(loaded_model, "BoomPredictor", noted)
    return found


def samples(count: int) -> list[Sample]:
    strokes, noise = strokes_of_posture(load_scene(), "arch"), np.random.default_rng(2).normal(0.0, 2e-5, (count, 4))
    return [Sample(Stream.STROKES, k * STEP, strokes + noise[k]) for k in range(count)]


def driven(twin: Twin, preparation: ModelPreparation, asked: dict[int, Any], rows: list[Sample]) -> list[Report]:
    """Asks before samples of these numbers; at the 100th the model is waited for."""
    reports = []
    for k, sample in enumerate(rows):
        if k in asked:
            preparation.tune(asked[k])
        if k == 100 and preparation._thread is not None:
            preparation._thread.join()
        preparation.take_in()
        reports.append(twin.update(sample))
    return reports


def test_no_sample_waits_for_the_model_of_another_load_and_a_replay_repeats_it(makers: list[str]) -> None:
    rows, twin = samples(160), drive_twin(load_scene(), health=True)
    reports = driven(twin, ModelPreparation(twin), {50: {"payload": 40.0}}, rows)
    assert makers == ["MainThread", "model"]
    changes = [report.change for report in reports if report.change is not None]
    assert [change.settings["payload"] for change in changes] == [-1.0, 40.0]
    assert 50 * STEP <= changes[1].stamp <= 100 * STEP and changes[1].from_rest
    other = drive_twin(load_scene(), health=True)
    for sample, report in zip(rows, reports, strict=True):
        if report.change is not None:
            other.requests.repeat(report.change)
        assert equal(report, other.update(sample))
