"""``boom_twin compare``: two sessions side by side."""

from __future__ import annotations

import sys
from argparse import ArgumentParser, Namespace
from contextlib import ExitStack
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

from .common import add_json, add_session_scene, open_session_scene, print_json

if TYPE_CHECKING:
    from ..io.results import Building
    from ..report.compare import Row
    from ..report.side import Side


def add_arguments(parser: ArgumentParser) -> None:
    """Declare the arguments."""
    for name in ("A", "B"):
        parser.add_argument(name, help="a recorded session, which is replayed, or the folder of a replay")
    add_session_scene(parser)
    parser.add_argument("--params", metavar="FILE", help="ROS parameter file; by default the package's twin.yaml")
    parser.add_argument("--baseline", metavar="FILE", help="as for replay")
    kept = "folder for compare.png and the replays: new, empty, or of an earlier compare; without it nothing is kept"
    parser.add_argument("--out", metavar="DIR", help=kept)
    add_json(parser)


def run(args: Namespace) -> int:
    """Replay what is not replayed, and compare."""
    from ..io.results import COMPARE, result_folder
    from ..report.compare import as_text, flat, rows_of

    sources = [Path(each) for each in (args.A, args.B, args.scene, args.params, args.baseline) if each]
    with ExitStack() as stack:
        out = Path(args.out or stack.enter_context(TemporaryDirectory()) + "/compare")
        building = stack.enter_context(result_folder(out, COMPARE, sources))
        one, other = (_side(args, Path(getattr(args, name)), building, name) for name in ("A", "B"))
        rows = rows_of(one, other)
        if args.out:
            _draw(building.folder, one, other, rows)
    for side in (one, other):
        if side.incomplete:
            print(f"warning: {side.name}: its session is {side.incomplete}", file=sys.stderr)
    if one.scene != other.scene:
        print("warning: the two were replayed with different scenes; differences may be those of the scenes", file=sys.stderr)
    if args.json:
        print_json(flat(one, other, rows))
    else:
        print("\n".join(as_text(one, other, rows)))
    return 0


def _side(args: Namespace, path: Path, building: Building, name: str) -> Side:
    from ..offline.replay import replay_into
    from ..report.side import side_of, worked_out
    from ..settings import load_settings

    def replayed(session: Path) -> Path:
        print(f"replaying {session} ..", file=sys.stderr)
        scene, settings = open_session_scene(session, args.scene), load_settings(Path(args.params) if args.params else None)
        inner = building.inner(name)
        result = replay_into(inner, session, scene, settings, baseline=args.baseline)
        worked_out(result, scene.scene, settings, Path(args.baseline) if args.baseline else None, inner.folder)
        return inner.folder

    return side_of(path, replayed)


def _draw(out: Path, one: Side, other: Side, rows: list[Row]) -> None:
    from ..report.compare import SURE
    from ..view.compare import compare_picture

    known = [(row.name, row.difference / row.sigma) for row in rows if row.sigma and row.difference is not None]
    title = f"B ({other.name}) against A ({one.name})"
    compare_picture(out / "compare.png", title, [name for name, _ in known], [apart for _, apart in known], SURE)
