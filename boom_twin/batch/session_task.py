"""Sessions of a batch in parallel: task, supervised process and row of each; threads that wait for them, here or on Dask."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import CancelledError
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass
from pathlib import Path
from queue import Empty, SimpleQueue
from shutil import rmtree
from tempfile import TemporaryFile
from threading import Thread
from typing import TYPE_CHECKING, Any

from .. import __version__
from ..errors import BagError, BoomTwinError, UsageError
from ..system.processes import python_command

if TYPE_CHECKING:
    from distributed import Client

    from ..bag.session_file import TimeWindow
    from ..bag.session_model import SessionScene
    from ..config.settings import Settings
    from ..scene.schema import Scene


@dataclass(frozen=True, slots=True)
class Outcome:
    """Result of a supervised process."""

    output: bytes  # content of its stdout; whole only if there is no reason
    reason: str  # of the failure in one line; empty if it ended with code 0
    peak: int  # largest observed resident memory, bytes; pages that its processes share are counted in each


def run_supervised(command: Sequence[str], task: bytes, seconds: float, memory: int) -> Outcome:
    """Run `command` with the line `task` on stdin and return its result.

    Stdin stays open: its end shows the process that its caller has ended. The process leads a group of its own, and all of
    the group is ended with it. It may take so many `seconds`, and with all its children so much resident `memory`, bytes.
    """
    stderr_bytes = 2000  # number of last bytes of a process's stderr that are reported
    with TemporaryFile() as out, TemporaryFile() as told:
        process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=out, stderr=told, start_new_session=True)
        assert process.stdin is not None
        try:
            with suppress(BrokenPipeError):
                process.stdin.write(task)
                process.stdin.flush()
            reason, peak = _watch(process, seconds, memory)
        finally:
            with suppress(ProcessLookupError):
                os.killpg(process.pid, signal.SIGKILL)
            code = process.wait()
            with suppress(BrokenPipeError):
                process.stdin.close()
        out.seek(0)
        if not reason and code:
            told.seek(max(0, told.seek(0, os.SEEK_END) - stderr_bytes))
            lines = told.read().decode(errors="replace").strip().splitlines()
            cause = f"signal {-code}" if code < 0 else f"itself with code {code}"
            reason = lines[-1] if lines and code > 0 else f"its process was ended by {cause}"
        return Outcome(out.read(), reason, peak)


def _watch(process: subprocess.Popen[bytes], seconds: float, memory: int) -> tuple[str, int]:
    """Wait for the end of a process. Return the limit that it passed (empty if none) and its largest observed memory, bytes."""
    look_period = 0.1  # seconds between two measurements of the memory
    end, peak = time.monotonic() + seconds, 0
    while True:
        with suppress(subprocess.TimeoutExpired):
            process.wait(look_period)
            return "", peak
        peak = max(peak, _memory(process.pid))
        if peak > memory:
            return f"needs {peak / 1e6:.0f} MB of memory, more than {memory / 1e6:.0f} MB. Raise --memory.", peak
        if time.monotonic() > end:
            return f"takes longer than {seconds:g} s. Raise --timeout.", peak


def _memory(pid: int) -> int:
    """Return the resident memory of a process and all its children, bytes."""
    import psutil

    total = 0
    with suppress(psutil.Error):
        process = psutil.Process(pid)
        for each in (process, *process.children(recursive=True)):
            with suppress(psutil.Error):
                total += each.memory_info().rss
    return total


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
    report: bool  # is to be written, with its pictures
    keep_bag: bool  # of the replay
    time: float  # limit, s
    memory: int  # limit of resident memory, bytes
    retries: int  # further attempts if the session fails
    start: float = 0.0  # of the window, s, see `boom_twin.bag.session_file.TimeWindow`
    duration: float | None = None
    calibrate: bool = False  # the scene's parameters from the session as well; that assumes a healthy rig
    fatigue: float | None = None  # detail category, MPa, of the damage of all stations; None: it is not counted


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
    from ..bag.session_file import TimeWindow
    from ..bag.session_model import scene_of, settings_of
    from ..offline.history import draw
    from ..offline.inputs import ReplayOptions
    from ..report.evaluation import evaluated_replay
    from ..report.page import write_report
    from ..system.result_folder import REPLAY, result_folder

    session, params = Path(task.session), None if task.params is None else Path(task.params)
    scene, settings = scene_of(session, task.scene), settings_of(session, params).settings
    window = TimeWindow(task.start, task.duration)
    options = ReplayOptions(mapping=task.mapping, window=window)
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
        "rig": _rig(result.session.notes, scene),
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


def _rig(notes: Mapping[str, str], scene: SessionScene) -> str:
    """Return the name of a session's rig: its note ``rig``, else description and digest of its scene."""
    return notes.get("rig", "").strip() or f"{scene.scene.description} scene {scene.sha256[:12]}".strip()


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


REMEDY = 'Run `pip install "boom_twin[batch]"`.'
KILLED = "the workers that had it were ended from outside. Look for what ends them, as the system's memory."


@dataclass(frozen=True, slots=True)
class Workers:
    """Workers of a batch: `work` returns the row of one session, `capacity` the number of sessions that may run at once."""

    work: Callable[[SessionTask], Row]
    capacity: Callable[[], int]
    dashboard: str = ""


@contextmanager
def connected(scheduler: str | None, workers: int | None) -> Iterator[Workers]:
    """Yield the workers of the scheduler at an address (``tcp://host:8786``), or those of this process, which opens no port.

    `workers` is the number of sessions at once on this machine, by default that of its cores. UsageError if Dask is not
    installed, BagError if no scheduler answers there.
    """
    connect_timeout = 20.0  # seconds for a scheduler to answer
    if scheduler is None:
        count = workers or os.cpu_count() or 1
        yield Workers(run_task, lambda: count)
        return
    try:
        from distributed import Client
    except ImportError:
        raise UsageError(f"dask is not installed, and --scheduler needs it. {REMEDY}") from None
    try:
        client = Client(scheduler, timeout=connect_timeout, set_as_default=False)
    except (TimeoutError, OSError, ValueError) as error:
        remedy = "Start `dask scheduler`, check host and port."
        raise BagError(f"--scheduler {scheduler}: no Dask scheduler answers ({type(error).__name__}). {remedy}") from None
    with client:
        yield on_dask(client, run_task)


def on_dask(client: Client, work: Callable[[SessionTask], Row]) -> Workers:
    """Return workers that pass `work` to those of a Dask cluster.

    A task whose worker ends (killed, out of memory, a lost machine) goes to another worker. When Dask gives the task up, that
    counts as one of its attempts.
    """
    from distributed import KilledWorker

    def row_of(task: SessionTask) -> Row:
        for attempt in range(1, task.retries + 2):
            future = client.submit(work, task, key=f"{task.key}-{attempt}", pure=False, retries=0)
            try:
                return dict(future.result())
            except KilledWorker:
                reason = KILLED
            except CancelledError:  # as of a row that was lost with its worker
                reason = f"Dask gave it up ({future.status})"
            except Exception as error:
                reason = f"{type(error).__name__}: {error}"
        return failed(task, reason, attempt)

    return Workers(row_of, lambda: sum(client.nthreads().values()), client.dashboard_link)


def rows_of(workers: Workers, tasks: Sequence[SessionTask]) -> Iterator[Row]:
    """Yield the rows of all tasks as they finish. A failed task does not affect other rows.

    A scheduler gets no more tasks than its workers have threads. When a worker ends, Dask counts that against every task
    that waits there, not only against the running one. Workers that join later are used, too.
    """
    count_period = 5  # seconds between two counts of a cluster's workers
    waiting, rows, threads = deque(tasks), SimpleQueue[Row](), list[Thread]()

    def go() -> None:
        while waiting:
            task = waiting.popleft()
            try:
                row = workers.work(task)
            except Exception as error:
                row = failed(task, f"{type(error).__name__}: {error}", 1)
            rows.put(json.loads(json.dumps(row, ensure_ascii=False).encode(errors="replace")))  # names that are not UTF-8

    try:
        for _ in tasks:
            row = None
            while row is None:
                for _ in range(min(max(workers.capacity(), 1), len(tasks)) - len(threads)):
                    threads.append(Thread(target=go, daemon=True))  # sessions end with this process, see end_with_caller
                    threads[-1].start()
                try:
                    row = rows.get(timeout=count_period)
                except Empty:
                    continue
            yield row
    finally:
        waiting.clear()


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
