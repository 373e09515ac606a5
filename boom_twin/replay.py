"""Run the twin over a recorded session: the node's three calls in a loop over a bag."""

from __future__ import annotations

import gc
import hashlib
import json
import shutil
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from .errors import BagError
from .io.factory import RosbagsTypes
from .io.intake import Intake, stamp_of
from .io.outlet import Outlet
from .io.reader import Session, read, scan
from .io.topics import TYPES, Output, load_topics
from .io.writer import FILE_NAME, SessionWriter
from .records import Array, Prediction, Report, Residuals, Stream
from .scene.parts import Scene
from .settings import Settings
from .truth import TipTruth, load_truth
from .twin import Twin

Progress = Callable[[Iterator[Any], int], Iterator[Any]]


@dataclass
class Recording:
    """Everything a replay predicted, in the order of the session."""

    predictions: list[Prediction] = field(default_factory=list)
    residuals: list[Residuals] = field(default_factory=list)
    gaps: list[tuple[int, int]] = field(default_factory=list)
    refused: int = 0

    def add(self, report: Report) -> None:
        """Keep what one sample caused."""
        if not report.accepted:
            self.refused += 1
        if report.prediction is not None:
            if "gap" in report.events or "restart" in report.events:
                self.gaps.append((self.predictions[-1].stamp, report.stamp))
            self.predictions.append(report.prediction)
        self.residuals += report.residuals

    def of(self, stream: Stream) -> list[Residuals]:
        """Residuals of one stream."""
        return [residuals for residuals in self.residuals if residuals.stream is stream]


@dataclass(frozen=True)
class Replay:
    """Result of a replay: the numbers of ``summary.json``, and all that was predicted."""

    summary: dict[str, Any]
    recording: Recording
    session: Session
    truth: TipTruth | None


def replay(
    bag: str | Path,
    scene: Scene,
    out: str | Path,
    settings: Settings | None = None,
    progress: Progress | None = None,
) -> Replay:
    """Replay `bag` through a twin of `scene`; writes ``summary.json`` and ``bag/`` into `out`.

    Parameters
    ----------
    bag : path
        A rosbag2 directory, a directory of .mcap files, or one .mcap.
    out : path
        Made if needed; a result bag of an earlier replay in it is replaced.
    settings : Settings, optional
        Sensors' noise and tuning; the package's own by default.
    progress : callable, optional
        Wraps the iterator over messages, of which it is told the number.

    Raises
    ------
    BagError
        The session cannot be read, has no strokes, or gave no prediction; or `out` cannot be written.
    """
    session, out = scan(Path(bag)), Path(out)
    wanted = _wanted(session)
    twin = Twin(scene, settings)
    twin.warm_up()
    _clear(out)
    recording = Recording()
    began = time.perf_counter()
    messages = read(session, {name: TYPES[stream] for name, stream in wanted.items()})
    if progress is not None:
        total = sum(topic.count for name in wanted if (topic := session.find(name)) is not None)
        messages = progress(messages, total)
    with _unhurried_collector(), SessionWriter(out / "bag", _outputs(), session.notes) as writer:
        _feed(messages, wanted, twin, writer, recording)
    wall = time.perf_counter() - began
    if not recording.predictions:
        raise BagError(
            f"{session.path}: no stroke sample could be used ({_told(twin)}). "
            f"It needs names cylinder_1..{twin.plan.joints}, values in m within the cylinders' travel, and stamps."
        )
    truth = load_truth(session.path)
    summary = _summary(recording, twin, wall, out / "bag" / FILE_NAME)
    if truth is not None:
        summary |= truth.errors(recording.predictions)
    (out / "summary.json").write_text(json.dumps(summary, indent=2) + "\n", encoding="utf-8")
    return Replay(summary, recording, session, truth)


def _wanted(session: Session) -> dict[str, Stream]:
    """The session's topics by stream: strokes, and what else of the inputs has messages."""
    inputs = load_topics().inputs
    wanted = {inputs[Stream.STROKES].name: Stream.STROKES}
    for stream in (Stream.ANGLES, Stream.IMU):
        topic = session.find(inputs[stream].name)
        if topic is not None and topic.count:
            wanted[inputs[stream].name] = stream
    return wanted


def _outputs() -> dict[str, Any]:
    return {key: topic for key, topic in load_topics().outputs.items() if key is not Output.DIAGNOSTICS}


def _clear(out: Path) -> None:
    """Make room for the results; only a bag that a replay wrote is removed."""
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise BagError(f"{out}: {error.strerror}. Give a folder that can be written.") from None
    if (out / "bag" / FILE_NAME).is_file():
        shutil.rmtree(out / "bag")


class _unhurried_collector:
    """Keep what was made before out of the garbage collector's sight: a replay makes many small lasting objects."""

    def __enter__(self) -> None:
        gc.collect()
        gc.freeze()
        gc.disable()

    def __exit__(self, *_: object) -> None:
        gc.enable()
        gc.unfreeze()


def _feed(
    messages: Iterator[Any], wanted: dict[str, Stream], twin: Twin, writer: SessionWriter, recording: Recording
) -> None:
    """The node's callback, for every message of the session."""
    intake, outlet = Intake(twin.plan.joints), Outlet(RosbagsTypes())
    for name, _, message in messages:
        stamp = stamp_of(message)
        sample = intake.put(wanted[name], stamp, message)
        if sample is None:
            recording.refused += 1
            continue
        report = twin.update(sample)
        recording.add(report)
        for key, filled in outlet.fill(report):
            writer.write(key, stamp, filled)
    twin.counts.update(intake.oddities)


def _told(twin: Twin) -> str:
    return ", ".join(f"{name}: {count}" for name, count in twin.counts.items()) or "it was empty"


def _summary(recording: Recording, twin: Twin, wall: float, file: Path) -> dict[str, Any]:
    """The contract's numbers of a replay."""
    first, last = recording.predictions[0].stamp, recording.predictions[-1].stamp
    duration = (last - first) * 1e-9
    angles = recording.of(Stream.ANGLES)
    values = _stacked([residuals.values for residuals in angles], twin.plan.joints)
    normalised = _stacked([residuals.normalised for residuals in angles], twin.plan.joints)
    acceleration = np.array([np.hypot(*prediction.tip_acceleration) for prediction in recording.predictions])
    return {
        "samples": len(recording.predictions),
        "duration_s": duration,
        "wall_s": wall,
        "realtime_factor": duration / wall,
        "dropped": recording.refused,
        "events": dict(sorted(twin.counts.items())),
        "joint_residual_rms_rad": _rms(values),
        "joint_residual_normalised_mean": _mean(normalised),
        "joint_residual_normalised_std": _std(normalised),
        "tip_acceleration_max_m_s2": float(acceleration.max()),
        "output_sha256": hashlib.sha256(file.read_bytes()).hexdigest(),
        "alarms": [
            {
                "channel": Stream.STROKES.value,
                "kind": "gap",
                "from_s": (start - first) * 1e-9,
                "to_s": (end - first) * 1e-9,
                "cause": None,
            }
            for start, end in recording.gaps
        ],
    }


def _stacked(rows: list[Array], columns: int) -> Array:
    return np.array(rows).reshape(-1, columns)


def _rms(values: Array) -> list[float | None]:
    return [float(np.sqrt(np.nanmean(column**2))) if np.isfinite(column).any() else None for column in values.T]


def _mean(values: Array) -> list[float | None]:
    return [float(np.nanmean(column)) if np.isfinite(column).any() else None for column in values.T]


def _std(values: Array) -> list[float | None]:
    return [float(np.nanstd(column)) if np.isfinite(column).any() else None for column in values.T]
