"""A twin that repeats the steps of another gives what it gives when it steps the boom itself, whatever the strokes do."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np
import pytest
from drive_twin import drive_twin
from twin.hostile import PHASES, session
from twin.test_update import stream, told

from boom_twin import Report, Sample, Settings, Stream, Twin, load_scene
from boom_twin.errors import UsageError
from boom_twin.estimation.posture_modes import PostureModes
from boom_twin.health.baseline import load_baseline
from boom_twin.offline.stepping_thread import stepped_ahead
from boom_twin.scene.kinematics import joint_angles_of_strokes, strokes_of_posture
from boom_twin.twin.blocks import ReportBlock, SampleBlock, block_of
from boom_twin.types import Change

N = 4
Items = Iterable[SampleBlock | Change]


def reports_of(twin: Twin, items: Items) -> list[Report]:
    found = []
    for item in items:
        if isinstance(item, Change):
            twin.requests.repeat(item)
            continue
        for each in twin.update_block(item):
            found += each.reports(N) if isinstance(each, ReportBlock) else [each]
    return found


def repeated(twin: Twin, items: Items) -> Iterator[SampleBlock | Change]:
    """The items, of which `twin` repeats the steps; in a thread as in a replay."""
    for item in stepped_ahead(items, twin, drive_twin(twin.scene, twin.settings, twin.mounts)):
        assert item is not None
        yield item


def blocks(samples: list[Sample], rng: np.random.Generator, changes: float = 0.0) -> Iterator[SampleBlock | Change]:
    """The samples in blocks of any size, and some changes between."""
    first = 0
    while first < len(samples):
        part = samples[first : first + int(rng.integers(1, 400))]
        if rng.random() < changes:
            load = {"payload": float(rng.integers(0, 60))}
            zeros = {"joint_1": 0.01} if rng.random() < 0.5 else {"cylinder_2": 1e-3}
            yield Change(part[0].stamp, bool(rng.random() < 0.3), Settings().live | load, zeros, bool(rng.random() < 0.3))
        yield block_of(part, N)
        first += len(part)


@pytest.mark.parametrize("seed", range(6))
def test_odd_samples_of_all_streams_and_changes(seed: int) -> None:
    samples, mounts = stream(seed, 600, strange=0.0 if seed == 0 else 0.02), ("root", None, "head", "root") if seed == 1 else ()
    items = list(blocks(samples, np.random.default_rng(seed), changes=0.3))
    one, other = (drive_twin(load_scene(), Settings(), mounts, load_baseline() if seed < 3 else None) for _ in range(2))
    expected = told(reports_of(one, items))
    assert told(reports_of(other, repeated(other, items))) == expected and other.counts == one.counts
    assert sum(bool(each[4]) for each in expected) > 300  # predictions


@pytest.mark.parametrize("phase", PHASES)
def test_hostile_strokes(phase: str) -> None:
    rng = np.random.default_rng([*map(ord, phase)])
    true = session(int(rng.integers(1000)))[:900]
    samples = [*true[:300], *PHASES[phase](rng, true[300:450]), *true[450:]]
    items = list(blocks(samples, rng))
    one, other = (drive_twin(load_scene()) for _ in range(2))
    assert told(reports_of(other, repeated(other, items))) == told(reports_of(one, items))
    assert other.counts == one.counts


def test_a_step_for_other_strokes_is_not_repeated() -> None:
    strokes = strokes_of_posture(load_scene(), "arch")
    samples = [Sample(Stream.STROKES, 10**18 + 5_000_000 * k, strokes) for k in range(20)]
    others = [*samples[:10], Sample(Stream.STROKES, samples[10].stamp, strokes + 1e-4), *samples[11:]]
    for given in (others, [*samples[:10], *samples[11:]]):
        recording, repeating = drive_twin(load_scene()), drive_twin(load_scene())
        recording.recorded_steps.record()
        recording.update_block(block_of(samples, N))
        repeating.recorded_steps.repeat(recording.recorded_steps.taken())
        with pytest.raises(RuntimeError, match="not the one that was recorded"):
            repeating.update_block(block_of(given, N))


def test_steps_that_are_left_over_are_told() -> None:
    strokes = strokes_of_posture(load_scene(), "arch")
    samples = [Sample(Stream.STROKES, 10**18 + 5_000_000 * k, strokes) for k in range(20)]
    recording, repeating = drive_twin(load_scene()), drive_twin(load_scene())
    recording.recorded_steps.record()
    recording.update_block(block_of(samples, N))
    repeating.recorded_steps.repeat(recording.recorded_steps.taken().copy())
    repeating.update_block(block_of(samples[:15], N))
    recording.update_block(block_of(samples[15:], N))
    with pytest.raises(RuntimeError, match="not repeated"):
        repeating.recorded_steps.repeat(recording.recorded_steps.taken())


def test_stamps_of_another_unit_are_refused_with_the_same_words() -> None:
    strokes = strokes_of_posture(load_scene(), "arch")
    items = [block_of([Sample(Stream.STROKES, 5 * k, strokes) for k in range(200)], N)] * 2
    one, other = drive_twin(load_scene()), drive_twin(load_scene())
    with pytest.raises(UsageError) as alone:
        reports_of(one, items)
    with pytest.raises(UsageError) as beside:
        reports_of(other, repeated(other, items))
    assert str(alone.value) == str(beside.value)


def test_modes_of_a_posture_need_no_more_of_the_history_than_positions() -> None:
    """Where there is no equilibrium on the grid, its modes are of the boom as it is: of recorded steps, too."""
    scene = load_scene()
    twin, strokes = drive_twin(scene), strokes_of_posture(scene, "arch")
    for k in range(200):
        twin.update(Sample(Stream.STROKES, 10**18 + 5_000_000 * k, strokes + 1e-2 * np.sin(0.02 * k)))
    live, found = twin._boom.live, []
    for rows in (slice(0, 0), slice(1, None)):  # all of the history, and the positions alone
        live.history[rows] = 7.0
        modes = PostureModes(scene, twin.plan)
        modes.near = lambda strokes: None  # type: ignore[method-assign]
        posture = modes.at(strokes, joint_angles_of_strokes(scene, strokes), live)
        found.append([(each.mode.frequency, each.damping, each.turns.tobytes()) for each in posture.lowest(6, 200.0)])
    assert len(found[0]) > 3 and found[0] == found[1]
