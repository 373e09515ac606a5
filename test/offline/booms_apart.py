"""Booms unlike the default one, and sessions of them at rest; all made up."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from default_boom import anew
from oracle import booms
from recordings import SessionMetadata, write_session

from boom_twin import load_scene, statics

ORDERS = {3: (0, 1, 2), 4: (0, 1, 2, 3), 5: (0, 1, 1, 2, 3)}
POSTURES = {3: (60, 20, -30), 4: (60, 20, -30, -80), 5: (75, 50, 10, -5, -40)}
START, STEP = 1_700_000_000_000_000_000, 5_000_000


def scene_text(sections: int, closed_longer: float = 0.0) -> str:
    """The default boom with a section more or less; all cylinders longer by so much (m) at the same stroke."""
    spec = booms.document()
    for key in ("sections", "joints"):
        spec[key] = [spec[key][i] for i in ORDERS[sections]]
    spec["postures"] = {"arch": list(POSTURES[sections])}
    for joint in spec["joints"]:
        joint["cylinder"] = joint["cylinder"] | {"closed_length": joint["cylinder"]["closed_length"] + closed_longer}
    return anew(booms.scene_of(spec))


def session(path: Path, text: str, *, keep: bool, rows: int = 300, bias: float = 0.0, strokes: str = "lengths") -> Path:
    """Write a session at rest of the boom of a scene's text, which it keeps or not; joint_1 reads `bias` (rad) too much.

    Its strokes are ``lengths``, or the drives, by the name ``strokes`` of `statics`.
    """
    file = path.with_suffix(".scene.yaml")
    file.write_text(text)
    scene, noise = load_scene(file), np.random.default_rng(1)
    rest = statics(scene, posture="arch")
    read, joints = (np.tile(values, (rows, 1)) for values in (getattr(rest, strokes), rest.joints))
    joints[:, 0] += bias
    joints += noise.normal(0.0, 2e-4, joints.shape)
    write_session(path, START + np.arange(rows) * STEP, read, joints, None, {"origin": "synthetic, a test"})
    if keep:
        SessionMetadata("0", text).write(path)
    return path
