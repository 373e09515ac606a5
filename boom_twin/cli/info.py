"""``boom_twin info``: content of a recorded session, and data missing for a replay."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..system.terminal_text import printable, several
from ..types import NANO, StrokeReading
from .arguments import SESSION, add_json, add_session, window_of
from .output import columns, open_session_scene, print_result

if TYPE_CHECKING:
    from ..bag.inspect import BagInfo, Tally
    from ..bag.session_model import Mapped, SessionScene, SessionStrokes


def add_arguments(parser: ArgumentParser) -> None:
    parser.add_argument("bag", metavar="BAG", help=SESSION)
    add_session(parser, params=False)
    add_json(parser)


def run(args: Namespace) -> int:
    from ..bag.inspect import inspect
    from ..bag.session_model import mapping_of, strokes_of
    from ..offline.commissioning import wiring_of

    info = inspect(Path(args.bag), window_of(args))
    scene = open_session_scene(args.bag, args.scene)
    mapped = mapping_of(info.session.path, args.mapping, namespace=args.namespace)
    values = as_json(info, scene, mapped, strokes_of(info.session.path, mapped))
    values["wiring"] = wiring_of(info.session.path, args.scene, args.mapping, window_of(args), args.namespace)
    print_result(args.json, values, as_text(info, scene, values))
    return 0


def as_json(info: BagInfo, scene: SessionScene, mapped: Mapped, strokes: SessionStrokes) -> dict[str, Any]:
    """Return the facts of a session. Lists of figures have an entry for each of ``topics``."""
    from ..bag.advice import missing, remarks
    from ..bag.session_model import settings_of

    session, metadata, tallies = info.session, info.session.metadata, info.tallies
    topics, joints = mapped.topics, len(scene.scene.joints)
    start, end = info.span
    return {
        "path": str(session.path),
        "storage": session.files[0].storage,
        "compression": session.files[0].compression,
        "profile": "ros2" if session.files[0].storage == "mcap" else None,
        "distro": (metadata.ros_distro or None) if metadata else None,
        "metadata_version": metadata.version if metadata else None,
        "library": session.files[0].library,
        "files": [file.path.name for file in session.files],
        "bytes": sum(file.path.stat().st_size for file in session.files),
        "start_ns": start,
        "duration_s": (end - start) * NANO,
        "session_duration_s": (session.end - session.start) * NANO,
        "messages": sum(tally.count for tally in tallies),
        "checksums": session.checked,
        "origin": session.notes.get("origin"),
        "synthetic": info.synthetic,
        "incomplete": session.incomplete or None,
        "notes": [f"{key}: {value}" for key, value in session.notes.items()],
        "topics": [tally.name for tally in tallies],
        "types": [tally.type for tally in tallies],
        "counts": [tally.count for tally in tallies],
        "rates_Hz": [tally.rate for tally in tallies],
        "largest_gaps_s": [tally.gap * NANO if tally.gap else None for tally in tallies],
        "largest_gaps_at_s": [_gap_begin_s(tally, session.start) for tally in tallies],
        "stamps_not_increasing": [tally.not_increasing for tally in tallies],
        "stamps_unset": [tally.unset for tally in tallies],
        "log_minus_stamp_min_s": [tally.skew and tally.skew.least for tally in tallies],
        "log_minus_stamp_mean_s": [tally.skew and tally.skew.mean for tally in tallies],
        "log_minus_stamp_max_s": [tally.skew and tally.skew.most for tally in tallies],
        "scene": scene.source,
        "mapping": mapped.source,
        "strokes": strokes.reading,
        "strokes_source": strokes.source,
        "scene_sha256": scene.sha256,
        "wiring": None,
        "missing_for_replay": missing(info, topics, joints, scene.source, settings_of(session.path).settings.gap),
        "remarks": remarks(info, topics),
    }


def _gap_begin_s(tally: Tally, start: int) -> float | None:
    return (tally.gap_after - start) * NANO if tally.gap else None


def as_text(info: BagInfo, scene: SessionScene, values: dict[str, Any]) -> list[str]:
    """Return the lines of text for `values` of `as_json`. Line breaks in names and notes are escaped."""
    made = {True: "synthetic", False: "not said to be synthetic", None: "not noted"}[values["synthetic"]]
    files = several(len(values["files"]), "file")
    sections = several(len(scene.scene.sections), "section")
    distro = values["distro"] or "distribution not noted"
    version = f"metadata version {values['metadata_version']}" if values["metadata_version"] else "no metadata.yaml"
    profile = f"; profile {values['profile']}" if values["profile"] else ""
    part, whole = "", values["session_duration_s"]
    if whole != values["duration_s"]:
        part = f": the part from {info.window.start:g} s on, of {whole:.3f} s"
    lines = [
        f"session    {values['path']}",
        f"stored     {values['storage']}, {files}, {values['bytes'] / 2**20:.2f} MiB, compression {values['compression']}, "
        f"checksums {'present' if values['checksums'] else 'absent'}",
        f"written    by {values['library'] or 'an unnamed program'}{profile}, {distro}, {version}",
        f"made by    {values['origin'] or 'origin not noted'} ({made})",
        f"scene      {values['scene']}, sha256 {values['scene_sha256'][:12]}.., {sections}",
        f"mapping    {values['mapping']}",
        f"strokes    {StrokeReading(values['strokes']).text} ({values['strokes_source']})",
        f"lasts      {values['duration_s']:.3f} s, {values['messages']} messages{part}",
        "",
        *_table(info),
        "",
    ]
    lines += [f"state      {values['incomplete']}"] if values["incomplete"] else []
    lines += [f"note       {note}" for note in values["notes"] if not note.startswith("origin: ")]
    lines += [f"remark     {remark}" for remark in values["remarks"]]
    lines += [f"wiring     {values['wiring']}"]
    lines += [f"missing    {sentence}" for sentence in values["missing_for_replay"]]
    lines += [] if values["missing_for_replay"] else ["replay     nothing is missing"]
    return [printable(line, keep="") for line in lines]


def _table(info: BagInfo) -> list[str]:
    late = ["log - stamp, ms: least", "mean", "most"]
    rows = [["topic", "type", "count", "Hz", "gap, ms", "at s", "not rising", "no stamp", *late]]
    for tally in info.tallies:
        gap = (tally.gap * 1e-6 if tally.gap else None, _gap_begin_s(tally, info.session.start))
        skew = [value and value * 1e3 for value in tally.skew or (None, None, None)]
        own = [tally.name, tally.type, str(tally.count), _number(tally.rate, 2), _number(gap[0], 2), _number(gap[1], 3)]
        rows.append([*own, str(tally.not_increasing), str(tally.unset), *(_number(value, 3) for value in skew)])
    return columns(rows, left=(0, 1))


def _number(value: float | None, digits: int) -> str:
    return "-" if value is None else f"{value:.{digits}f}"
