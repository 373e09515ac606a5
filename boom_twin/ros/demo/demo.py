"""What a recorded live run shows, in numbers."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import BagError
from ..io.intake import stamp_of
from ..io.reader import Session, read, scan
from ..io.topics import Output, Topic, load_topics
from ..records import Array, Stream
from ..truth import TipTruth, load_truth

Positions = dict[int, tuple[float, float]]


@dataclass(frozen=True)
class Scorecard:
    """A live run.

    Attributes
    ----------
    positions : dict of int to (float, float)
        Predicted tip (x, z of ``base_link``, m) by stamp, as it arrived.
    residual_sets : int
        Messages that arrived.
    latency_ms : ndarray, shape (2,)
        Median and 99 % quantile from the arrival of a stroke to that of its prediction, both at the recorder.
    tip_error_rms : float or None
        Against the truth, m; None without one.
    residual_rms : dict of str to float
        Measured minus predicted by channel, in the unit of the sensor.
    """

    positions: Positions
    residual_sets: int
    latency_ms: Array
    tip_error_rms: float | None
    residual_rms: dict[str, float]

    def as_text(self, session: str, sent: int, equal: int) -> list[str]:
        """Lines of a short table; `sent` strokes were played, a replay gave `equal` of the predictions again."""
        arrived, (median, slowest) = len(self.positions), self.latency_ms
        rows = [
            ("session", session),
            ("stroke samples sent", f"{sent}"),
            ("predictions received", f"{arrived}"),
            ("lost", f"{sent - arrived}"),
            ("residual sets", f"{self.residual_sets}"),
            ("equal to a replay", f"{equal} of {arrived}, to the last bit"),
            ("latency, median / 99 %", f"{median:.1f} / {slowest:.1f} ms"),
        ]
        if self.tip_error_rms is not None:
            rows.append(("tip position error", f"{self.tip_error_rms * 1e3:.2f} mm rms against the rig's truth"))
        for name, value in self.residual_rms.items():
            amount = f"{value * 1e3:.3f} mrad rms" if name.startswith("joint") else f"{value:.3f} m/s^2 rms"
            rows.append((f"residual {name}", amount))
        return [f"{name:22s}  {value}" for name, value in rows]


def score(recorded: Path) -> Scorecard:
    """The numbers of one recorded run; with those against the truth, if the session's truth lies in the same folder.

    Raises
    ------
    BagError
        The recording cannot be read, or holds no prediction.
    """
    topics, session = load_topics(), scan(recorded)
    arrived = _messages(session, topics.outputs[Output.TIP_POSITION])
    strokes = {stamp_of(msg): time for time, msg in _messages(session, topics.inputs[Stream.STROKES])}
    if not arrived or not strokes:
        raise BagError(f"{recorded}: the node published no prediction.")
    delays = [time - strokes[stamp_of(msg)] for time, msg in arrived if stamp_of(msg) in strokes]
    positions = {stamp_of(msg): (msg.point.x, msg.point.z) for _, msg in arrived}
    residuals = _messages(session, topics.outputs[Output.RESIDUALS])
    truth = load_truth(recorded)
    return Scorecard(
        positions=positions,
        residual_sets=len(residuals),
        latency_ms=np.quantile(delays, [0.5, 0.99]) * 1e-6 if delays else np.full(2, np.nan),
        tip_error_rms=None if truth is None else _tip_error(positions, truth, min(strokes)),
        residual_rms=_residual_rms([msg for _, msg in residuals]),
    )


def _messages(session: Session, topic: Topic) -> list[tuple[int, Any]]:
    """Log times and messages of one topic; none if it has none."""
    known = session.find(topic.absolute)
    if known is None or known.count == 0:
        return []
    return [(time, msg) for _, time, msg in read(session, {topic.absolute: topic.type})]


def _tip_error(positions: Positions, truth: TipTruth, first: int) -> float:
    """Root mean square distance between predicted and true tip, m; `first` is the stamp of the truth's first row."""
    times = (np.array(list(positions)) - first) * 1e-9 + truth.times[0]
    x, z = np.array(list(positions.values())).T
    true = truth.position.T
    squares = (x - np.interp(times, truth.times, true[0])) ** 2 + (z - np.interp(times, truth.times, true[1])) ** 2
    return float(np.sqrt(np.mean(squares)))


def _residual_rms(residuals: list[Any]) -> dict[str, float]:
    """By channel, over the values that are there."""
    values: dict[str, list[NDArray[np.float64]]] = {}
    for msg in residuals:
        for name, value in zip(msg.name, msg.position, strict=True):
            values.setdefault(name, []).append(value)
    return {name: float(np.sqrt(np.nanmean(np.square(column)))) for name, column in sorted(values.items())}
