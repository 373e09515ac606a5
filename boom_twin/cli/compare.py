"""``boom_twin compare``: two sessions side by side."""

from __future__ import annotations

import sys
from argparse import ArgumentParser, Namespace
from contextlib import ExitStack
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

from .main import add_json, add_session_scene, open_session_scene, print_json

if TYPE_CHECKING:
    from ..report.compare import ComparedSession, ComparisonRow


def add_arguments(parser: ArgumentParser) -> None:
    """Declare the arguments."""
    for name in ("A", "B"):
        parser.add_argument(name, help="a recorded session, which is replayed, or the folder of a replay")
    add_session_scene(parser)
    parser.add_argument("--params", metavar="FILE", help="ROS parameter file; by default the package's twin.yaml")
    parser.add_argument("--baseline", metavar="FILE", help="as for replay")
    parser.add_argument("--out", metavar="DIR", help="folder for compare.png and the replays; without it nothing is kept")
    add_json(parser)


def run(args: Namespace) -> int:
    """Replay what is not replayed, and compare."""
    from ..report.compare import as_text, flat, rows_of

    if args.out:
        _check_place(Path(args.out))
    with ExitStack() as stack:
        out = Path(args.out or stack.enter_context(TemporaryDirectory()))
        one, other = (_side(args, Path(getattr(args, name)), out / name) for name in ("A", "B"))
    for side in (one, other):
        if side.incomplete:
            print(f"warning: {side.name}: its session is {side.incomplete}", file=sys.stderr)
    if one.scene != other.scene:
        print("warning: the two were replayed with different scenes; differences may be those of the scenes", file=sys.stderr)
    rows = rows_of(one, other)
    if args.out:
        _draw(out, one, other, rows)
    if args.json:
        print_json(flat(one, other, rows))
    else:
        print("\n".join(as_text(one, other, rows)))
    return 0


def _check_place(out: Path) -> None:
    """Refuse to put pictures into a session or a result."""
    from ..errors import UsageError

    if held := [name for name in ("metadata.yaml", "session.yaml", "summary.json") if (out / name).exists()]:
        raise UsageError(f"{out}: holds {held[0]}, so it is a session or a replay. Choose another folder.")


def _side(args: Namespace, path: Path, folder: Path) -> ComparedSession:
    from ..config.settings import load_settings
    from ..offline.replay import replay_into
    from ..report.compare import side_of, worked_out
    from ..system.result_folder import REPLAY, result_folder

    sources = [Path(each) for each in (args.A, args.B, args.scene, args.params, args.baseline) if each]

    def replayed(session: Path) -> Path:
        print(f"replaying {session} ..", file=sys.stderr)
        scene, settings = open_session_scene(session, args.scene), load_settings(Path(args.params) if args.params else None)
        with result_folder(folder, REPLAY, sources) as building:
            result = replay_into(building, session, scene, settings, baseline=args.baseline)
            worked_out(result, scene.scene, settings, Path(args.baseline) if args.baseline else None, building.folder)
        return folder

    return side_of(path, replayed)


def _draw(out: Path, one: ComparedSession, other: ComparedSession, rows: list[ComparisonRow]) -> None:
    from ..plots.session import compare_picture
    from ..report.compare import SURE

    known = [(row.name, row.difference / row.sigma) for row in rows if row.sigma and row.difference is not None]
    out.mkdir(parents=True, exist_ok=True)
    title = f"B ({other.name}) against A ({one.name})"
    compare_picture(out / "compare.png", title, [name for name, _ in known], [apart for _, apart in known], SURE)
