"""``boom_twin compare``: two sessions side by side."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from contextlib import ExitStack
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

from .arguments import add_json, add_session, files_of, window_of
from .output import open_session_scene, open_session_settings, print_result, tell, warn

if TYPE_CHECKING:
    from ..report.compare import ComparedSession, ComparisonRow


def add_arguments(parser: ArgumentParser) -> None:
    for name in ("A", "B"):
        parser.add_argument(name, help="a recorded session, which is replayed, or the folder of a replay")
    add_session(parser, mapping=False)
    kept = "folder for compare.png and the replays: new, empty, or of an earlier compare; without it nothing is kept"
    parser.add_argument("--out", metavar="DIR", help=kept)
    add_json(parser)


def run(args: Namespace) -> int:
    """Replay what is not replayed, and compare."""
    from ..report.compare import as_text, flat, rows_of
    from ..system.result_folder import COMPARE, result_folder

    with ExitStack() as stack:
        out = Path(args.out or stack.enter_context(TemporaryDirectory()) + "/compare")
        building = stack.enter_context(result_folder(out, COMPARE, files_of(args, "A", "B", "scene", "params")))
        one, other = (_side(args, Path(getattr(args, name)), building, name) for name in ("A", "B"))
        rows = rows_of(one, other)
        if args.out:
            _draw(building, one, other, rows)
    for side in (one, other):
        if side.incomplete:
            warn(f"{side.name}: its session is {side.incomplete}")
    if one.scene != other.scene:
        warn("the two were replayed with different scenes; differences may be those of the scenes")
    print_result(args.json, flat(one, other, rows), as_text(one, other, rows))
    return 0


def _side(args: Namespace, path: Path, building: Path, name: str) -> ComparedSession:
    from ..offline.inputs import ReplayOptions
    from ..report.compare import side_of
    from ..report.evaluation import evaluated_replay

    window = window_of(args)

    def replayed(session: Path) -> Path:
        tell(f"replaying {session} ..")
        scene, settings = open_session_scene(session, args.scene), open_session_settings(session, args.params)
        (building / name).mkdir()
        evaluated_replay(building / name, session, scene, settings, ReplayOptions(window=window))
        return building / name

    return side_of(path, replayed, window)


def _draw(out: Path, one: ComparedSession, other: ComparedSession, rows: list[ComparisonRow]) -> None:
    from ..plots.results import compare_picture
    from ..report.compare import SIGNIFICANT

    known = [(row.name, row.difference / row.sigma) for row in rows if row.sigma and row.difference is not None]
    title = f"B ({other.name}) against A ({one.name})"
    compare_picture(out / "compare.png", title, [name for name, _ in known], [apart for _, apart in known], SIGNIFICANT)
