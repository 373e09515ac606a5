"""A replay that steps the boom in a thread gives what one gives that does not, byte for byte."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from drive_twin import PUMP_DRIVES, drive_twin

from boom_twin import Sample, Stream
from boom_twin.bag.session_files import write_session
from boom_twin.bag.time_window import TimeWindow
from boom_twin.errors import BagError, UsageError
from boom_twin.estimation.recorded_steps import RecordedSteps
from boom_twin.offline import replay as replays
from boom_twin.offline.replay import Replay, replay_into
from boom_twin.offline.stepping_thread import NAME, stepped_ahead
from boom_twin.scene import load_scene
from boom_twin.scene.kinematics import strokes_of_posture
from boom_twin.system.result_folder import REPLAY, result_folder
from boom_twin.twin.blocks import SampleBlock, block_of

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


def test_one_core_and_two_give_the_same(tmp_path: Path, repeats: list[int]) -> None:
    window = TimeWindow(5.0, 10.0)
    alone = replayed(PUMP_DRIVES, tmp_path / "alone", 1, window).summary
    assert not repeats
    apart = replayed(PUMP_DRIVES, tmp_path / "apart", 2, window).summary
    assert sum(repeats) > 500 * alone["samples"] / 2
    assert alone["output_sha256"] is not None
    assert {**alone, **dict.fromkeys(VARYING)} == {**apart, **dict.fromkeys(VARYING)}


def test_what_the_other_twin_refuses_is_told_here(tmp_path: Path) -> None:
    """Stamps that count milliseconds: as on one core."""
    strokes = np.tile(strokes_of_posture(load_scene(), "arch"), (300, 1))
    write_session(tmp_path / "ms", 10**6 + 5 * np.arange(300), strokes, np.full((300, 4), np.nan), None, {})
    told = []
    for cores in (1, 2):
        with pytest.raises(UsageError, match="nanoseconds") as refused:
            replayed(tmp_path / "ms", tmp_path / f"out_{cores}", cores, TimeWindow())
        told.append(str(refused.value))
    assert told[0] == told[1]
    assert not _goes_on()


def _goes_on() -> bool:
    """Whether the thread that steps is there two seconds later."""
    for thread in threading.enumerate():
        if thread.name == NAME:
            thread.join(2.0)
    return any(thread.name == NAME for thread in threading.enumerate())


def test_what_fails_in_the_thread_fails_here_after_what_came_before() -> None:
    strokes, twin, taken = strokes_of_posture(load_scene(), "arch"), drive_twin(load_scene()), []
    block = block_of([Sample(Stream.STROKES, 10**18 + 5_000_000 * k, strokes) for k in range(20)], 4)

    def items() -> Iterator[SampleBlock | None]:
        yield block
        yield None
        raise BagError("cut off")

    with pytest.raises(BagError, match="cut off"):
        for item in stepped_ahead(items(), twin, drive_twin(load_scene())):
            taken.append(item)
            if item is not None:
                assert len(twin.update_block(item)) > 0
    assert taken == [block, None] and not _goes_on()


def test_the_thread_ends_where_its_items_are_left() -> None:
    """Of more than it may be ahead of who takes them."""
    strokes, twin = strokes_of_posture(load_scene(), "arch"), drive_twin(load_scene())
    one = [block_of([Sample(Stream.STROKES, 10**18 + 5_000_000 * k, strokes)], 4) for k in range(100)]
    taking = stepped_ahead(one, twin, drive_twin(load_scene()))
    assert next(taking) is one[0] and any(thread.name == NAME for thread in threading.enumerate())
    taking.close()
    assert not _goes_on()
