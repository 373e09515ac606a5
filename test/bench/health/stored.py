"""Sessions of the health benchmark as they lie on disk; needs no Exudyn.

A file holds ``stamps``, ``angle_stamps`` (m,) ns; ``strokes``, ``joints`` (m, n) and ``imu`` (m, 2) as read, NaN where a
reading is missing; the truth at the same instants as ``true_strokes``, ``true_joints``, ``true_forces`` (m, n), ``true_tip``,
``true_tip_acc`` (m, 2), ``true_tip_angle`` (m,); and the programme as ``first`` (n,) strokes and ``moves`` (k, 4): cylinder
from 0, start, duration, target. SI.

``index.json`` beside the files has an entry for each: ``file``, ``group``, ``instance`` (0 is the right model), ``cause``,
``kind``, ``size``, ``onset`` (s), which are null of healthy ones, ``seed``, ``duration`` (s), and ``posture``, or ``base``: the
healthy file that a sensor fault was put on. ``instances.json`` has the parameters of every instance by name.
"""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from boom_twin.bag.session_files import samples_of
from boom_twin.types import Sample

EPOCH = 1_700_000_000_000_000_000  # ns, the start of every session
INDEX = "index.json"


def entries(folder: Path) -> list[dict[str, Any]]:
    """The index: one entry per finished session, most wanted first."""
    return list(json.loads((folder / INDEX).read_text()))


def load(path: Path) -> dict[str, np.ndarray]:
    """All arrays of a file."""
    with np.load(path) as file:
        return {name: file[name] for name in file.files}


def samples(arrays: Mapping[str, np.ndarray]) -> list[Sample]:
    """What the twin takes, in the order of stamps; messages that were lost are not there."""
    return samples_of(*(arrays[name] for name in ("stamps", "strokes", "joints", "imu", "angle_stamps")))


def save(path: Path, arrays: Mapping[str, np.ndarray]) -> None:
    """Write a file whole or not at all."""
    path.parent.mkdir(parents=True, exist_ok=True)
    draft = path.with_suffix(f".{os.getpid()}.part")
    with draft.open("wb") as file:
        np.savez_compressed(file, **arrays)
    draft.replace(path)


def save_json(path: Path, content: Any) -> None:
    """Write a file whole or not at all."""
    draft = path.with_suffix(".part")
    draft.write_text(json.dumps(content, indent=1))
    draft.replace(path)
