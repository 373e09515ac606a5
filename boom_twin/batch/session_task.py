"""One session of a batch: its task, the process that does it, and the resulting row of the table."""

from __future__ import annotations

import json
import os
import sys
from contextlib import suppress
from dataclasses import asdict, dataclass
from pathlib import Path
from shutil import rmtree
from typing import TYPE_CHECKING, Any

from .. import __version__
from ..errors import BoomTwinError
from ..system.child_process import python_command
from .supervised_process import end_with_caller, run_supervised

if TYPE_CHECKING:
    from ..bag.time_window import TimeWindow
    from ..config.settings import Settings
    from ..scene.schema import Scene

OK, FAILED = "ok", "failed"
"""Status of a row."""
ALARM = ("channel", "kind", "from_s", "to_s", "cause", "told")  # keys of an alarm in a row
Row = dict[str, Any]


@dataclass(frozen=True, slots=True)
class SessionTask:
    """Task of replaying one session."""

    key: str  # of its row
    session: str
    out: str  # folder of its replay
    fingerprint: str  # see `boom_twin.batch.sources.fingerprint`
    scene: str | None
    params: str | None
    mapping: str | None
    baseline: str | None
    report: bool  # is to be written, with its pictures
    keep_bag: bool  # of the replay
    time: float  # limit, s
    memory: int  # limit of resident memory, bytes
    retries: int  # further attempts if the session fails
    start: float = 0.0  # of the window, s, see `boom_twin.bag.time_window.TimeWindow`
    duration: float | None = None
    calibrate: bool = False  # the scene's parameters from the session as well; that assumes a healthy rig


def run_task(task: SessionTask) -> Row:
    """Replay a session in a process of its own and return its row, with the reason if it failed. Dask workers call this."""
    line = json.dumps(asdict(task)).encode() + b"\n"
    for attempt in range(1, task.retries + 2):
        found = run_supervised(python_command(__name__), line, task.time, task.memory)
        if not found.reason:
            with suppress(ValueError):
                return {**json.loads(found.output), "attempts": attempt, "peak_memory_bytes": found.peak}
    return failed(task, found.reason or "its process told no result", attempt) | {"peak_memory_bytes": found.peak}


def failed(task: SessionTask, reason: str, attempts: int) -> Row:
    """Return the row of a session without a result."""
    return {**_head(task), "status": FAILED, "reason": reason, "attempts": attempts}


def _head(task: SessionTask) -> Row:
    return {
        "key": task.key,
        "session": os.path.basename(os.path.realpath(task.session)),
        "path": task.session,
        "fingerprint": task.fingerprint,
        "version": __version__,
    }


def row_of(task: SessionTask) -> Row:
    """Replay a session and return its row; errors are those of `boom_twin.offline.replay.replay`."""
    from ..bag.reader import files_sha256
    from ..bag.session_model import scene_of, settings_of
    from ..bag.time_window import TimeWindow
    from ..offline.history import draw
    from ..offline.inputs import ReplayOptions
    from ..report.evaluation import evaluated_replay
    from ..report.page import write_report
    from ..report.quantities import read
    from ..system.result_folder import REPLAY, result_folder

    session, params, mapping, baseline = (
        None if each is None else Path(each) for each in (task.session, task.params, task.mapping, task.baseline)
    )
    assert session is not None
    scene, settings = scene_of(session, task.scene), settings_of(session, params).settings
    window = TimeWindow(task.start, task.duration)
    options = ReplayOptions(mapping=mapping, baseline=baseline, window=window)
    with result_folder(Path(task.out), REPLAY, [session]) as building:
        found = evaluated_replay(building, session, scene, settings, options)
        if task.report:
            draw(found.result, found.history, found.scene, building.folder)
            write_report(found, building.folder)
        _, quantities = read(building.folder)
        if not task.keep_bag:
            rmtree(building.folder / "bag")
    result, summary = found.result, found.result.summary
    row = _head(task) | {"status": OK, "reason": None, "first_stamp_ns": result.recording.first}
    row |= {name: value for name, value in summary.items() if name not in ("events", "alarms")}
    row |= {
        "file_sha256": files_sha256(result.session),
        "rig": scene.scene.description or scene.sha256[:12],
        "report": task.report,
        "alarms": [{name: alarm[name] for name in ALARM} for alarm in summary["alarms"]],
        "events": [{"event": name, "count": count} for name, count in summary["events"].items()],
    }
    for each in quantities:
        row |= {each.name: each.value, f"{each.name}_sigma": each.sigma}
    return row | (_calibrated(task, scene.scene, settings, window) if task.calibrate else {})


def _calibrated(task: SessionTask, scene: Scene, settings: Settings, window: TimeWindow) -> Row:
    """Return the parameters that `boom_twin.calibration.run.calibrate` estimates from one session, or the reason for none."""
    from ..calibration.run import BETWEEN, calibrate

    try:
        found = calibrate([task.session], scene, None, settings, task.mapping, window=window)
    except BoomTwinError as error:
        return {"calibration_reason": str(error).replace("\n", " ")}
    row: Row = {"calibration_misfit": found.misfit, "calibration_remarks": "; ".join(found.remarks)}
    for estimate in found.estimates:
        if estimate.told:
            name = f"calibrated_{estimate.unknown.name}"
            row |= {name: estimate.value, f"{name}_sigma": (estimate.high - estimate.low) / (2.0 * BETWEEN)}
    return row


def main() -> int:
    """Do the task given on stdin and print its row. If it fails, print the reason to stderr and return exit code 1."""
    task = SessionTask(**json.loads(sys.stdin.readline()))
    end_with_caller()
    try:
        print(json.dumps(row_of(task)))
    except BoomTwinError as error:
        print(str(error).replace("\n", " "), file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
