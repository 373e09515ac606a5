"""Sessions of the gate (test/gate.py): made once on the virtual rig or from other sessions, kept in out/gate/sessions."""

from __future__ import annotations

import csv
import io
import math
import os
import re
from collections.abc import Callable, Iterable
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path
from typing import Any

os.environ.setdefault("OMP_NUM_THREADS", "1")  # Exudyn's motions repeat bit for bit
os.environ.setdefault("MPLBACKEND", "Agg")

import numpy as np
from rosbags.highlevel import AnyReader
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

from boom_twin.cli.main import main as boom_twin

ROOT = Path(__file__).parents[1]
BAGS, FOLDER = ROOT / "bags", ROOT / "out" / "gate"
SESSIONS = FOLDER / "sessions"
TYPES = get_typestore(Stores.ROS2_JAZZY)
STROKES, ANGLES, CHANGES = "/cylinder_strokes", "/joint_angles", "/boom_twin/changes"
RIG = {  # sessions of the virtual rig: rates, loads, a boom that is not the twin's, faults
    "rig at 50 Hz": "--random arch --duration 30 --seed 101 --rate 50 --sensors angles,imu,forces",
    "rig at 1000 Hz": "--random high --duration 8 --seed 102 --rate 1000",
    "pump, boom 2 % wrong": "--random low --duration 40 --seed 103 --rate 100 --load pump:0.35:250@5 --wrong 0.02 --rig-seed 3",
    "wind": "--random horizontal --duration 30 --seed 104 --load wind:25 --sensors angles",
    "soft cylinder": "--random arch --duration 40 --seed 105 --rate 100 --sensors angles,imu,forces "
    "--fault cylinder_2.k:softer:0.3@10",
    "spoilt sensors": "--random arch --duration 30 --seed 106 --rate 100 --fault joint_2.sensor:spikes:0.03 "
    "--fault cylinder_3.sensor:dropout:1@8 --fault joint_4.sensor:stuck@15",
}  # fmt: skip


Message = tuple[str, int, bytes]


def messages(session: Path) -> tuple[dict[str, str], list[Message]]:
    """Return types by topic, and topic, log time (ns) and bytes of every message."""
    with AnyReader([session]) as reader:
        types = {each.topic: each.msgtype for each in reader.connections}
        return types, [(each.topic, time, bytes(data)) for each, time, data in reader.messages()]


def write(folder: Path, types: dict[str, str], rows: Iterable[Message], storage: StoragePlugin = StoragePlugin.MCAP) -> None:
    """Write a session by rosbags, which the package has no part in."""
    with Writer(folder, version=9, storage_plugin=storage) as bag:
        topics = {name: bag.add_connection(name, kind, typestore=TYPES) for name, kind in types.items()}
        for name, at, data in rows:
            bag.write(topics[name], at, data)


def edited(data: bytes, types: dict[str, str], name: str, edit: Callable[[Any], None]) -> bytes:
    message = TYPES.deserialize_cdr(data, types[name])
    edit(message)
    return bytes(TYPES.serialize_cdr(message, types[name]))


def hostile(types: dict[str, str], rows: list[Message]) -> list[Message]:
    """Return messages with duplicates, exchanged neighbours, a gap, NaN, outliers, short arrays and a clock that jumps."""

    def put(values: list[float]) -> Callable[[Any], None]:
        return lambda message: setattr(message, "position", np.array(values))

    def back(message: Any) -> None:
        message.header.stamp.sec -= 3

    done: list[Message] = []
    for k, (name, at, data) in enumerate(rows):
        if 2400 < k < 2700:
            continue
        if name in (STROKES, ANGLES) and k % 331 == 17:
            values = TYPES.deserialize_cdr(data, types[name]).position.tolist()
            bad = ([math.nan, *values[1:]], [values[0] + 0.3, *values[1:]], values[:-1], [1e30] * len(values))
            data = edited(data, types, name, put(bad[k // 331 % 4]))
        if 4000 < k < 4010:
            data = edited(data, types, name, back)
        done += [(name, at, data)] * (2 if k % 173 == 5 else 1)
        if k % 97 == 3:
            done[-2:] = [(*b[:1], a[1], b[2]) for a, b in zip(done[-2:], done[:-3:-1], strict=True)]
    return done


def loaded(types: dict[str, str], rows: list[Message]) -> list[Message]:
    """Return messages with a payload and a corrected zero that come while recording, as the live node notes them."""
    types[CHANGES] = types[STROKES]
    at = next(k for k, (name, *_) in enumerate(rows) if name == STROKES and k > len(rows) // 3)
    note = TYPES.deserialize_cdr(rows[at][2], types[STROKES])
    note.name, note.position = ["from_rest", "payload", "joint_1"], np.array([0.0, 35.0, 0.004])
    note.velocity = note.effort = np.array([])
    return [*rows[: at + 1], (CHANGES, rows[at][1], bytes(TYPES.serialize_cdr(note, types[CHANGES]))), *rows[at + 1 :]]


def write_csv(session: Path, path: Path) -> None:
    """Write the strokes, angles and accelerations of a session as CSV, a row for every stamp."""
    types, rows = messages(session)
    table: dict[int, dict[str, str]] = {}
    for name, _, data in rows:
        message = TYPES.deserialize_cdr(data, types[name])
        row = table.setdefault(message.header.stamp.sec * 10**9 + message.header.stamp.nanosec, {})
        if name in (STROKES, ANGLES):
            form = "stroke_{}_m" if name == STROKES else "joint_{}_rad"
            row |= {form.format(k + 1): repr(float(value)) for k, value in enumerate(message.position)}
        else:
            row |= {f"imu_{axis}_m_s2": repr(float(getattr(message.linear_acceleration, axis))) for axis in "xz"}
    with path.open("w", newline="") as file:
        writer = csv.DictWriter(file, ["t_s", *dict.fromkeys(name for row in table.values() for name in row)])
        writer.writeheader()
        writer.writerows({"t_s": f"{at // 10**9}.{at % 10**9:09d}", **row} for at, row in sorted(table.items()))


def sessions() -> dict[str, Path]:
    """Return all sessions by name, and make those that are not there yet."""
    SESSIONS.mkdir(parents=True, exist_ok=True)
    found = {f"{name} (bundled)": BAGS / f"{name}_session" for name in ("arch", "pump")}
    for name, options in RIG.items():
        found[name] = SESSIONS / re.sub(r"\W+", "_", name)
        if not found[name].exists():
            quiet(["rig", "--out", str(found[name]), *options.split()])
    for name, source, change in (
        ("hostile samples", "rig at 50 Hz", hostile), ("payload changed", "soft cylinder", loaded),
    ):  # fmt: skip
        found[name] = SESSIONS / name.replace(" ", "_")
        if not found[name].exists():
            types, rows = messages(found[source])
            rows = change(types, rows)
            write(found[name], types, rows)
    found["db3"], found["CSV"] = SESSIONS / "db3", SESSIONS / "arch.csv"
    if not found["db3"].exists():
        write(found["db3"], *messages(BAGS / "pump_session"), StoragePlugin.SQLITE3)
    if not found["CSV"].exists():
        write_csv(BAGS / "arch_session", found["CSV"])
    return found


def quiet(arguments: list[str]) -> str:
    """Run a command of boom_twin in this process; return what it prints, or raise if it fails."""
    printed, told = io.StringIO(), io.StringIO()
    with redirect_stdout(printed), redirect_stderr(told):
        code = boom_twin(arguments)
    if code:
        raise RuntimeError(f"boom_twin {' '.join(arguments)}: exit code {code}\n{told.getvalue()}")
    return printed.getvalue()
