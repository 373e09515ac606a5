"""``boom_twin calibrate``: parameters of a scene from healthy sessions."""

from __future__ import annotations

import time
from argparse import ArgumentParser, Namespace
from contextlib import closing
from pathlib import Path
from typing import TYPE_CHECKING

from .. import __version__
from ..errors import BoomTwinError, UsageError
from ..offline.progress import ProgressLine
from .arguments import add_json, add_session, files_of, window_of
from .output import open_session_scene, open_session_settings, print_result, warn, warn_incomplete

if TYPE_CHECKING:
    from ..bag.session_model import SessionScene


def add_arguments(parser: ArgumentParser) -> None:
    parser.add_argument("bags", nargs="+", metavar="BAG", help="healthy sessions that begin at rest; the last one is held out")
    parser.add_argument("--out", type=Path, metavar="SCENE", required=True, help="scene to write; zeros: a mapping beside it")
    parser.add_argument("--parameters", metavar="A,B,..", help="estimate only these: cylinder_1.k,joint_2.zero")
    parser.add_argument("--load", choices=("payload", "line_fill"), help="also estimate a load")
    parser.add_argument("--damping", choices=("d", "beta"), help="also estimate damping of cylinders or sections")
    parser.add_argument("--stiffness", action="store_true", help="also estimate EI and an elastic base")
    whose = "estimate the zeros of all sensors (default), of all but the stroke transducers, or none"
    parser.add_argument("--zeros", choices=("all", "angles", "none"), default="all", help=whose)
    add_session(parser)
    parser.add_argument("--date", metavar="DATE", help="date of the provenance (default: today)")
    parser.add_argument("--force", action="store_true", help="overwrite existing results")
    add_json(parser)


def run(args: Namespace) -> int:
    """Run the calibration, write the scene and print the result; exit code 1 if it must not be used."""
    from ..bag.reader import scan
    from ..calibration.output import as_object, as_text, mapping_path, refuse_overwriting, write_mapping, write_scene
    from ..calibration.run import calibrate
    from ..calibration.unknowns import Choice

    sources = files_of(args, "bags", "scene", "params", "mapping")
    refuse_overwriting(args.out, sources, args.force)
    scene = _scene(args)
    settings = open_session_settings(args.bags[0], args.params, args.namespace)
    names = tuple(name.strip() for name in (args.parameters or "").split(",") if name.strip())
    choice = Choice(names, args.load, args.damping, args.stiffness, args.zeros)
    args.out.parent.mkdir(parents=True, exist_ok=True)  # before the work, which a folder that cannot be made would waste
    began = time.perf_counter()
    with closing(ProgressLine(100, "%", "calibrate")) as bar:

        def show(share: float, what: str) -> None:
            bar.update(100.0 * share - bar.done)

        found = calibrate(args.bags, scene.scene, choice, settings, args.mapping, show, window_of(args), args.namespace)
    wall = time.perf_counter() - began
    credit = f"{args.date or time.strftime('%Y-%m-%d')} by boom_twin {__version__}"
    refuse_overwriting(args.out, sources, args.force)  # again: somebody may have put something there meanwhile
    # the scene last: without its zeros it would pass for the whole result
    mapping = write_mapping(found, Path(args.bags[0]), args.mapping, args.out, credit, len(scene.scene.joints))
    write_scene(found, scene.scene, scene.text, args.out, credit)
    if mapping is None and (earlier := mapping_path(args.out)).exists():
        warn(f"{earlier} comes from an earlier calibration; this one found no zeros for {args.out}. Remove it.")
    files = [args.out, *([mapping] if mapping else [])]
    written = [str(path) for path in files]
    print_result(args.json, as_object(found) | {"wall_s": wall, "files": written}, [*as_text(found), f"{wall:.1f} s", *written])
    for bag in args.bags:
        warn_incomplete(scan(Path(bag)))
    if found.unusable:
        raise BoomTwinError(f"{args.out}: {found.unusable}")
    return 0


def _scene(args: Namespace) -> SessionScene:
    """Return the scene of all sessions; raise UsageError if theirs differ."""
    from ..bag.session_model import scene_of

    found = open_session_scene(args.bags[0], args.scene)
    for bag in args.bags[1:] if args.scene is None else []:
        if scene_of(Path(bag)).scene != found.scene:
            raise UsageError(f"{bag}: its scene differs from that of {args.bags[0]}. Give the right scene by --scene.")
    return found
