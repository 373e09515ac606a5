"""``boom_twin batch``: many recorded sessions through the twin, one table."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from collections.abc import Sequence
from contextlib import closing
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

from ..errors import UsageError
from ..offline.progress import ProgressLine
from .arguments import add_session, at_least, positive, window_of
from .output import tell

if TYPE_CHECKING:
    from ..batch.folder import BatchFolder
    from ..batch.session_task import SessionTask


def add_arguments(parser: ArgumentParser) -> None:
    sources = "sessions, or globs (quote them)"
    parser.add_argument("bags", nargs="+", metavar="BAG", help=sources)
    place = "folder for tables and replays: new, empty, or of an earlier batch, which is continued"
    parser.add_argument("--out", required=True, metavar="DIR", type=Path, help=place)
    parser.add_argument("--scheduler", metavar="ADDRESS", help="running Dask scheduler (default: this machine)")
    parser.add_argument("--workers", metavar="N", type=at_least(1), help="sessions at a time (default: one per core)")
    scene = "scene file (YAML) for all sessions; without it, the one that each was made with, else the default scene"
    add_session(parser, scene=scene)
    parser.add_argument("--report", action="store_true", help="write report.html with its pictures for every session")
    parser.add_argument("--calibrate", action="store_true", help="estimate the scene's parameters from every session as well")
    fatigue = "damage of all stations, summed up by rig: detail category of EN 1993-1-9, MPa (default 71); extra fatigue"
    parser.add_argument("--fatigue", nargs="?", type=positive, const=71.0, metavar="CATEGORY", help=fatigue)
    parser.add_argument("--keep-bags", action="store_true", help="keep the result bag of every session")
    parser.add_argument("--timeout", metavar="S", type=positive, default=3600.0, help="limit for a session, s (default 3600)")
    parser.add_argument("--memory", metavar="MB", type=positive, default=2000.0, help="limit for a process, MB (default 2000)")
    parser.add_argument("--retry-failed", action="store_true", help="repeat sessions that failed in an earlier call")


def run(args: Namespace) -> int:
    """Replay the sessions that are not done yet, and write the table of all; exit code 1 if a session failed."""
    from ..batch.folder import PAGE, RIGS, TABLE, batch_folder, sessions_of, write_table
    from ..batch.results import counts, write_summaries
    from ..batch.session_task import OK, REMEDY, rows_here, rows_on_cluster
    from ..system.processes import usable_cores

    if find_spec("pyarrow") is None:
        raise UsageError(f"pyarrow is not installed, and batch needs it. {REMEDY}")
    if args.fatigue is not None and find_spec("rainflow") is None:
        raise UsageError("--fatigue: needs the package rainflow. Install it: pip install 'boom_twin[fatigue]'.")
    sessions = sessions_of(args.bags)
    with batch_folder(args.out, sessions) as folder:
        tasks = _tasks(args, sessions, folder)
        kept = [row for task in tasks if (row := folder.kept(task.key, task.fingerprint)) is not None]
        done = {row["key"]: row for row in kept if row["status"] == OK or not args.retry_failed}
        if waiting := [task for task in tasks if task.key not in done]:
            tell(f"{len(done)} of {len(tasks)} sessions are done")
            here = rows_here(waiting, args.workers or usable_cores())
            found = rows_on_cluster(args.scheduler, waiting) if args.scheduler else here
            try:
                with closing(found), closing(ProgressLine(len(tasks), "sessions", "batch", len(done))) as progress:
                    for row in found:
                        folder.keep(row)
                        done[row["key"]] = row
                        progress.update(1)
            finally:
                folder.mark(len(tasks), len(done))
        rows = [done[task.key] for task in tasks]
        write_table(folder.folder / TABLE, rows)
        write_summaries(folder.folder, rows)
        folder.mark(len(tasks), len(done))
    right, wrong = counts(rows)
    print(f"{right} sessions right, {wrong} failed")
    for row in rows:
        if row["reason"]:
            print(f"  {row['path']}: {row['reason']}")
    print(args.out / TABLE, args.out / RIGS, args.out / PAGE, sep="\n")
    return 1 if wrong else 0


def _tasks(args: Namespace, sessions: Sequence[Path], folder: BatchFolder) -> list[SessionTask]:
    from .. import __version__
    from ..batch.folder import fingerprint, key_of
    from ..batch.session_task import SessionTask
    from ..system.files import sha256_of

    given = {name: getattr(args, name) for name in ("scene", "params", "mapping")}
    paths = {name: None if path is None else str(Path(path).resolve()) for name, path in given.items()}
    contents = [f"{name} {sha256_of(Path(path))}" for name, path in paths.items() if path is not None]
    window = window_of(args)
    kinds = [str(args.report), str(args.keep_bags), str(args.calibrate), str(args.fatigue), args.namespace]
    options = "\n".join([__version__, *kinds, str(window), *contents])
    return [
        SessionTask(
            key=(key := key_of(session)),
            session=str(session.absolute()),
            out=str(folder.replay(key)),
            fingerprint=fingerprint(session, options),
            **paths,
            namespace=args.namespace,
            start=window.start,
            duration=window.duration,
            calibrate=args.calibrate,
            fatigue=args.fatigue,
            report=args.report,
            keep_bag=args.keep_bags,
            time=args.timeout,
            memory=round(1e6 * args.memory),
        )
        for session in sessions
    ]
