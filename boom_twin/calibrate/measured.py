"""What a session measured, as arrays."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..errors import BagError
from ..io.ahead import Ahead
from ..io.boom_names import refuse_other_names
from ..io.reader import Session, check_topic, scan
from ..io.topics import Topics
from ..received import open_received
from ..records import Array, Change, Sample, Stream

NANO = 1e-9
SHOWN = 12  # hex digits of a hash
LOADS = ("payload", "line_fill")
MISSING = 0.5  # largest share of values of a channel that may be missing


@dataclass(frozen=True)
class Series:
    """Samples of one stream: stamps (ns, ascending), shape (m,), and values (SI), shape (m, channels)."""

    stamps: NDArray[np.int64]
    values: Array

    def of(self, start: int, stop: int) -> Series:
        """Those with stamps from `start` to `stop`."""
        inside = (self.stamps >= start) & (self.stamps <= stop)
        return Series(self.stamps[inside], self.values[inside])


@dataclass(frozen=True)
class Measured:
    """One session.

    Attributes
    ----------
    name : str
    digest : str
        First digits of the SHA-256 of its files.
    series : dict of Stream to Series
        The streams that it has.
    changed : bool
        Whether something was changed while it was recorded: a load, a zero.
    """

    name: str
    digest: str
    series: dict[Stream, Series]
    changed: bool = False


def read_sessions(paths: Sequence[Path], topics: Topics, joints: int) -> list[Measured]:
    """Read sessions, all at once.

    Raises
    ------
    BagError
        One cannot be read, is of another boom, or lacks strokes or angles of this one.
    """
    sessions = [scan(path) for path in paths]
    for session in sessions:
        refuse_other_names(session, topics, joints)
    wanted = [_wanted(session, topics) for session in sessions]
    with ExitStack() as stack:
        readers = []
        for session, names in zip(sessions, wanted, strict=True):
            readers.append(Ahead(session.path, topics, names, joints))
            stack.callback(readers[-1].stop)
        return [_measured(session, reader, joints) for session, reader in zip(sessions, readers, strict=True)]


def _wanted(session: Session, topics: Topics) -> list[str]:
    """Topics of strokes and angles, which must be there, and of the IMU if it is."""
    names = []
    for stream in (Stream.STROKES, Stream.ANGLES):
        topic = topics.inputs[stream]
        check_topic(session, topic.name, topic.type)
        names.append(topic.name)
    imu = session.find(topics.inputs[Stream.IMU].name)
    return list(dict.fromkeys([*names, *([topics.inputs[Stream.IMU].name] if imu and imu.count else [])]))


def _measured(session: Session, samples: Ahead, joints: int) -> Measured:
    found: dict[Stream, list[Sample]] = {stream: [] for stream in Stream}
    changed = False
    samples.wait_ready()
    for sample in samples:
        if isinstance(sample, Change):
            changed |= any(sample.zeros.values()) or max(sample.settings.get(load, -1.0) for load in LOADS) >= 0.0
        elif sample is not None:
            found[sample.stream].append(sample)
    series = {stream: _series(group) for stream, group in found.items() if group}
    for stream, word in ((Stream.STROKES, "cylinder"), (Stream.ANGLES, "joint")):
        if stream not in series:
            raise BagError(
                f"{session.path}: no usable value of {word}_1..{joints} (met: {_told(samples)}). "
                "Is it a session of this boom? If its sensors have other names, give a mapping."
            )
    lacking = [f"cylinder_{i + 1}" for i in np.flatnonzero(_shares_missing(series[Stream.STROKES]) > MISSING)]
    if lacking:
        raise BagError(
            f"{session.path}: {', '.join(lacking)}: more than half of the values are missing. The scene has {joints} "
            "cylinders: give a session of this boom."
        )
    return Measured(session.path.resolve().name, _digest(session), series, changed)


def _series(samples: list[Sample]) -> Series:
    """Samples by stamp, the first of equal ones."""
    stamps, first = np.unique(np.array([sample.stamp for sample in samples]), return_index=True)
    return Series(stamps, np.array([samples[i].values for i in first]))


def _shares_missing(series: Series) -> Array:
    return np.asarray(np.isnan(series.values).mean(axis=0))


def _told(samples: Ahead) -> str:
    return ", ".join(f"{name}: {count}" for name, count in samples.oddities.items()) or "nothing"


def _digest(session: Session) -> str:
    digest = hashlib.sha256()
    for file in session.files:
        with open_received(file.path) as stream:
            digest.update(hashlib.file_digest(stream, "sha256").digest())
    return digest.hexdigest()[:SHOWN]
