"""A replay that steps the boom in the reader's process gives what one gives that does not, byte for byte."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from boom_twin.bag.session_files import write_session
from boom_twin.bag.time_window import TimeWindow
from boom_twin.errors import UsageError
from boom_twin.estimation.recorded_steps import RecordedSteps
from boom_twin.offline import replay as replays
from boom_twin.offline.replay import Replay, replay_into
from boom_twin.scene import load_scene
from boom_twin.scene.kinematics import strokes_of_posture
from boom_twin.system.result_folder import REPLAY, result_folder

PUMP = Path(__file__).parents[2] / "bags" / "pump_session"
VARYING = {"wall_s", "realtime_factor"}


def replayed(session: Path, out: Path, cores: int, window: TimeWindow) -> Replay:
    with result_folder(out, REPLAY, [session]) as building:
        return replay_into(building, session, None, window=window, cores=cores)


@pytest.fixture(autouse=True)
def _of_any_length(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(replays, "MANY", 1)


@pytest.fixture
def repeats(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """How many numbers of recorded steps were repeated, each time."""
    found, repeat = list[int](), RecordedSteps.repeat

    def noted(self: RecordedSteps, steps: Any) -> None:
        found.append(len(steps))
        repeat(self, steps)

    monkeypatch.setattr(RecordedSteps, "repeat", noted)
    return found


def test_one_core_and_three_give_the_same(tmp_path: Path, repeats: list[int]) -> None:
    window = TimeWindow(5.0, 10.0)
    alone = replayed(PUMP, tmp_path / "alone", 1, window).summary
    assert not repeats
    apart = replayed(PUMP, tmp_path / "apart", 3, window).summary
    assert sum(repeats) > 500 * alone["samples"] / 2
    assert alone["output_sha256"] is not None
    assert {**alone, **dict.fromkeys(VARYING)} == {**apart, **dict.fromkeys(VARYING)}


def test_where_nothing_is_kept_one_process_compiles(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert replays._is_stepped_apart(100, 3, True) and not replays._is_stepped_apart(100, 2, True)
    assert replays._is_stepped_apart(100, 2, False) and not replays._is_stepped_apart(100, 1, False)
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    assert not replays._is_stepped_apart(100, 3, True)


def test_what_the_other_process_refuses_is_told_here(tmp_path: Path) -> None:
    """Stamps that count milliseconds: as on one core."""
    strokes = np.tile(strokes_of_posture(load_scene(), "arch"), (300, 1))
    write_session(tmp_path / "ms", 10**6 + 5 * np.arange(300), strokes, np.full((300, 4), np.nan), None, {})
    told = []
    for cores in (1, 3):
        with pytest.raises(UsageError, match="nanoseconds") as refused:
            replayed(tmp_path / "ms", tmp_path / f"out_{cores}", cores, TimeWindow())
        told.append(str(refused.value))
    assert told[0] == told[1]
