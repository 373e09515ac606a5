"""Readings of a session of the default boom, by stream."""

from __future__ import annotations

from collections.abc import Iterable
from math import inf
from pathlib import Path

import numpy as np
from recordings import read, scan
from ros_messages import SampleDecoder, load_topics, stamp_of

from boom_twin import Sample, Stream

USUAL = (Stream.STROKES, Stream.ANGLES, Stream.IMU)


def samples_in(session: Path, streams: Iterable[Stream] = USUAL, seconds: float = inf) -> list[Sample]:
    """Samples in their order, those of streams that are there, up to so long after the first one."""
    inputs, decoder, found = load_topics().inputs, SampleDecoder(4), list[Sample]()
    names = {inputs[stream].absolute: stream for stream in streams if scan(session).find(inputs[stream].absolute)}
    for name, _, msg in read(scan(session), {name: inputs[stream].type for name, stream in names.items()}):
        if found and stamp_of(msg) - found[0].stamp > 1e9 * seconds:
            break
        sample = decoder.sample_of(names[name], stamp_of(msg), msg)
        assert sample is not None
        found.append(sample)
    return found


def arrays_in(session: Path, seconds: float = inf) -> dict[Stream, tuple[np.ndarray, np.ndarray]]:
    """Stamps (ns) and values (rows, channels) of each stream."""
    samples = samples_in(session, USUAL, seconds)
    own = {stream: [sample for sample in samples if sample.stream is stream] for stream in USUAL}
    return {k: (np.array([s.stamp for s in rows]), np.array([s.values for s in rows])) for k, rows in own.items()}


def rows_in(session: Path, seconds: float = inf) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Stamps of the strokes (ns), strokes, angles and accelerations, as many rows of each."""
    (stamps, strokes), (_, angles), (_, imu) = arrays_in(session, seconds).values()
    count = min(map(len, (strokes, angles, imu)))
    return stamps[:count], strokes[:count], angles[:count], imu[:count]
