"""``boom_twin recover``: a new, sound session with all that can be saved of a damaged one."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..system.terminal_text import printable
from .arguments import add_json
from .output import print_result, tell

if TYPE_CHECKING:
    from ..bag.recover import Recovery


def add_arguments(parser: ArgumentParser) -> None:
    parser.add_argument("bag", metavar="BAG", help="a rosbag2 directory, a directory of .mcap files, or one .mcap; only read")
    parser.add_argument("--out", required=True, metavar="DIR", help="directory of the new session, new or empty")
    add_json(parser)


def run(args: Namespace) -> int:
    from ..bag.recover import recover

    outcome = recover(Path(args.bag), Path(args.out))
    for path, fault in outcome.faults:
        tell(f"{path}: bytes {fault.offset} to {fault.offset + fault.length}: {fault.reason}")
    if more := outcome.fault_count - len(outcome.faults):
        tell(f"and {more} faults more")
    values = as_json(outcome, args.out)
    print_result(args.json, values, as_text(outcome, values))
    return 0


def as_json(outcome: Recovery, out: str) -> dict[str, Any]:
    """Return the counts; lists have one entry for each of ``topics``, null in ``lost`` is unknown."""
    topics = sorted({*outcome.saved, *(outcome.lost or {})})
    return {
        "path": out,
        "messages": outcome.saved.total(),
        "topics": topics,
        "saved": [outcome.saved[topic] for topic in topics],
        "saved_without_checksum": [outcome.unvouched[topic] for topic in topics],
        "lost": [None if outcome.lost is None else outcome.lost.get(topic, 0) for topic in topics],
        "lost_of_unknown_topics": outcome.nameless,
        "faults": outcome.fault_count,
    }


def as_text(outcome: Recovery, values: dict[str, Any]) -> list[str]:
    """Return the lines of text for `values`, the result of `as_json`."""
    wide = max(len(topic) for topic in values["topics"])
    lines = [f"{'topic':{wide}}  {'saved':>9}  {'no checksum':>11}  {'lost':>9}"]
    for row, topic in enumerate(values["topics"]):
        lost = "unknown" if values["lost"][row] is None else str(values["lost"][row])
        lines.append(f"{topic:{wide}}  {values['saved'][row]:9d}  {values['saved_without_checksum'][row]:11d}  {lost:>9}")
    if outcome.nameless:
        lines.append(f"{outcome.nameless} sound messages were left out: the definitions of their topics are lost")
    if any(values["saved_without_checksum"]):
        lines.append("'no checksum': saved as they stood; nothing vouches for their values")
    if outcome.lost is None:
        lines.append("'unknown': no sound count is left in the source that says how many there were")
    return [printable(line, keep="") for line in [*lines, values["path"]]]
