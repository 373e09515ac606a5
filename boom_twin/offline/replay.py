"""Replay: run the twin over a recorded session, message by message as the node would."""

from __future__ import annotations

import gc
import json
import time
from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from contextlib import ExitStack, closing, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from .. import __version__
from ..bag.joint_names import refuse_other_names
from ..bag.reader import Session, scan
from ..bag.session_model import SessionScene, baseline_of, mapping_of, scene_of, settings_of, strokes_of
from ..bag.session_sheet import SessionSheet
from ..bag.time_window import WHOLE, TimeWindow
from ..bag.writer import FILE_NAME
from ..config.settings import Settings
from ..diagnostics.boom_mismatch import OtherBoom
from ..errors import BagError
from ..health.fault_twins import FaultTwins, Hypothesis
from ..messages.sample_decoder import ODDITIES
from ..messages.topic_table import Topics
from ..scene.edit import anew, loaded
from ..scene.load import SceneSource, as_scene
from ..system.atomic_files import write_atomic
from ..system.result_folder import REPLAY, UnfinishedResult, result_folder
from ..system.summary_display import SummaryDisplay, data_frame
from ..twin.blocks import CODES, ReportBlock, SampleBlock
from ..twin.driver import drive_blocks
from ..twin.events import EVENTS
from ..twin.twin import Twin
from ..types import NANO, Array, Change, Report, Stream
from .ground_truth import TipErrors, TipTruth, truth_in
from .progress import Progress
from .recording import Recording, Stretch
from .refused_strokes import RefusedStrokes
from .sample_table import RowsInMemory, SampleTable, columns_of
from .session_samples import SessionSamples
from .summary import alarm_as_text, summary_of
from .threads import read_ahead, result_bag

GIVEN = "given as a Scene"
"""Source of a scene that came by no file."""


@dataclass(frozen=True)
class ReplayOptions:
    """Options of a replay, see the parameters of `replay`."""

    progress: Progress | None = None
    mapping: str | Path | None = None
    changes: bool = True
    health: bool = True
    baseline: str | Path | None = None
    window: TimeWindow = WHOLE
    namespace: str = ""
    with_bag: bool = True
    causes: bool = False


USUAL = ReplayOptions()


@dataclass(frozen=True, repr=False)
class Replay(SummaryDisplay):
    """Result of a replay: the numbers of ``summary.json``, and all predictions.

    Attributes
    ----------
    summary : dict
        As in ``summary.json``.
    recording : Recording
        Gaps, alarms and totals; predictions, residuals and health too, unless `replay_into` gave them away.
    session : Session
        What was replayed.
    truth : TipTruth or None
        The tip's true motion, where the session has one (synthetic sessions of the virtual rig).
    """

    summary: dict[str, Any]
    recording: Recording
    session: Session
    truth: TipTruth | None

    def columns(self) -> dict[str, Array]:
        """Return a row for every stroke stamp: predicted, measured, residuals, estimate.

        Returns
        -------
        dict of str to ndarray, shape (k,)
            The columns of ``boom_twin replay --table csv``, by name with unit; NaN where there is no value.

        Raises
        ------
        ValueError
            The stretches were given away, see `replay_into`.
        """
        stretch, rows = self.recording.whole, RowsInMemory()
        table = SampleTable(rows, stretch.joints)
        table.add(stretch)
        table.finish()
        return dict(zip(columns_of(stretch.joints), np.concatenate(rows.parts).T, strict=True))

    def to_frame(self) -> Any:
        """Return `columns` as a ``pandas.DataFrame``; UsageError if pandas is not installed."""
        return data_frame(self.columns())

    def summary_rows(self) -> dict[str, str]:
        """See `boom_twin.system.summary_display.SummaryDisplay`."""
        told = self.summary
        return {
            "session": str(self.session.path),
            "lasts": f"{told['duration_s']:.1f} s, {told['samples']} samples, {told['dropped']} left out",
            "replayed": f"{told['realtime_factor']:.1f} times as fast as real time",
            "tip acceleration": f"{told['tip_acceleration_max_m_s2']:.3g} m/s² at most",
            "alarms": "; ".join(map(alarm_as_text, told["alarms"])) or "none",
        }


def replay(
    bag: str | Path,
    scene: SceneSource | SessionScene,
    out: str | Path,
    settings: Settings | None = None,
    progress: Progress | None = None,
    mapping: str | Path | None = None,
    changes: bool = True,
    health: bool = True,
    baseline: str | Path | None = None,
    window: TimeWindow = WHOLE,
    namespace: str = "",
    with_bag: bool = True,
    causes: bool = False,
) -> Replay:
    """Replay `bag` through a twin of `scene`; writes ``summary.json`` and ``bag/`` into `out`.

    Parameters
    ----------
    bag : path
        A rosbag2 directory, a directory of its files, or one file: ``.mcap``, ``.db3``, ``.bag`` of ROS 1, ``.csv``.
    scene : Scene, SessionScene, path or mapping, optional
        As for `boom_twin.statics`; None: the one that the session was made with, else the package's own.
    out : path
        New, empty, or an earlier result of a replay, which is replaced once the new one is whole.
    settings : Settings, optional
        Sensors' noise and tuning; by default those of the node that ran beside the recording, else the package's own.
    progress : callable, optional
        Is given the number of messages, and gives the `ProgressBar` that is told how many were taken.
    mapping : path, optional
        How topics and sensors are named and read, a file like ``msg_config/topics.yaml``; by default the one that the
        session was recorded with, else the package's own.
    changes : bool
        Repeat what was changed while the session was recorded (load, limits, zeros, starts from rest), at the same stamps.
    health : bool
        Judge the rig's health, see `Report.health`.
    baseline : path, optional
        Baseline of this rig; by default the one that the session was recorded with, else the package's own.
    window : TimeWindow, optional
        The part of the session that is replayed. The model starts at rest where that begins, whatever the boom did then; the
        times of the result count from there.
    namespace : str
        ROS namespace of the node in the session, where the mapping does not tell that.
    with_bag : bool
        Write the result bag; without it, ``output_sha256`` of the summary is None, and all else is the same.
    causes : bool
        Compare with twins of booms that have a fault, and name the one that explains the readings; see
        `boom_twin.health.fault_twins`. It takes about ten times as long.

    Returns
    -------
    Replay
        The numbers of ``summary.json``, and all that was predicted.

    Raises
    ------
    UsageError
        The mapping, a setting or the baseline cannot be used.
    BagError
        The session cannot be read, has no strokes, is of another boom than the scene, or gave no prediction; what it was
        recorded with cannot be used; or `out` cannot be written, or holds anything else than an earlier result.
    """
    with result_folder(Path(out), REPLAY, [Path(bag)]) as building:
        options = ReplayOptions(progress, mapping, changes, health, baseline, window, namespace, with_bag, causes)
        return replay_into(building, bag, scene, settings, options)


def replay_into(
    building: UnfinishedResult,
    bag: str | Path,
    scene: SceneSource | SessionScene,
    settings: Settings | None = None,
    options: ReplayOptions = USUAL,
    take: Callable[[Stretch], None] | None = None,
) -> Replay:
    """Replay as `replay` does, into a folder under construction to which more will be added.

    With `take`, memory stays the same however long the session is: it is given one `Stretch` after the other, and none is kept.
    """
    session, out, settings = scan(Path(bag)), building.folder, settings or settings_of(Path(bag)).settings
    taken = scene_for(session.path, scene)
    scene, joints = taken.scene, len(taken.scene.joints)
    mapped = mapping_of(session.path, Path(options.mapping) if options.mapping else None, joints, options.namespace)
    topics, wanted = mapped.topics.of_joints(joint.range_deg for joint in scene.joints), _wanted(session, mapped.topics)
    strokes = strokes_of(session.path, mapped)
    refuse_other_names(session, topics, joints, taken.source)
    baseline = Path(options.baseline) if options.baseline else None
    usual = baseline_of(session.path, baseline) if options.health else None
    window = options.window
    truth = truth_in(window, session, topics, wanted)
    errors = None if truth is None else TipErrors(truth)
    taking = None if take is None else _Timed(take)
    recording = Recording(joints, taking, errors, strokes.reading)
    other_boom, refused = OtherBoom(), RefusedStrokes(scene, taken.source)
    samples = SessionSamples(session, topics, wanted, joints, window)
    with ExitStack() as stack:
        stack.enter_context(_unhurried_collector())
        mounts, reading = topics.mounts(joints), strokes.reading
        twin = Twin(scene, settings, mounts, None if usual is None else usual.baseline, reading, topics.absent)
        twin.warm_up()
        put = None
        if options.with_bag:
            put = stack.enter_context(result_bag(out / "bag", session.notes, topics, scene, settings))
        fault_twins = _fault_twins(twin) if options.causes else None
        bar = options.progress(_expected(session, wanted, window)) if options.progress else None
        began = time.perf_counter()
        items = stack.enter_context(closing(read_ahead(samples)))
        for step in drive_blocks(twin, _followed(items, options.changes, fault_twins)):
            if bar is not None:
                bar.update(1 if step is None else len(step[0].stamps))
            if step is None:
                recording.refused += 1
                continue
            block, found = step
            recording.add_samples(block)
            for each in found:
                recording.add(each)
            if put is not None:
                put(found)
            if recording.is_empty:
                refused.take(block)
            _refuse(session, taken, other_boom.take(int(block.stamps[-1]), *_angles(block, found, joints)))
        _refuse(session, taken, other_boom.judge())
    if bar is not None:
        bar.close()
    wall = time.perf_counter() - began - (taking.spent if taking else 0.0)
    twin.counts.update(samples.oddities)
    if recording.is_empty:
        raise BagError(
            f"{session.path}: no stroke sample could be used ({_told(twin)}){refused.never_read}. "
            f"It needs names cylinder_1..{twin.plan.joints}, or those of a mapping, values within the cylinders' travel, "
            f"and stamps.{_explained(samples.oddities)}{refused.told}"
        )
    recording.close()
    if fault_twins is not None and (named := fault_twins.judge()) is not None:
        recording.add_alarm(named)
    if recording.totals.samples == 1 < recording.refused:
        raise BagError(
            f"{session.path}: of {1 + recording.refused} stroke samples only the first could be used ({_told(twin)})."
            f"{_explained(twin.counts)}"
        )
    if options.with_bag:
        SessionSheet(__version__, taken.text, strokes=strokes.reading).write(out / "bag")
    summary = summary_of(recording, twin.counts, wall, out / "bag" / FILE_NAME if options.with_bag else None) | {
        "scene": taken.source,
        "scene_sha256": taken.sha256,
        "baseline": None if usual is None else usual.source,
        "mapping": mapped.source,
        "strokes": strokes.reading,
        "strokes_source": strokes.source,
    }
    if window != WHOLE:
        summary |= {"window_start_s": window.start, "window_duration_s": window.duration}
    if session.incomplete:
        summary["session_incomplete"] = session.incomplete
    if errors is not None:
        summary |= errors.rms
    write_atomic(out / "summary.json", json.dumps(summary, indent=2) + "\n")
    return Replay(summary, recording, session, truth)


class _Timed:
    """Wrapper of `take` that adds up its time, s, which is no part of the replay."""

    def __init__(self, take: Callable[[Stretch], None]) -> None:
        self._take = take
        self.spent = 0.0

    def __call__(self, stretch: Stretch) -> None:
        began = time.perf_counter()
        self._take(stretch)
        gc.collect()  # which does not run by itself, see `_unhurried_collector`
        self.spent += time.perf_counter() - began


def scene_for(session: Path, scene: SceneSource | SessionScene) -> SessionScene:
    """Return the scene to read a session with: `scene`, or if None that of `boom_twin.bag.session_model.scene_of`."""
    if scene is None or isinstance(scene, str | Path):
        return scene_of(session, scene)
    if isinstance(scene, SessionScene):
        return scene
    given = as_scene(scene)
    return SessionScene(given, anew(given), GIVEN)


def _angles(block: SampleBlock, found: list[ReportBlock | Report], joints: int) -> tuple[Array, list[Array]]:
    """Return the angles of a block of samples, and the residuals of angles that became known, rows (joints,) in rad."""
    code, residuals = CODES[Stream.ANGLES], []
    for each in found:
        if isinstance(each, Report):
            rows = (row for part in each.all for row in part.residuals)
            residuals += [row.values for row in rows if row.stream is Stream.ANGLES]
        else:
            residuals += list(each.residuals.values[each.residuals.streams == code, :joints])
    return block.values[block.streams == code, :joints], residuals


def _refuse(session: Session, scene: SessionScene, reason: str) -> None:
    """Raise BagError if there is a `reason` for which the session is of another boom than the scene."""
    if reason:
        raise BagError(
            f"{session.path}: {reason}. The scene ({scene.source}) is of another boom, or the sensors' zeros and units are "
            "others: give the scene by --scene, or those by --mapping."
        )


def _wanted(session: Session, topics: Topics) -> list[str]:
    """Return the topics to read: that of the strokes, and those of other inputs with messages."""
    found = {name: session.find(name) for name in topics.heard}
    return [name for name, topic in found.items() if Stream.STROKES in topics.heard[name] or (topic and topic.count)]


def _expected(session: Session, wanted: list[str], window: TimeWindow) -> int:
    """Return the approximate number of messages to read."""
    count = sum(topic.count for name in wanted if (topic := session.find(name)) is not None)
    return round(count * window.share((session.end - session.start) * NANO))


def _fault_twins(twin: Twin) -> FaultTwins:
    """Return twins as `twin` of all that may be wrong with its boom."""

    def make(hypothesis: Hypothesis) -> Twin:
        settings = twin.settings.tuned(hypothesis.load(*twin.settings.load))
        boom = hypothesis.scene, settings, twin.mounts
        return type(twin)(*boom, reads=twin.reads, absent=twin.absent, doubted=hypothesis.doubted)

    return FaultTwins(loaded(twin.scene, *twin.settings.load), make)


def _followed(
    samples: Iterable[SampleBlock | Change | None], with_changes: bool, twins: FaultTwins | None
) -> Iterator[SampleBlock | Change | None]:
    """Yield the samples, and the changes if they are wanted; fault twins take them first."""
    for each in samples:
        if isinstance(each, Change):
            if not with_changes:
                continue
            if twins is not None:
                twins.change(each)
        elif each is not None and twins is not None:
            twins.take(each)
        yield each


@contextmanager
def _unhurried_collector() -> Iterator[None]:
    """Freeze and disable the garbage collector: a replay makes many small objects that last."""
    gc.freeze()
    gc.disable()
    try:
        yield
    finally:
        gc.enable()
        gc.unfreeze()


def _explained(counts: Counter[str]) -> str:
    """Return a sentence on what was met most often; empty if nothing was."""
    return "".join(f" Most often {name}: {(EVENTS | ODDITIES)[name]}." for name, _ in counts.most_common(1))


def _told(twin: Twin) -> str:
    return ", ".join(f"{name}: {count}" for name, count in twin.counts.items()) or "it was empty"
