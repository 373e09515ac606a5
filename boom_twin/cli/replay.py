"""``boom_twin replay``: a recorded session through the twin."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from contextlib import nullcontext
from functools import partial
from math import hypot
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..offline.progress import ProgressLine
from ..types import StrokeReading
from .arguments import SESSION, add_json, add_session, files_of, refuse_given, window_of
from .output import open_session_scene, open_session_settings, print_result, tell, warn_incomplete

if TYPE_CHECKING:
    from ..offline.recording import Stretch
    from ..offline.sample_table import CsvFile, ParquetFile
    from ..plots import Painter
    from ..report.evaluation import Evaluation


def add_arguments(parser: ArgumentParser) -> None:
    parser.add_argument("bag", metavar="BAG", help=SESSION)
    add_session(parser)
    place = "folder for summary.json, bag/, tables and pictures: new, empty, or of an earlier replay, which is replaced"
    parser.add_argument("--out", required=True, metavar="DIR", help=place)
    purpose = "name the causes of alarms, by fault twins; takes about five times as long"
    parser.add_argument("--causes", action="store_true", help=purpose)
    parser.add_argument("--no-health", action="store_true", help="do not judge the rig's health")
    purpose = "do not write the result bag; output_sha256 of the summary is null then, all else is the same"
    parser.add_argument("--no-bag", action="store_true", help=purpose)
    drawn = parser.add_mutually_exclusive_group()
    drawn.add_argument("--no-pictures", action="store_true", help="draw no pictures")
    drawn.add_argument("--report", action="store_true", help="also write report.html")
    purpose = "fatigue in the report: detail category of EN 1993-1-9, MPa (without a value 71); extra fatigue"
    parser.add_argument("--fatigue", nargs="?", type=float, const=71.0, metavar="CATEGORY", help=purpose)
    purpose = "write samples.csv or samples.parquet (by pyarrow): predicted, measured, estimated, a row for every stroke stamp"
    parser.add_argument("--table", choices=("csv", "parquet"), help=purpose)
    add_json(parser)


def run(args: Namespace) -> int:
    from ..offline.inputs import ReplayOptions
    from ..offline.sample_table import SampleTable, check_kind, columns_of, table_file
    from ..plots import painter
    from ..report.evaluation import evaluated_replay
    from ..system.result_folder import REPLAY, result_folder

    if not args.report:
        refuse_given(args, "goes into the report. Give --report too.", "fatigue")
    scene = open_session_scene(args.bag, args.scene)
    settings = open_session_settings(args.bag, args.params, args.namespace)
    check_kind(args.table)
    window = window_of(args)
    if window.start:
        tell(f"the model starts at rest at {window.start:g} s: ignore its first seconds if the boom moved")
    tell("preparing the model (compiles for up to a minute the first time) ..")
    out, sources = Path(args.out), files_of(args, "bag", "scene", "params", "mapping")
    pictures = nullcontext() if args.no_pictures else painter()
    with pictures as paint, result_folder(out, REPLAY, sources) as building:
        joints, name = len(scene.scene.joints), f"samples.{args.table}"
        tables: list[tuple[CsvFile | ParquetFile, SampleTable]] = []

        def add(stretch: Stretch) -> None:
            if not tables:  # the sensors of a session are known with its first stretch
                file = table_file(building / name, columns_of(joints, stretch.streams))
                tables.append((file, SampleTable(file.write, joints, stretch.streams)))
            tables[0][1].add(stretch)

        options = ReplayOptions(
            progress=partial(ProgressLine, unit="messages", name="replay"),
            mapping=args.mapping,
            health=not args.no_health,
            window=window,
            namespace=args.namespace,
            with_bag=not args.no_bag,
            causes=args.causes,
        )
        found = evaluated_replay(building, args.bag, scene, settings, options, args.fatigue, add if args.table else None)
        files = [path.name for path in _write(args, found, building, paint)]
        for file, table in tables:
            table.finish()
            file.close()
            files.append(name)
    warn_incomplete(found.result.session)
    written = ["summary.json", *([] if args.no_bag else ["bag"]), *files]
    summary = found.result.summary
    print_result(args.json, flat(summary), [*as_text(summary), *(str(out / name) for name in written)])
    return 0


def flat(summary: dict[str, Any]) -> dict[str, Any]:
    """Return a summary as one flat object: one key for each count, one list for each key of its alarms."""
    found = {key: value for key, value in summary.items() if key not in ("events", "alarms")}
    found |= {f"events_{name.replace(' ', '_')}": count for name, count in summary["events"].items()}
    alarms = summary["alarms"]
    return found | {f"alarm_{key}": [alarm[key] for alarm in alarms] for key in ("channel", "kind", "from_s", "to_s", "cause")}


def _write(args: Namespace, found: Evaluation, out: Path, paint: Painter | None) -> list[Path]:
    from ..offline.history import draw
    from ..report.quantities import FILE_NAME as QUANTITIES

    files = [out / QUANTITIES]
    if paint is not None:
        files += draw(found.result, found.history, found.scene, out, paint)
    if args.report:
        from ..report.page import write_report

        files.append(write_report(found, out))
    return files


def as_text(summary: dict[str, Any]) -> list[str]:
    from ..offline.recording import alarm_as_text, noise_told

    lines = [
        f"samples            {summary['samples']} in {summary['duration_s']:.1f} s",
        f"wall time          {summary['wall_s']:.2f} s, {summary['realtime_factor']:.1f} times real time",
        f"left out           {summary['dropped']}",
        f"scene              {summary['scene']}",
        f"mapping            {summary['mapping']}",
        f"strokes            {StrokeReading(summary['strokes']).text} ({summary['strokes_source']})",
        f"tip acceleration   {summary['tip_acceleration_max_m_s2']:.2f} m/s^2 at most",
    ]
    for i, value in enumerate(summary["joint_residual_rms_rad"]):
        if value is None:
            lines.append(f"joint {i + 1} residual   not measured")
            continue
        ratio = hypot(summary["joint_residual_normalised_mean"][i], summary["joint_residual_normalised_std"][i])
        lines.append(f"joint {i + 1} residual   {1e3 * value:.3f} mrad rms, {ratio:.1f} times the expected noise")
    for name, count in summary["events"].items():
        lines.append(f"{name:18s} {count_as_text(name, count, StrokeReading(summary['strokes']))}")
    if "tip_error_rms_m" in summary:
        lines += _errors(summary)
    if "tip_load" in summary:
        lines.append(f"load at the tip    {summary['tip_load']}")
    lines += [f"noise              {told}" for told in noise_told(summary)]
    if summary["output_sha256"] is None:
        lines.append("result bag         not written (--no-bag)")
    alarms = summary["alarms"]
    return [*lines, f"alarms             {len(alarms) or 'none'}", *(f"  {alarm_as_text(alarm)}" for alarm in alarms)]


def count_as_text(name: str, count: int, reads: StrokeReading) -> str:
    """Return in words how often an irregularity was met."""
    from ..messages.sample_decoder import ODDITIES
    from ..twin.blocks import event_meaning

    meaning = (event_meaning(name, reads) or ODDITIES.get(name, "")).partition(";")[0]
    return f"{count} time{'' if count == 1 else 's'}" + (f": {meaning}" if meaning else "")


def _errors(summary: dict[str, Any]) -> list[str]:
    lines = [
        f"tip error          {1e3 * summary['tip_error_rms_m']:.2f} mm rms against the truth",
        f"acceleration error {summary['tip_acceleration_error_rms_m_s2']:.3f} m/s^2 rms against the truth",
    ]
    if "tip_estimate_error_rms_m" in summary:
        lines[0] += f"; of the estimate {1e3 * summary['tip_estimate_error_rms_m']:.2f} mm"
        lines[1] += f"; of the estimate {summary['tip_estimate_acceleration_error_rms_m_s2']:.3f} m/s^2"
    return lines
