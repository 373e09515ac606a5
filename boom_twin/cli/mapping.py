"""`boom_twin mapping`: the default mapping of topics and sensors, or the one that a session's readings ask for."""

from __future__ import annotations

import sys
from argparse import ArgumentParser, Namespace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .arguments import SESSION, add_json, add_session, refuse_given, window_of

if TYPE_CHECKING:
    from ..offline.commissioning import Commissioning


def add_arguments(parser: ArgumentParser) -> None:
    parser.add_argument("--check", metavar="BAG", help=f"check how the sensors of a session are wired: {SESSION}")
    add_session(parser, params=False)
    parser.add_argument("--out", type=Path, metavar="FILE", help="with --check: write the proposed mapping")
    add_json(parser)


def run(args: Namespace) -> int:
    if args.check is not None:
        return _check(args)
    remedy = "only with --check BAG; without it, the default mapping is printed. Add --check BAG."
    refuse_given(args, remedy, "scene", "mapping", "namespace", "out", "duration", "json")
    from ..messages.topic_table import DEFAULT_FILE

    sys.stdout.write(DEFAULT_FILE.read_text(encoding="utf-8"))
    return 0


def _check(args: Namespace) -> int:
    from ..config.yaml_text import whole_text
    from ..offline.commissioning import commission
    from ..system.files import check_target, write_atomic
    from .output import open_session_scene, print_result

    if args.out is not None:
        check_target(args.out, [Path(args.check)])
    scene = open_session_scene(args.check, args.scene)
    found = commission(args.check, scene, args.mapping, window_of(args), namespace=args.namespace)
    text = whole_text(found.document) if found.has_proposal else ""
    if args.out is not None and text:
        write_atomic(args.out, text)
    print_result(args.json, as_json(found, text), as_text(found, text, args.out))
    return 0


def as_json(found: Commissioning, text: str) -> dict[str, Any]:
    """Return the result as a flat object; lists have an entry for each channel or stream."""
    from ..wiring.check import finding, reading

    verdicts = found.checked.verdicts
    return {
        "channels": [each.channel for each in verdicts],
        "declared": [reading(each.declared) for each in verdicts],
        "found": [finding(each, found.checked) for each in verdicts],
        "wrong": [each.is_wrong for each in verdicts],
        "sure": [each.is_sure or not (each.is_wrong or found.checked.has_strokes_alone) for each in verdicts],
        "lag_streams": [stream.value for stream in found.lags],
        "lags_s": [lag.lag for lag in found.lags.values()],
        "lag_sigmas_s": [lag.sigma for lag in found.lags.values()],
        "mapping": text or None,
    }


def as_text(found: Commissioning, text: str, out: Path | None) -> list[str]:
    """Return a table of all channels, of lags, and the proposed mapping."""
    from ..wiring.check import STROKES_ALONE, finding, reading
    from .output import columns

    rows = [["channel", "declared as", "found"]]
    rows += [[each.channel, reading(each.declared), finding(each, found.checked)] for each in found.checked.verdicts]
    rows += [[f"{stream.value}.delay", "", lag_words(lag.lag, lag.sigma)] for stream, lag in found.lags.items()]
    lines = [*columns(rows, left=(0, 1, 2)), ""]
    if not text:
        unknown = "; see the channels that are not as declared" if found.wrong else ""
        right = STROKES_ALONE if found.checked.has_strokes_alone else "wiring as expected: nothing to mend"
        return [*lines, f"nothing to propose{unknown}" if unknown else right]
    where = f"written to {out}" if out is not None else "save it as a file, and give it by --mapping or `-p mapping:=FILE`"
    return [*lines, f"# proposed mapping; {where}", *text.rstrip().splitlines()]


def lag_words(lag: float, sigma: float) -> str:
    if sigma == float("inf"):
        return "not determined: too little moved"
    return f"{1e3 * lag:+.0f} +- {1e3 * sigma:.0f} ms against the strokes"
