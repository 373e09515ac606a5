"""A long session goes through in stretches: the same figures as at once, and memory that hardly grows."""

from __future__ import annotations

import tracemalloc
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from drive_twin import ARCH_DRIVES, drive_twin
from health.recorded import written
from recordings import scene_of

from boom_twin import Settings, Stream, load_scene
from boom_twin.bag.session_model import scene_from
from boom_twin.offline import history, recording
from boom_twin.offline.recording import Recording, Stretch
from boom_twin.plots import History
from boom_twin.report import evaluation
from boom_twin.report.evaluation import Evaluation, evaluated_replay
from boom_twin.report.quantities import read
from boom_twin.system.result_folder import REPLAY, result_folder
from boom_twin.twin.blocks import CODES, ReportBlock, SampleBlock


def replayed(session: Path, out: Path) -> tuple[dict, Evaluation, list[Stretch]]:
    """Summary, evaluation and stretches of a replay into `out`."""
    stretches: list[Stretch] = []
    with result_folder(out, REPLAY, [session]) as building:
        found = evaluated_replay(building, session, scene_of(session), Settings(), also=stretches.append)
    return found.result.summary, found, stretches


def numbers(value: object) -> list:
    """What a summary holds, flat, without what time took."""
    if isinstance(value, dict):
        return [each for key, item in value.items() if key not in ("wall_s", "realtime_factor") for each in numbers(item)]
    return [each for item in value for each in numbers(item)] if isinstance(value, list) else [value]


@pytest.fixture(scope="module")
def both(tmp_path_factory: pytest.TempPathFactory) -> tuple:
    """24 s with two stops, at once and in stretches of 4 s; folder of each."""
    folder = tmp_path_factory.mktemp("long")
    written(folder / "session", 24.0)
    whole = replayed(folder / "session", folder / "whole")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(recording, "STRETCH", 800)
        parts = replayed(folder / "session", folder / "parts")
    return whole, parts, folder


def test_the_figures_are_those_of_the_whole(both: tuple) -> None:
    (summary, whole, (one,)), (again, parts, stretches), folder = both
    assert len(stretches) >= 5 and sum(len(each.predictions.stamps) for each in stretches) == len(one.predictions.stamps)
    assert numbers(again) == [pytest.approx(each, rel=1e-9) if isinstance(each, float) else each for each in numbers(summary)]
    assert len(whole.rests) == 4 and any(rest.measured for rest in whole.rests)
    for part in parts.rests:  # a rest period that lasts from one stretch to the next has a part in each
        assert any(rest.start <= part.start < part.stop <= rest.stop for rest in whole.rests)
    values = [
        {each.name: each.value for each in read(folder / name)[1] if "mode" not in each.name} for name in ("whole", "parts")
    ]
    assert values[1].keys() == values[0].keys() and values[1] == pytest.approx(values[0], rel=1e-6)


def block(seconds: float) -> tuple[ReportBlock, SampleBlock]:
    """What a twin says of the first seconds of the bundled session's true strokes, and angles."""
    truth = np.genfromtxt(ARCH_DRIVES / "truth.csv.gz", delimiter=",", names=True)[: round(200 * seconds)]
    strokes, stamps = np.column_stack([truth[f"stroke_{i}_m"] for i in range(1, 5)]), np.round(truth["t_s"] * 1e9)
    rows, streams = np.repeat(strokes, 2, axis=0), np.tile([CODES[Stream.STROKES], CODES[Stream.ANGLES]], len(strokes))
    samples = SampleBlock(streams, np.repeat(stamps.astype(np.int64), 2), rows)
    return drive_twin(load_scene()).take(samples), samples


def peak_of(
    part: ReportBlock, samples: SampleBlock, times: int, monkeypatch: pytest.MonkeyPatch, out: Path
) -> tuple[int, History]:
    """Peak of memory, bytes, and the history of a session that repeats `part`."""
    peaks = []

    def repeated(*given: Any) -> SimpleNamespace:
        held = Recording(4, given[-1], length=10.0 * times)
        tracemalloc.start()
        for k in range(times):
            shift = k * 10_000_000_000
            predictions = part.predictions._replace(stamps=part.predictions.stamps + shift)
            residuals = part.residuals._replace(stamps=part.residuals.stamps + shift)
            shifted = part._replace(stamps=part.stamps + shift, predictions=predictions, residuals=residuals)
            held.add(shifted, samples._replace(stamps=samples.stamps + shift))
        held.close()
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
        assert held.totals.samples == times * len(part.predictions.stamps)
        return SimpleNamespace(recording=held)

    monkeypatch.setattr(recording, "STRETCH", 2000)
    monkeypatch.setattr(history, "BINS", 60.0)
    monkeypatch.setattr(history, "LONGEST_WHOLE", 0.0)
    monkeypatch.setattr(evaluation, "replay_into", repeated)
    found = evaluated_replay(out, "repeated", scene_from(None), Settings()).history
    return peaks[0], found


def test_memory_hardly_grows_with_the_session(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    part, samples = block(10.0)
    (short, _), (long, shown) = (peak_of(part, samples, times, monkeypatch, tmp_path) for times in (12, 72))
    assert long < 2.0 * short, f"{long / 1e6:.1f} MB for 12 minutes, {short / 1e6:.1f} MB for 2"
    assert len(shown.stamps_s) < 12_000
    accelerations = part.predictions.tip_acceleration
    for extreme in (np.min, np.max):
        assert np.array_equal(extreme(shown.tip_acceleration, axis=0), extreme(accelerations, axis=0))
