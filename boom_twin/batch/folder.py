"""Sessions of a batch, and the folder of its results: a file for every finished row, by which a second call goes on; table."""

from __future__ import annotations

import fcntl
import glob
import json
import os
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from hashlib import sha256
from pathlib import Path
from typing import Any

from .. import __version__
from ..bag.reader import is_session
from ..bag.session_model import session_yaml
from ..errors import BagError, UsageError
from ..system.files import DRAFT, real_path, write_atomic
from ..system.terminal_text import printable
from .session_task import ALARM, Row


def sessions_of(sources: Iterable[str]) -> list[Path]:
    """Return all sessions of the sources, each once, in the order of the sources.

    A source is the path of a session, which need not be there, or a glob. ``**`` does not follow links. UsageError if a glob
    fits no session, a folder or a single file.
    """
    found: dict[str, Path] = {}
    for source in sources:
        path = Path(source)
        paths = [path]
        if glob.has_magic(source) and not path.exists():
            paths = sorted(filter(is_session, Path(path.anchor).glob(str(path.relative_to(path.anchor)))))
        if not paths:
            raise UsageError(f"{source}: fits no session (a folder of a rosbag2, or a file). Check it, and quote it.")
        for each in paths:
            found.setdefault(os.path.realpath(each), each)
    return list(found.values())


def key_of(session: Path) -> str:
    """Return the key of a session among the results: its name and a digest of its path."""
    path = Path(os.path.realpath(session))
    name = "".join(letter if letter.isalnum() or letter in "-_" else "_" for letter in path.stem)
    return f"{name[:40]}-{sha256(str(path).encode(errors='surrogateescape')).hexdigest()[:10]}"


def fingerprint(session: Path, options: str) -> str:
    """Return a digest of the names, sizes and times of change of a session's files and of the options of the batch."""
    files = sorted(session.iterdir()) if session.is_dir() else [session, session_yaml(session)]
    told = [options]
    for file in files:
        if file.is_file():
            about = file.stat()
            told.append(f"{file.name} {about.st_size} {about.st_mtime_ns}")
    return sha256("\n".join(told).encode(errors="surrogateescape")).hexdigest()[:16]


MARK, TABLE, RIGS, PAGE = "batch.json", "sessions.parquet", "rigs.json", "batch.html"
ROWS, SESSIONS = "rows", "sessions"  # folders of the rows, and of the replays
_OWN = frozenset({MARK, TABLE, RIGS, PAGE, ROWS, SESSIONS})


@contextmanager
def batch_folder(out: Path, sessions: Sequence[Path]) -> Iterator[BatchFolder]:
    """Make or reopen the folder of a batch and lock it against other batches.

    None of the sessions to be read may lie in `out`, nor `out` in one of them. BagError if `out` holds anything else, another
    batch works in it, or it cannot be written.
    """
    place = real_path(out)
    for session in sessions:
        path = Path(os.path.realpath(session))
        if path == place or place in path.parents or path in place.parents:
            raise BagError(f"{out}: {session} lies in it, or it in the session, and a source is never touched. Choose another.")
    try:
        others = sorted({each.name for each in place.iterdir()} - _OWN) if place.exists() else []
        is_new = not (place / MARK).is_file()
        if (is_new and place.exists() and any(place.iterdir())) or any(not name.endswith(DRAFT) for name in others):
            raise BagError(f"{out}: holds {(others or ['results'])[0]}, which no batch left. Choose a new folder.")
        for folder in (place / ROWS, place / SESSIONS):
            folder.mkdir(parents=True, exist_ok=True)
        lock = os.open(place / MARK, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC | os.O_NOFOLLOW, 0o666)
    except OSError as error:
        raise BagError(f"{out}: cannot be written ({error.strerror}). Choose a folder that can.") from None
    try:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            raise BagError(f"{out}: another `boom_twin batch` is at work there. Wait for its end, or choose another.") from None
        yield BatchFolder(place, lock)
    finally:
        os.close(lock)


class BatchFolder:
    """Rows and replays of a batch in its folder; see `batch_folder`."""

    def __init__(self, folder: Path, lock: int) -> None:
        self.folder, self._lock = folder, lock

    def replay(self, key: str) -> Path:
        return self.folder / SESSIONS / key

    def kept(self, key: str, fingerprint: str) -> Row | None:
        """Return the row of a finished session with an equal `fingerprint`; None without one, or if it is damaged."""
        try:
            row = json.loads((self.folder / ROWS / f"{key}.json").read_bytes())
            return dict(row) if row["fingerprint"] == fingerprint else None
        except (OSError, ValueError, LookupError, TypeError, RecursionError):
            return None

    def keep(self, row: Row) -> None:
        write_atomic(self.folder / ROWS / f"{row['key']}.json", json.dumps(row) + "\n")

    def mark(self, total: int, finished: int) -> None:
        """Write the number of finished sessions and the state of the batch."""
        state = "complete" if finished == total else "unfinished: the same command goes on with it"
        told = {"command": "batch", "version": __version__, "sessions": total, "finished": finished, "state": state}
        os.truncate(self._lock, 0)
        os.pwrite(self._lock, (json.dumps(told) + "\n").encode(), 0)


_ALWAYS: dict[str, str] = {
    "session": "string", "path": "string", "rig": "string", "status": "string", "reason": "string",
    "first_stamp_ns": "int64", "duration_s": "double", "samples": "int64", "dropped": "int64", "outside_validity": "int64",
    "wall_s": "double", "realtime_factor": "double", "peak_memory_bytes": "int64", "tip_acceleration_max_m_s2": "double",
    "joint_residual_rms_rad": "list", "joint_residual_normalised_mean": "list", "joint_residual_normalised_std": "list",
    "session_incomplete": "string", "file_sha256": "string", "output_sha256": "string", "scene": "string",
    "scene_sha256": "string", "mapping": "string", "version": "string", "fingerprint": "string",
    "key": "string", "report": "bool", "section_heights_given": "bool", "calibration_reason": "string",
    "calibration_remarks": "string",
}  # fmt: skip
"""Columns that every table has, with their types; the others are the figures of `boom_twin.report.quantities`, numbers."""


def write_table(path: Path, rows: Sequence[Row]) -> None:
    """Write all rows as Parquet, one for each session. A column that a row lacks is null there."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    alarm = pa.struct([(name, pa.float64() if name.endswith("_s") else pa.string()) for name in ALARM])
    types: dict[str, Any] = {
        **{name: pa.list_(pa.float64()) if kind == "list" else pa.type_for_alias(kind) for name, kind in _ALWAYS.items()},
        "alarms": pa.list_(alarm),
        "events": pa.list_(pa.struct([("event", pa.string()), ("count", pa.int64())])),
    }
    rows = [{name: printable(value) if isinstance(value, str) else value for name, value in row.items()} for row in rows]
    figures = sorted({name for row in rows for name in row} - types.keys())
    words = {name for row in rows for name, value in row.items() if isinstance(value, str)}
    types |= {name: pa.string() if name in words else pa.float64() for name in figures}
    columns = [pa.array([row.get(name) for row in rows], kind) for name, kind in types.items()]
    sink = pa.BufferOutputStream()
    pq.write_table(pa.table(columns, schema=pa.schema(list(types.items()))), sink)
    write_atomic(path, sink.getvalue().to_pybytes())
