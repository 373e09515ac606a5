"""Sessions of the health benchmark as they lie on disk; needs no Exudyn.

A file holds ``stamps``, ``angle_stamps`` (m,) ns, and ``strokes``, ``joints``, ``forces`` (m, n) and ``imu`` (m, 2) as read,
NaN where a reading is missing. SI.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from scenarios import Scenario

from boom_twin.bag.session_files import samples_of
from boom_twin.types import Sample

EPOCH = 1_700_000_000_000_000_000  # ns, the start of every session
ARRAYS = ("stamps", "strokes", "joints", "imu", "angle_stamps", "forces")
STREAMS = {"angles": "joints", "imu": "imu", "forces": "forces"}


def path_of(folder: Path, each: Scenario) -> Path:
    """Its file."""
    return folder / (f"learn_{-each.number:02d}.npz" if each.number < 0 else f"session_{each.number:04d}.npz")


def load_samples(folder: Path, each: Scenario) -> list[Sample]:
    """What the twin takes, in the order of stamps; streams that are not recorded and messages that were lost are not there."""
    with np.load(path_of(folder, each)) as file:
        arrays = {name: file[name] for name in ARRAYS}
    left_out = [name for stream, name in STREAMS.items() if stream not in each.streams]
    return samples_of(*(None if name in left_out else arrays[name] for name in ARRAYS))


def save(path: Path, arrays: Mapping[str, np.ndarray]) -> None:
    """Write a file whole or not at all."""
    path.parent.mkdir(parents=True, exist_ok=True)
    draft = path.with_suffix(f".{os.getpid()}.part")
    with draft.open("wb") as file:
        np.savez_compressed(file, **arrays)
    draft.replace(path)
