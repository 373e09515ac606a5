"""Replay: run the twin over a recorded session, message by message as the node would."""

from __future__ import annotations

import json
import time
from collections import Counter
from collections.abc import Callable
from contextlib import ExitStack, closing
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from .. import __version__
from ..bag.reader import Session
from ..bag.session_file import WHOLE, TimeWindow
from ..bag.session_model import SessionMetadata, SessionScene, scene_from
from ..bag.writer import FILE_NAME
from ..config.settings import Settings
from ..errors import BagError
from ..health.sensor_check import sensor_ranges
from ..health.wiring_monitor import SCENE
from ..messages.sample_decoder import ODDITIES
from ..scene.load import SceneSource
from ..system.files import write_atomic
from ..system.processes import quick_switches
from ..system.result_folder import REPLAY, result_folder
from ..system.result_text import SummaryDisplay, data_frame
from ..twin.blocks import CODES, CONSEQUENCES, EVENTS, SampleBlock
from ..twin.twin import Twin, drive
from ..types import SENSORS, Array, StrokeReading
from .ground_truth import TipErrors, TipTruth, truth_in
from .inputs import USUAL, ReplayInputs, ReplayOptions, of_another_boom, replay_inputs
from .progress import Progress
from .recording import Recording, Stretch, alarm_as_text, clocks_of, summary_of
from .sample_table import SampleTable, columns_of
from .session_samples import SessionSamples, read_ahead, result_bag

SESSION = "session"  # folder in a replay of a table, with the session that was made of it


@dataclass(frozen=True, repr=False)
class Replay(SummaryDisplay):
    """Result of a replay: the numbers of ``summary.json``, and all predictions.

    Attributes
    ----------
    summary : dict
        As in ``summary.json``.
    recording : Recording
        Gaps, alarms and totals; also predictions, residuals and health, unless `replay_into` passed them on.
    session : Session
        Session that was replayed.
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
        stretch, rows = self.recording.whole, list[Array]()
        table = SampleTable(rows.append, stretch.joints, stretch.streams)
        table.add(stretch)
        table.finish()
        return dict(zip(columns_of(stretch.joints, stretch.streams), np.concatenate(rows).T, strict=True))

    def to_frame(self) -> Any:
        """Return `columns` as a ``pandas.DataFrame``; UsageError if pandas is not installed."""
        return data_frame(self.columns())

    def summary_rows(self) -> dict[str, str]:
        told = self.summary
        return {
            "session": str(self.session.path),
            "lasts": f"{told['duration_s']:.1f} s, {told['samples']} samples, {told['dropped']} left out",
            "replayed": f"{told['realtime_factor']:.1f} times as fast as real time",
            "tip acceleration": f"{told['tip_acceleration_max_m_s2']:.3g} m/s² at most",
            "alarms": "; ".join(map(alarm_as_text, told["alarms"])) or "none",
        }


def replay(
    bag: str | Path | Any,
    scene: SceneSource | SessionScene,
    out: str | Path,
    settings: Settings | None = None,
    progress: Progress | None = None,
    mapping: str | Path | None = None,
    health: bool = True,
    window: TimeWindow = WHOLE,
    namespace: str = "",
    with_bag: bool = True,
    causes: bool = False,
) -> Replay:
    """Replay `bag` through a twin of `scene`; writes ``summary.json`` and ``bag/`` into `out`.

    Recorded changes (load, limits, zeros, restarts from static equilibrium) are repeated at the same stamps. A table of
    readings is written as a session into ``session/`` of `out` first, as `boom_twin import` does.

    Parameters
    ----------
    bag : path, data frame or dict of ndarray, shape (k,)
        A rosbag2 directory, a directory of its files, or one file: ``.mcap``, ``.db3``, ``.bag`` of ROS 1, ``.csv``. Or a table
        with a column of times and one for each channel, NaN without a reading. Names are those of channels in SI units
        (``stamp_ns``, ``cylinder_1``, ``joint_2``), or with units as in files (``Time [s]``, ``Cylinder 1 [mm]``).
    scene : Scene, SessionScene, path or mapping, optional
        As for `boom_twin.statics`; None: the one that the session was made with, else the package's own.
    out : path
        New, empty, or an earlier result of a replay, which is replaced once the new one is whole.
    settings : Settings, optional
        Sensors' noise and tuning; by default those of the node that ran beside the recording, else the package's own.
    progress : callable, optional
        Takes the number of messages; returns the `ProgressBar` that receives the number read by each step.
    mapping : path, optional
        File like ``msg_config/topics.yaml`` with names and units of topics and sensors; by default that of the session, else
        the package's own.
    health : bool
        True to judge the rig's health, see `Report.health`.
    window : TimeWindow, optional
        The part of the session that is replayed. The model starts at rest where that begins, whatever the boom did then; the
        times of the result count from there.
    namespace : str
        ROS namespace of the node in the session, where the mapping does not tell that.
    with_bag : bool
        Write the result bag; without it, ``output_sha256`` of the summary is None, and all else is the same.
    causes : bool
        Compare with twins of booms that have a fault, and name the one that explains the readings; see
        `boom_twin.health.fault_search`. It takes several times as long.

    Returns
    -------
    Replay
        The numbers of ``summary.json``, and all that was predicted.

    Raises
    ------
    UsageError
        The mapping or a setting cannot be used, or `bag` is no table.
    BagError
        The session cannot be read, has no strokes, is of another boom than the scene, or gave no prediction; what it was
        recorded with cannot be used; or `out` cannot be written, or holds anything else than an earlier result.
    """
    is_path = isinstance(bag, str | Path)
    with result_folder(Path(out), REPLAY, [Path(bag)] if is_path else []) as building:
        options = ReplayOptions(progress, mapping, health, window, namespace, with_bag, causes)
        if is_path:
            return replay_into(building, bag, scene, settings, options)
        from ..bag.import_session import import_session
        from ..loggers.assignment import ColumnFile
        from ..loggers.log_table import table_of_frame

        kept, place = scene_from(scene), building / SESSION
        place.mkdir()
        metadata, own = SessionMetadata(__version__, kept.text), None if mapping is None else Path(mapping)
        import_session([table_of_frame(bag)], place, ColumnFile(), metadata, len(kept.scene.joints), own)
        found = replay_into(building, place, kept, settings, options)
        return replace(found, session=replace(found.session, path=Path(out) / SESSION))


def replay_into(
    out: Path,
    bag: str | Path,
    scene: SceneSource | SessionScene,
    settings: Settings | None = None,
    options: ReplayOptions = USUAL,
    take: Callable[[Stretch], None] | None = None,
) -> Replay:
    """Replay as `replay` does, into the folder `out` under construction, to which more will be added.

    With `take`, memory stays the same however long the session is: it is given one `Stretch` after the other, and none is kept.
    """
    given = replay_inputs(Path(bag), scene, settings, options)
    session, joints = given.session, len(given.scene.joints)
    truth = truth_in(options.window, session, given.topics)
    errors = None if truth is None else TipErrors(truth)
    spent = 0.0  # s, of `take`, which is no part of the replay

    def timed(stretch: Stretch) -> None:
        nonlocal spent
        if take is not None:
            began = time.perf_counter()
            take(stretch)
            spent += time.perf_counter() - began

    given_away = None if take is None else timed
    recording = Recording(joints, given_away, errors, given.strokes.reading, given.streams, given.length)
    samples = SessionSamples(session, given.topics, joints, options.window)
    with ExitStack() as stack:
        twin, put = given.twin(options.causes), None
        stack.callback(twin.close)
        twin.warm_up()
        if options.with_bag:
            bag_of = result_bag(out / "bag", session.notes, given.topics, given.scene, given.settings)
            put = stack.enter_context(bag_of)
        bar = options.progress(given.expected) if options.progress else None
        began = time.perf_counter()
        stack.enter_context(quick_switches())
        items = stack.enter_context(closing(read_ahead(samples)))
        for step in drive(twin, twin.take, items):
            if bar is not None:
                bar.update(1 if step is None else len(step[0].stamps))
            if step is None:
                recording.refused += 1
                continue
            block, rows = step
            recording.add(rows, block)
            for alarm in (alarm for health in rows.health.values() for alarm in health.alarms if alarm.cause == SCENE):
                raise of_another_boom(session, given.kept, alarm.evidence)
            if put is not None:
                put(rows)
    if bar is not None:
        bar.close()
    wall = time.perf_counter() - began - spent
    twin.counts.update(samples.oddities)
    one, names, bounds = "stroke", "cylinder", "the cylinders' travel"
    if given.strokes.reading is StrokeReading.ANGLE:
        one, names, bounds = "angle", "joint", "the joints' range_deg"
    if recording.is_empty:
        raise BagError(
            f"{session.path}: no {one} sample could be used ({_told(twin)}). "
            f"It needs names {names}_1..{joints}, or those of a mapping, values within {bounds}, "
            f"and stamps.{_explained(twin.counts)}{_first_refused(given)} {_wiring_advice(given, options)}"
        )
    recording.close()
    if recording.totals.samples == 1 < recording.refused:
        raise BagError(
            f"{session.path}: one {one} sample could be used, {recording.refused} samples were left out ({_told(twin)})."
            f"{_explained(twin.counts)}"
        )
    if options.with_bag:
        SessionMetadata(__version__, given.kept.text, strokes=given.strokes.reading).write(out / "bag")
    file = out / "bag" / FILE_NAME if options.with_bag else None
    summary = summary_of(recording, twin.counts, wall, file) | clocks_of(twin.clocks) | given.summary
    summary |= recording.read_out.coarse(twin.settings)
    if errors is not None:
        summary |= errors.rms
    write_atomic(out / "summary.json", json.dumps(summary, indent=2) + "\n")
    return Replay(summary, recording, session, truth)


def _first_refused(given: ReplayInputs) -> str:
    """Return a sentence on the first stroke, or angle that drives the model, outside its sensor's range; empty without one."""
    stream, joints = given.strokes.reading.stream, len(given.scene.joints)
    low, high = sensor_ranges(given.scene, given.topics.mounts(joints))[stream]
    for item in SessionSamples(given.session, given.topics, joints, given.window):
        if isinstance(item, SampleBlock):
            values = item.values[item.streams == CODES[stream], :joints]
            for row, i in np.argwhere((values < low) | (values > high)):
                name, unit = SENSORS[stream].channels(joints)[i], SENSORS[stream].unit
                value = f"{name} = {values[row, i]:.6g} {unit}"
                return f" The first refused value: {value}, its sensor can read {low[i]:.4g} to {high[i]:.4g} {unit}."
    return ""


def _wiring_advice(given: ReplayInputs, options: ReplayOptions) -> str:
    if given.strokes.reading is StrokeReading.ANGLE:
        return "Give names, units and zeros of the joints' sensors by --mapping."
    from .commissioning import wiring_of  # only a session without any usable stroke needs it

    return f"Wiring: {wiring_of(given.session.path, given.kept, options.mapping, given.window, options.namespace)}."


def _explained(counts: Counter[str]) -> str:
    """Return a sentence on the most frequent event; empty without any. `CONSEQUENCES` count only without another."""
    most = max(counts, key=lambda name: (name not in CONSEQUENCES, counts[name]), default=None)
    return "" if most is None else f" Most often {most}: {(EVENTS | ODDITIES)[most]}."


def _told(twin: Twin) -> str:
    return ", ".join(f"{name}: {count}" for name, count in twin.counts.items()) or "it was empty"
