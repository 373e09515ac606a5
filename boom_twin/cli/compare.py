"""``boom_twin compare``: two sessions side by side."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from pathlib import Path
from tempfile import TemporaryDirectory, mkdtemp

from .arguments import add_json, add_session, window_of
from .output import open_session_scene, open_session_settings, print_result, tell, warn


def add_arguments(parser: ArgumentParser) -> None:
    for name in ("A", "B"):
        parser.add_argument(name, type=Path, help="a recorded session, which is replayed, or the folder of a replay")
    add_session(parser, mapping=False)
    add_json(parser)


def run(args: Namespace) -> int:
    from ..offline.inputs import ReplayOptions
    from ..report.evaluation import evaluated_replay
    from ..report.quantities import as_text, flat, rows_of, side_of

    window = window_of(args)
    with TemporaryDirectory() as folder:

        def replayed(session: Path) -> Path:
            tell(f"replaying {session} ..")
            scene = open_session_scene(session, args.scene)
            settings = open_session_settings(session, args.params, args.namespace)
            building = Path(mkdtemp(dir=folder))
            evaluated_replay(building, session, scene, settings, ReplayOptions(window=window, namespace=args.namespace))
            return building

        one, other = (side_of(path, replayed, window) for path in (args.A, args.B))
    for side in (one, other):
        if side.incomplete:
            warn(f"{side.name}: its session is {side.incomplete}")
    if one.scene != other.scene:
        warn("the two were replayed with different scenes, which may explain differences. Replay both with one scene.")
    rows = rows_of(one, other)
    print_result(args.json, flat(one, other, rows), as_text(one, other, rows))
    return 0
