# PYTHON_ARGCOMPLETE_OK
"""The console script: picks the command, and turns errors of the input into one message and an exit code.

A command imports what it needs when it runs, so that help and usage errors are told at once.

Exit codes: 0 done, 1 the input or the run failed (the reason is on stderr), 2 usage.
"""

from __future__ import annotations

import gc
import json
import os
import sys
from argparse import REMAINDER, SUPPRESS, ArgumentParser, Namespace
from collections.abc import Iterable, Mapping, Sequence
from contextlib import redirect_stderr, redirect_stdout, suppress
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol, TextIO, cast

from .. import __version__
from ..errors import BoomTwinError, Fault
from ..system.cores import use_one_blas_thread
from ..system.terminal_text import PrintableStream, open_closed_streams
from .examples import epilog_of
from .parser import CommandParser
from .quiet import QuietStream

use_one_blas_thread()

if TYPE_CHECKING:
    from ..bag.reader import Session
    from ..bag.session_model import SessionScene
    from ..config.settings import Settings
    from ..scene import Scene


COMMANDS: dict[str, str] = {
    "check": "validate a scene and tell what its model consists of",
    "init": "write a first scene from the dimensions of a drawing",
    "info": "what a recorded session holds and what it lacks",
    "monitor": "the live page, of the topics or of a recorded session",
    "play": "publish a recorded session over ROS 2",
    "record": "record the session topics from ROS 2",
    "recover": "save what is whole of a damaged session",
    "scene": "print the default scene file",
    "mapping": "print the default mapping of topics and sensors",
    "urdf": "print a scene as a URDF, for robot_state_publisher",
    "views": "RViz, Foxglove, PlotJuggler: files for a named boom",
    "statics": "static equilibrium, cylinder forces, natural frequencies",
    "envelope": "sag, forces, frequencies, stresses over the whole range",
    "simulate": "the boom's answer to a stroke history",
    "response": "frequency response, steady states, pump rates to avoid",
    "replay": "a recorded session through the twin",
    "calibrate": "parameters of a scene from healthy sessions",
    "batch": "many recorded sessions through the twin, one table (extra batch)",
    "compare": "two recorded sessions side by side",
    "study": "reports on the methods: error against run time",
    "rig": "make a synthetic session on the virtual rig (extra peers)",
}
"""Purpose of each command. The command is the module of that name in `boom_twin.cli`, with the functions of `Command`."""

# New objects between two searches for garbage. Modules hold none, and looking through those of numba again and again takes
# 0.05 s, once more at the exit 0.09 s: hence also gc.freeze().
COLLECT_AFTER = 100_000

DESCRIPTION = "Digital twin of a concrete placing boom."
EXIT_CODES = "exit codes: 0 done, 1 the input or the run failed (the reason is on stderr), 2 usage"
COMPLETING = "_ARGCOMPLETE"
"""Set in the environment by a shell that asks for completions."""


class Command(Protocol):
    """Module of one command."""

    def add_arguments(self, parser: ArgumentParser) -> None:
        """Declare the arguments of the command."""

    def run(self, args: Namespace) -> int:
        """Run the command and return the exit code."""


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command and return the exit code.

    Parameters
    ----------
    argv : sequence of str, optional
        Arguments without the program's name; by default those of the process, which then has nothing else to do.
    """
    if argv is not None:
        return _main(argv)
    open_closed_streams()
    gc.set_threshold(COLLECT_AFTER)
    try:
        return _main(sys.argv[1:])
    finally:
        gc.freeze()


def _main(arguments: Sequence[str]) -> int:
    """Run one command; escape its output, so that no file or message can steer the terminal."""
    out, told = (_printable(stream, name) for stream, name in ((sys.stdout, "standard output"), (sys.stderr, "")))
    with redirect_stdout(out), redirect_stderr(told):
        try:
            return _run(arguments)
        finally:
            with suppress(OSError):
                out.flush()  # of help, too


def _printable(stream: TextIO | None, name: str) -> TextIO:
    """Return a stream for all that is printed; it discards everything if the caller has closed the stream."""
    return cast(TextIO, PrintableStream(stream or open(os.devnull, "w", encoding="utf-8"), name))


def _run(arguments: Sequence[str]) -> int:
    name = ""
    try:
        args = _parser(arguments).parse_args(arguments)
        name = f" {args.command}"
        with redirect_stderr(cast(TextIO, QuietStream(sys.stderr)) if args.quiet else sys.stderr):
            code = _command(args.command).run(args)
        sys.stdout.flush()
        return code
    except BoomTwinError as error:
        reason = str(error)
    except OSError as error:
        reason = f"{error.filename}: {error.strerror}" if error.filename else str(error)
    except KeyboardInterrupt:
        reason = "stopped"
    print(f"boom_twin{name}: {reason}", file=sys.stderr)
    return 1


def _command(name: str) -> Command:
    return cast(Command, import_module(f".{name}", __package__))


def _parser(arguments: Sequence[str]) -> ArgumentParser:
    """Return the parser of all commands; only the module of the command that is named gets imported."""
    parser = CommandParser(prog="boom_twin", description=DESCRIPTION, epilog=EXIT_CODES)
    parser.add_argument("--version", action="version", version=f"boom_twin {__version__}")
    commands = parser.add_subparsers(dest="command", metavar="COMMAND", required=True)
    is_completing = COMPLETING in os.environ
    for name, purpose in COMMANDS.items():
        about = purpose[0].upper() + purpose[1:] + "."
        own = commands.add_parser(name, help=purpose, description=about, epilog=epilog_of(name))
        own.add_argument("--quiet", action="store_true", help="leave out what is told on the way, but for warnings")
        if is_completing or name in arguments:
            _command(name).add_arguments(own)
    if is_completing:
        _complete(parser)
    return parser


def _complete(parser: ArgumentParser) -> None:
    """Answer the shell's question for what may follow, where argcomplete is installed, and end."""
    try:
        from argcomplete import autocomplete
    except ImportError:
        sys.exit(1)
    autocomplete(parser)


def add_scene(parser: ArgumentParser) -> None:
    """Declare the scene file, as ``--scene`` or as a positional argument; without it, the default scene."""
    either = parser.add_mutually_exclusive_group()
    either.add_argument("--scene", metavar="SCENE", help="scene file (YAML); without it, the default scene")
    either.add_argument("scene", nargs="?", default=SUPPRESS, metavar="SCENE", help="the same, without --scene before it")


def add_session_scene(parser: ArgumentParser) -> None:
    """Declare ``--scene`` of a command that reads a session; see `open_session_scene`."""
    told = "scene file (YAML); without it, the one that the session was made with, else the default scene"
    parser.add_argument("--scene", metavar="SCENE", help=told)


def add_params(parser: ArgumentParser) -> None:
    """Declare ``--params``, see `open_session_settings`."""
    parser.add_argument(
        "--params", metavar="FILE", type=Path, help="ROS parameter file (as recorded, else the package's twin.yaml)"
    )


def add_json(parser: ArgumentParser) -> None:
    """Declare ``--json``: stdout holds exactly one flat JSON object."""
    parser.add_argument("--json", action="store_true", help="print one flat JSON object on stdout, nothing else there")


def add_ros_args(parser: ArgumentParser) -> None:
    """Declare ``--namespace`` and ``--ros-args``, for `ros_arguments`."""
    add_namespace(parser, "ROS namespace of the twin: --namespace front is short for --ros-args -r __ns:=/front")
    told = "namespace, remappings and enclave, as for any node: -r cylinder_strokes:=/rig/strokes -e /boom_twin/recorder"
    parser.add_argument("--ros-args", nargs=REMAINDER, default=[], help=told)


def add_namespace(parser: ArgumentParser, told: str) -> None:
    """Declare ``--namespace``."""
    parser.add_argument("--namespace", metavar="NAME", default="", help=told)


def ros_arguments(args: Namespace) -> list[str]:
    """Return the ROS arguments for rclpy, or for a further process of this package."""
    namespace = args.namespace.strip("/")
    return ["--ros-args", *(["-r", f"__ns:=/{namespace}"] if namespace else []), *args.ros_args]


def open_scene(source: str | None) -> Scene:
    """Return the scene of an argument; its warnings go to stderr, one line each."""
    from ..scene.load import examine

    scene, oddities = examine(source)
    if source is None:
        print("scene: default scene, the package's own rig; give SCENE for another", file=sys.stderr)
    tell(oddities, source)
    return scene


def open_session_scene(session: str | Path, source: str | None) -> SessionScene:
    """Return the scene of a session, see `boom_twin.bag.session_model.scene_of`; its source and warnings go to stderr."""
    from ..bag.session_model import scene_of

    found = scene_of(Path(session), source)
    print(f"scene: {found.source} (sha256 {found.sha256[:12]}..)", file=sys.stderr)
    tell(found.oddities, found.source)
    return found


def open_session_settings(session: str | Path, params: Path | None, namespace: str = "") -> Settings:
    """Return the settings of a session's twin, see `boom_twin.bag.session_model.settings_of`; unusual ones go to stderr."""
    from ..bag.session_model import settings_of

    found = settings_of(Path(session), params, namespace)
    if found.others:
        told = ", ".join(f"{name} {value:g}" for name, value in found.others.items())
        print(f"parameters: {found.source}: {told}", file=sys.stderr)
    return found.settings


def tell(oddities: Iterable[Fault], source: str | None) -> None:
    """Print warnings and notes on stderr, with the file that they are about."""
    for oddity in oddities:
        print(f"{oddity.kind}: {source}: {oddity}", file=sys.stderr)


def warn_incomplete(session: Session) -> None:
    """Warn on stderr if a session is incomplete, its recorder's clock was set back, or messages never reached the recorder."""
    from ..bag.reader import clocks_set_back
    from ..bag.session_sheet import missed_messages

    if session.incomplete:
        print(f"warning: {session.path}: {session.incomplete}", file=sys.stderr)
    for told in clocks_set_back(session):
        print(f"warning: {told}", file=sys.stderr)
    if missed := missed_messages(session.path):
        told = ", ".join(f"{count} of {topic}" for topic, count in missed.items()) + "; a node that got them told otherwise"
        print(f"warning: {session.path}: never reached the recorder: {told}", file=sys.stderr)


def print_result(is_json: bool, values: Mapping[str, Any], lines: Iterable[str]) -> None:
    """Print a result: `values` as JSON, or `lines` for people."""
    if is_json:
        print_json(values)
    else:
        print("\n".join(lines))


def print_json(values: Mapping[str, Any]) -> None:
    """Print one flat JSON object; a number that is not finite becomes null."""
    print(json.dumps(plain_values(values), allow_nan=False))


def plain_values(values: Mapping[str, Any]) -> dict[str, Any]:
    """Return values as JSON has them; a number that is not finite becomes None."""
    return {key: _plain(value) for key, value in values.items()}


def _plain(value: Any) -> Any:
    if isinstance(value, Mapping):
        raise TypeError("the object must be flat")
    if hasattr(value, "tolist"):
        value = value.tolist()
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    if isinstance(value, float) and value - value != 0.0:
        return None
    return value


if __name__ == "__main__":
    sys.exit(main())
