"""``boom_twin import``: loggers' files as a session."""

from __future__ import annotations

import json
from argparse import ArgumentParser, Namespace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .. import __version__
from ..errors import UsageError
from ..types import NANO, sensor_kind
from .arguments import add_file, add_json, files_of
from .output import columns, print_result, tell, tell_oddities, warn

if TYPE_CHECKING:
    from ..bag.import_session import ImportedSession
    from ..loggers.assignment import Assignment, ColumnUse


def add_arguments(parser: ArgumentParser) -> None:
    parser.add_argument("files", nargs="+", type=Path, metavar="FILE", help="CSV or .parquet; each keeps its rate")
    parser.add_argument("--out", type=Path, metavar="DIR", help="folder of the session, new or empty")
    parser.add_argument("--scene", metavar="SCENE", help="scene file (YAML) to keep in the session")
    add_file(parser, "--columns", "which column is which channel and the time, as --propose prints it; names tell the rest")
    given = "a column of a channel, as cylinder_1=Lift:mm; may be repeated"
    parser.add_argument("--column", action="append", default=[], metavar="CHANNEL=NAME[:UNIT]", help=given)
    add_file(parser, "--mapping", "signs, zeros, mounts and units of the rig's sensors, which the session keeps")
    parser.add_argument("--timezone", metavar="ZONE", help="zone of local times: Europe/Berlin (default UTC)")
    parser.add_argument("--note", metavar="TEXT", help="note, kept in the session")
    parser.add_argument("--propose", action="store_true", help="print recognised columns as a file for --columns")
    add_json(parser)


def run(args: Namespace) -> int:
    from ..bag.import_session import import_session
    from ..bag.session_model import SessionMetadata, scene_from
    from ..loggers.assignment import ColumnFile, assign, columns_of_options, load_columns
    from ..loggers.log_table import table_of
    from ..system.result_folder import IMPORT, result_folder

    if args.out is None and not args.propose:
        raise UsageError("--out is not given. Name the folder of the session, or give --propose.")
    given = columns_of_options(load_columns(args.columns) if args.columns else ColumnFile(), args.column, args.timezone)
    scene = scene_from(args.scene) if args.scene else None
    if scene is not None:
        tell_oddities(scene.oddities, scene.source)
    joints = None if scene is None else len(scene.scene.joints)
    tables = [table_of(path) for path in args.files]
    for table in tables:
        tell(f"{table.source}: {table.layout}" if table.layout else table.source)
    if args.propose:
        found = assign(tables, given, joints)
        print("\n".join(proposal(found, given.timezone)))
        return 0
    metadata = SessionMetadata(__version__, None if scene is None else scene.text, note=args.note)
    with result_folder(args.out, IMPORT, [*args.files, *files_of(args, "scene", "columns", "mapping")]) as building:
        done = import_session(tables, building, given, metadata, joints, args.mapping)
    _warn(done, scene is None, given.timezone)
    if scene is not None:
        tell(f"next: boom_twin info {args.out}; its line `wiring` says if units, signs and names fit the boom")
    print_result(args.json, as_json(done, args.out), as_text(done, args.out))
    return 0


def _warn(done: ImportedSession, is_without_scene: bool, timezone: str | None) -> None:
    from ..bag.inspect import spacing_faults

    for number, read in done.read.items():
        first = next(iter(read.rows.numbers.values()))
        spacing = spacing_faults(read.times.stamps[first == first])  # without its empty cells
        for remark in filter(None, (read.rows.remark, read.rows.skipped_text, *spacing)):
            warn(f"{done.assignment.tables[number].source}: {remark}")
    if any(read.times.is_local for read in done.read.values()) and timezone is None:
        warn("local times are taken as UTC. Give --timezone, for example Europe/Berlin.")
    if not any(read.times.is_absolute for read in done.read.values()):
        tell("times count from a start, without a date: the session begins at 1 s of 1970")
    if is_without_scene:
        tell("scene: none is kept; `boom_twin replay` takes the default scene, or that of --scene")


def as_json(done: ImportedSession, out: Path) -> dict[str, Any]:
    """Return the facts of an import; lists have an entry for each channel."""
    uses, found = done.assignment.used, done.assignment
    return {
        "out": str(out),
        "files": [table.source for table in found.tables],
        "channels": [use.channel for use in uses],
        "columns": [found.tables[use.table].headers[use.place] for use in uses],
        "column_files": [found.tables[use.table].source for use in uses],
        "units": [use.unit for use in uses],
        "first_values": [next(iter(_first(done, use)), None) for use in uses],
        "not_used": [f"{found.header(use)}: {use.reason}" for use in found.unused],
        "times": [read.times.words for read in done.read.values()],
        "topics": list(done.counts),
        "counts": list(done.counts.values()),
    }


def as_text(done: ImportedSession, out: Path) -> list[str]:
    """Return a table of channels with their columns, units and first values, and lines on times and counts."""
    found = done.assignment
    rows = [["channel", "column", "unit", "first values", "file"]]
    for use in sorted(found.used, key=lambda use: (list(sensor_kind(use.channel).units), use.channel)):
        table = found.tables[use.table]
        first = ", ".join(f"{value:.6g}" for value in _first(done, use)[:3]) or "none"
        rows.append([use.channel, " ".join(table.headers[use.place].split()), use.unit, first, Path(table.source).name])
    lines = columns(rows, left=range(5))
    for number, read in done.read.items():
        start, end = read.span
        missing = sum(int((values != values).sum()) for values in read.rows.numbers.values())
        empty = f", {missing} empty cells" if missing else ""
        rate = f"{len(read.times.stamps)} rows, {(end - start) * NANO:.3f} s{empty}"
        lines.append(f"{Path(found.tables[number].source).name}: {rate}; time is {read.times.words}")
    lines += [f"not used: {found.header(use)}: {use.reason}" for use in found.unused]
    counts = ", ".join(f"{topic} {count}" for topic, count in done.counts.items())
    return [*lines, f"messages: {counts}", str(out)]


def _first(done: ImportedSession, use: ColumnUse) -> list[float]:
    values = done.read[use.table].rows.numbers[use.place]
    return [value for value in values[:1000].tolist() if value == value]


def proposal(found: Assignment, timezone: str | None) -> list[str]:
    """Return the lines of a file for ``--columns``: recognised columns, and the others as comments."""
    lines = ["# Columns for `boom_twin import FILES --columns FILE`. Signs, zeros and mounts of sensors belong into a mapping."]
    lines += [f"timezone: {timezone}" if timezone else "# timezone: Europe/Berlin   # of local times", "time:"]
    for number, places in enumerate(found.times):
        table = found.tables[number]
        names = [table.headers[place] for place in places] or ["GIVE_ONE"]
        unit = f", unit: {table.units[places[0]]}" if places and table.units[places[0]] else ""
        lines.append(f"  - {{column: {_quoted(names if len(names) > 1 else names[0])}{unit}, file: {_file(found, number)}}}")
    lines.append("columns:")
    for use in sorted(found.used, key=lambda use: use.channel):
        lines.append(f"  {use.channel}: {_entry(found, use)}")
    if not found.used:
        lines[-1] += " {}"
    if found.unused:
        lines.append("  # not recognised; write a channel before a column to use it:")
    for use in found.unused:
        lines.append(f"  # CHANNEL: {_entry(found, use)}: {use.reason}")
    return lines


def _entry(found: Assignment, use: ColumnUse) -> str:
    table = found.tables[use.table]
    unit = use.unit or table.units[use.place]
    first = ", ".join(table.first(use.place)[:3])
    entry = f"column: {_quoted(table.headers[use.place])}, unit: {_quoted(unit) if unit else 'GIVE_ONE'}"
    return f"{{{entry}, file: {_file(found, use.table)}}}   # {first}"


def _file(found: Assignment, number: int) -> str:
    return _quoted(Path(found.tables[number].source).name)


def _quoted(value: str | list[str]) -> str:
    return json.dumps(value, ensure_ascii=False)
