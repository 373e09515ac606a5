"""Measured sessions as arrays."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from heapq import merge
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..bag.advice import refuse_conflicts
from ..bag.reader import Session, check_topic, files_sha256, scan
from ..bag.session_file import WHOLE, TimeWindow
from ..errors import BagError
from ..messages.topic_table import Topics
from ..offline.session_samples import SessionSamples
from ..types import SENSORS, Array, Change, Sample, Stream, channels_of

NEEDED = (Stream.STROKES,)  # streams without which nothing can be estimated
SHOWN = 12  # hex digits of a hash
LOADS = ("payload", "line_fill")
MISSING = 0.5  # largest share of values of a channel that may be missing


@dataclass(frozen=True)
class Series:
    """Samples of one stream: stamps (ns, ascending), shape (m,), and values (SI), shape (m, channels)."""

    stamps: NDArray[np.int64]
    values: Array

    def of(self, start: int, stop: int) -> Series:
        """Return the samples with stamps from `start` to `stop`."""
        inside = (self.stamps >= start) & (self.stamps <= stop)
        return Series(self.stamps[inside], self.values[inside])


@dataclass(frozen=True)
class MeasuredSession:
    """One session."""

    name: str
    digest: str  # first digits of the SHA-256 of its files
    series: dict[Stream, Series]  # the streams that it has
    changed: bool = False  # a load or a zero was changed while it was recorded

    def samples(self, zeros: Mapping[str, float] | None = None) -> list[Sample]:
        """Return all samples in the order of their stamps, strokes first, less the `zeros` by channel."""
        joints, streams = self.series[Stream.STROKES].values.shape[1], []
        for order, (stream, names) in enumerate(channels_of(joints).items()):
            if stream not in self.series:
                continue
            series, shift = self.series[stream], np.array([(zeros or {}).get(name, 0.0) for name in names])
            pairs = zip(series.stamps.tolist(), series.values - shift, strict=True)
            streams.append([(stamp, order, Sample(stream, stamp, row)) for stamp, row in pairs])
        return [sample for _, _, sample in merge(*streams, key=lambda item: item[:2])]


def read_sessions(paths: Sequence[Path], topics: Topics, joints: int, window: TimeWindow = WHOLE) -> list[MeasuredSession]:
    """Read sessions, the same window of each; BagError for one of another boom, without its strokes, or that cannot be read."""
    sessions = [scan(path) for path in paths]
    for session in sessions:
        refuse_conflicts(session, topics, joints)
    wanted = [_wanted(session, topics) for session in sessions]
    pairs = zip(sessions, wanted, strict=True)
    return [_measured(each, SessionSamples(each, topics, names, joints, window), joints) for each, names in pairs]


def _wanted(session: Session, topics: Topics) -> list[str]:
    """Return the topics of the streams of `NEEDED`, which must be there, and of the others if they are."""
    names = []
    for stream, topic in topics.inputs.items():
        found = session.find(topic.name)
        if stream in NEEDED:
            check_topic(session, topic.name, topic.type)
        if stream in NEEDED or (found is not None and found.count and topic.name in topics.heard):
            names.append(topic.name)
    return list(dict.fromkeys(names))


def _measured(session: Session, samples: SessionSamples, joints: int) -> MeasuredSession:
    found: dict[Stream, list[Sample]] = {stream: [] for stream in Stream}
    changed = False
    for sample in samples.samples():
        if isinstance(sample, Change):
            changed |= any(sample.zeros.values()) or max(sample.settings.get(load, -1.0) for load in LOADS) >= 0.0
        elif sample is not None:
            found[sample.stream].append(sample)
    series = {stream: _series(group) for stream, group in found.items() if group}
    for stream in NEEDED:
        if stream not in series:
            raise BagError(
                f"{session.path}: no usable value of {SENSORS[stream].named}_1..{joints} (met: {_told(samples)}). "
                "Is it a session of this boom? If its sensors have other names, give a mapping."
            )
    lacking = [f"cylinder_{i + 1}" for i in np.flatnonzero(np.isnan(series[Stream.STROKES].values).mean(axis=0) > MISSING)]
    if lacking:
        raise BagError(
            f"{session.path}: {', '.join(lacking)}: more than half of the values are missing. The scene has {joints} "
            "cylinders: give a session of this boom."
        )
    return MeasuredSession(session.path.resolve().name, files_sha256(session)[:SHOWN], series, changed)


def _series(samples: list[Sample]) -> Series:
    stamps, first = np.unique(np.array([sample.stamp for sample in samples]), return_index=True)
    return Series(stamps, np.array([samples[i].values for i in first]))


def _told(samples: SessionSamples) -> str:
    return ", ".join(f"{name}: {count}" for name, count in samples.oddities.items()) or "nothing"
