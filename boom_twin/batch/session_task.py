"""Sessions of a batch in parallel: task, process and row of each, here or on the workers of Dask."""

from __future__ import annotations

import json
import os
import resource
import signal
import subprocess
import sys
import time
from collections import deque
from collections.abc import Generator, Iterable, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass
from pathlib import Path
from shutil import rmtree
from tempfile import TemporaryFile
from threading import Thread
from typing import TYPE_CHECKING, Any

from .. import __version__
from ..errors import BagError, BoomTwinError, UsageError
from ..system.processes import python_command

if TYPE_CHECKING:
    from ..bag.session_file import TimeWindow
    from ..config.settings import Settings
    from ..scene.schema import Scene


class SessionProcess:
    """Process that runs `command` with the line `task` on stdin, and has so many `seconds`.

    Stdin stays open: its end shows the process that its caller has ended. The process leads a group of its own, and all of
    the group is ended with it.
    """

    def __init__(self, command: Sequence[str], task: bytes, seconds: float) -> None:
        self._out, self._told, self._seconds = TemporaryFile(), TemporaryFile(), seconds  # noqa: SIM115
        streams: dict[str, Any] = {"stdin": subprocess.PIPE, "stdout": self._out, "stderr": self._told}
        self._process = subprocess.Popen(command, **streams, start_new_session=True)
        self._due = time.monotonic() + seconds
        assert self._process.stdin is not None
        with suppress(BrokenPipeError):
            self._process.stdin.write(task)
            self._process.stdin.flush()

    @property
    def is_over(self) -> bool:
        """Return True if the process has ended, or has had its time."""
        return self._process.poll() is not None or time.monotonic() > self._due

    def end(self) -> tuple[bytes, str]:
        """End the group, and return stdout and the reason of a failure in one line; empty if the process ended with code 0."""
        stderr_bytes = 2000  # number of last bytes of stderr that are looked at
        is_late = self._process.poll() is None
        with suppress(ProcessLookupError):
            os.killpg(self._process.pid, signal.SIGKILL)
        code = self._process.wait()
        with self._out as out, self._told as told, suppress(BrokenPipeError):
            out.seek(0)
            told.seek(max(0, told.seek(0, os.SEEK_END) - stderr_bytes))
            output, lines = out.read(), told.read().decode(errors="replace").strip().splitlines()
            assert self._process.stdin is not None
            self._process.stdin.close()
        if is_late:
            return output, f"takes longer than {self._seconds:g} s. Raise --timeout."
        cause = f"signal {-code}" if code < 0 else f"itself with code {code}"
        return output, "" if code == 0 else lines[-1] if lines and code > 0 else f"its process was ended by {cause}"


def end_with_caller() -> None:
    """End this process and its group when its caller ends. Call it after the line on stdin is read."""
    Thread(target=_wait_for_end, name="caller", daemon=True).start()


def _wait_for_end() -> None:
    sys.stdin.read()
    if os.getpgid(0) == os.getpid():
        os.killpg(0, signal.SIGKILL)


OK, FAILED = "ok", "failed"  # status of a row
ALARM = ("channel", "kind", "from_s", "to_s", "cause", "told")  # keys of an alarm in a row
Row = dict[str, Any]


@dataclass(frozen=True, slots=True)
class SessionTask:
    """Task of replaying one session."""

    key: str  # of its row
    session: str
    out: str  # folder of its replay
    fingerprint: str  # see `boom_twin.batch.folder.fingerprint`
    scene: str | None
    params: str | None
    mapping: str | None
    namespace: str
    report: bool  # is to be written, with its pictures
    keep_bag: bool  # of the replay
    time: float  # limit, s
    memory: int  # limit of the data of each of its processes, bytes
    start: float = 0.0  # of the window, s, see `boom_twin.bag.session_file.TimeWindow`
    duration: float | None = None
    calibrate: bool = False  # the scene's parameters from the session as well; that assumes a healthy rig
    fatigue: float | None = None  # detail category, MPa, of the damage of all stations; None: it is not counted


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
    from ..bag.session_file import TimeWindow
    from ..bag.session_model import scene_of, settings_of
    from ..offline.history import draw
    from ..offline.inputs import ReplayOptions
    from ..report.evaluation import evaluated_replay
    from ..report.page import write_report
    from ..system.result_folder import REPLAY, result_folder

    session, params = Path(task.session), None if task.params is None else Path(task.params)
    scene, settings = scene_of(session, task.scene), settings_of(session, params, task.namespace).settings
    window = TimeWindow(task.start, task.duration)
    options = ReplayOptions(mapping=task.mapping, window=window, namespace=task.namespace)
    with result_folder(Path(task.out), REPLAY, [session]) as building:
        found = evaluated_replay(building, session, scene, settings, options, category=task.fatigue)
        if task.report:
            draw(found.result, found.history, found.scene, building)
            write_report(found, building)
        if not task.keep_bag:
            rmtree(building / "bag")
    result, summary = found.result, found.result.summary
    row = _head(task) | {"status": OK, "reason": None, "first_stamp_ns": result.recording.first}
    row |= {name: value for name, value in summary.items() if name not in ("events", "alarms")}
    row |= {
        "file_sha256": files_sha256(result.session),
        # by its note, else by description and digest of its scene
        "rig": result.session.notes.get("rig", "").strip() or f"{found.scene.description} scene {scene.sha256[:12]}".strip(),
        "report": task.report,
        "alarms": [{name: alarm[name] for name in ALARM} for alarm in summary["alarms"]],
        "events": [{"event": name, "count": count} for name, count in summary["events"].items()],
    }
    for each in found.quantities:
        row |= {each.name: each.value, f"{each.name}_sigma": each.sigma}
    if found.fatigue:
        row |= {"fatigue_category_MPa": task.fatigue, "section_heights_given": found.has_heights}
        row |= {f"fatigue_damage_{each.station.key}": each.damage for each in found.fatigue}
    return row | (_calibrated(task, scene.scene, settings, window) if task.calibrate else {})


def _calibrated(task: SessionTask, scene: Scene, settings: Settings, window: TimeWindow) -> Row:
    """Return the parameters that `boom_twin.calibration.run.calibrate` estimates from one session, or the reason for none."""
    from ..calibration.run import BETWEEN, calibrate

    try:
        found = calibrate([task.session], scene, None, settings, task.mapping, window=window, namespace=task.namespace)
    except BoomTwinError as error:
        return {"calibration_reason": str(error).replace("\n", " ")}
    row: Row = {"calibration_misfit": found.misfit, "calibration_remarks": "; ".join(found.remarks)}
    for estimate in found.estimates:
        if estimate.told:
            name = f"calibrated_{estimate.unknown.name}"
            row |= {name: estimate.value, f"{name}_sigma": (estimate.high - estimate.low) / (2.0 * BETWEEN)}
    return row


REMEDY = 'Run `pip install "boom_twin[batch]"`.'


def rows_here(tasks: Iterable[SessionTask], count: int) -> Generator[Row]:
    """Yield the rows of all tasks as they finish, `count` at a time, each from a process of its own."""
    look_period = 0.05  # seconds between two looks at the processes
    waiting, running = deque(tasks), list[tuple[SessionTask, SessionProcess]]()
    try:
        while waiting or running:
            while waiting and len(running) < count:
                task = waiting.popleft()
                line = json.dumps(asdict(task)).encode() + b"\n"
                running.append((task, SessionProcess(python_command(__name__), line, task.time)))
            time.sleep(look_period)
            for each in [each for each in running if each[1].is_over]:
                running.remove(each)
                yield _row(each[0], *each[1].end())
    finally:
        for _, process in running:
            process.end()


def _row(task: SessionTask, output: bytes, reason: str) -> Row:
    row = _head(task) | {"status": FAILED, "reason": reason} if reason else json.loads(output)
    found: Row = json.loads(json.dumps(row, ensure_ascii=False).encode(errors="replace"))  # names that are not UTF-8
    return found


def run_task(task: SessionTask) -> Row:
    """Return the row of one task. Dask workers call this."""
    return next(rows_here([task], 1))


def rows_on_cluster(scheduler: str, tasks: Sequence[SessionTask]) -> Generator[Row]:
    """Yield the rows of all tasks as they finish on the workers of a Dask scheduler at an address (``tcp://host:8786``).

    Dask gives the task of a worker that ended to others. The row of a task that it gives up has the reason. UsageError if
    Dask is not installed, BagError if no scheduler answers there.
    """
    connect_timeout = 20.0  # seconds for a scheduler to answer
    try:
        from distributed import Client, as_completed
    except ImportError:
        raise UsageError(f"dask is not installed, and --scheduler needs it. {REMEDY}") from None
    try:
        client = Client(scheduler, timeout=connect_timeout)
    except (TimeoutError, OSError, ValueError) as error:
        remedy = "Start `dask scheduler`, check host and port."
        raise BagError(f"--scheduler {scheduler}: no Dask scheduler answers ({type(error).__name__}). {remedy}") from None
    with client:
        futures = {client.submit(run_task, task, pure=False): task for task in tasks}
        for future in as_completed(futures):
            try:
                yield future.result()
            except Exception as error:
                yield _row(futures[future], b"", f"{type(error).__name__}: {error}")


def main() -> int:
    """Do the task given on stdin and print its row. If it fails, print the reason to stderr and return exit code 1."""
    task = SessionTask(**json.loads(sys.stdin.readline()))
    end_with_caller()
    resource.setrlimit(resource.RLIMIT_DATA, (task.memory, task.memory))
    try:
        row = row_of(task)
    except BoomTwinError as error:
        reason = str(error).replace("\n", " ")
    except MemoryError:
        reason = f"needs more than {task.memory / 1e6:.0f} MB of memory. Raise --memory."
    else:
        print(json.dumps(row | {"peak_memory_bytes": 1024 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss}))
        return 0
    print(reason, file=sys.stderr)
    return 1


if __name__ == "__main__":
    sys.exit(main())
