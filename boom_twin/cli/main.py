"""The console script: picks the command, and turns errors of the input into one message and an exit code.

A command imports what it needs when it runs, so that help and usage errors are told at once.

Exit codes: 0 done, 1 the input or the run failed (the reason is on stderr), 2 usage.
"""

from __future__ import annotations

import gc
import os
import re
import sys
from argparse import ArgumentParser, Namespace, RawDescriptionHelpFormatter
from collections.abc import Sequence
from contextlib import nullcontext, redirect_stderr, redirect_stdout, suppress
from difflib import get_close_matches
from importlib import import_module
from keyword import iskeyword
from types import ModuleType
from typing import NoReturn, TextIO, cast

from .. import __version__
from ..errors import BoomTwinError
from ..system.processes import collect_rarely, use_one_blas_thread
from ..system.terminal_text import PrintableStream, open_closed_streams
from .output import quiet

use_one_blas_thread()
os.environ.setdefault("PYDANTIC_DISABLE_PLUGINS", "__all__")  # it looks for them in every installed package, which takes 12 ms

COMMANDS: dict[str, str] = {
    "check": "validate a scene and list what its model contains",
    "init": "write a first scene from the dimensions of a drawing",
    "import": "convert loggers' CSV and Parquet files to a session",
    "info": "list what a recorded session holds and what it lacks",
    "monitor": "serve the live page, of the topics or of a recorded session",
    "play": "publish a recorded session over ROS 2",
    "record": "record the session topics from ROS 2",
    "recover": "save the sound part of a damaged session",
    "scene": "print the default scene file",
    "mapping": "print the default mapping of topics and sensors, or check the wiring of a session",
    "urdf": "print a scene as a URDF, for robot_state_publisher",
    "views": "write files for RViz, Foxglove and PlotJuggler, for a boom in a namespace",
    "statics": "compute static equilibrium, cylinder forces, natural frequencies",
    "envelope": "find the extremes of sag, forces, frequencies, stresses over the working range",
    "simulate": "simulate the motion of the boom under a stroke history",
    "response": "compute frequency response, steady states, pump rates to avoid",
    "replay": "run a recorded session through the twin",
    "calibrate": "estimate parameters of a scene from healthy sessions",
    "modal": "measure natural frequencies and damping in rest periods (extra modal)",
    "batch": "run many recorded sessions through the twin, into one table (extra batch)",
    "compare": "compare two recorded sessions side by side",
    "warm": "compile the kernels beforehand, as for an image; or remove them",
    "study": "report on the methods: error against run time, stability, cost of parts",
    "rig": "make a synthetic session on the virtual rig (extra peers)",
}
"""Purpose of each command, the module of that name in `boom_twin.cli`.

Its function ``add_arguments(parser)`` declares the arguments, and ``run(args)`` runs the command and returns the exit code.
"""

EXAMPLES: dict[str, tuple[str, ...]] = {
    "check": ("check my_boom.yaml", "check my_boom.yaml --need tip=1mm"),
    "import": (
        "import cylinders.csv angles.csv imu.csv --scene my_boom.yaml --timezone Europe/Berlin --out bags/today",
        "import cylinders.csv --propose > columns.yaml",
        "import cylinders.csv --columns columns.yaml --out bags/today",
    ),
    "info": ("info bags/arch_session", "info session.csv --mapping rig.yaml"),
    "monitor": ("monitor", "monitor --bag bags/arch_session --start 10"),
    "play": ("play bags/arch_session --rate 2 --loop --clock 100",),
    "record": ('record --out bags/today --note "wind 5 m/s"',),
    "recover": ("recover bags/broken --out out/saved",),
    "scene": ("scene", "scene --clearance"),
    "mapping": ("mapping > rig.yaml", "mapping --check bags/arch_session --out mended.yaml"),
    "views": ("views --namespace front --out out/views",),
    "urdf": ("urdf my_boom.yaml",),
    "statics": ("statics my_boom.yaml --posture arch", "statics --strokes=0.63,0.165,0.235,0.187 --json"),
    "response": ("response my_boom.yaml --posture arch", "response --posture arch --pump 0.4:130"),
    "envelope": ("envelope my_boom.yaml --out out/envelope",),
    "init": ("init --example-table > boom_table.yaml", "init --table boom_table.yaml --out my_boom.yaml"),
    "simulate": (
        "simulate my_boom.yaml --drive examples/strokes.csv --out motion.csv",
        "simulate --drive examples/strokes.csv --force examples/tip_force.csv --out pushed.csv",
    ),
    "replay": (
        "replay bags/arch_session --out out/replay --report",
        "replay bags/arch_session --out out/numbers --no-bag --no-pictures --table csv",
        "replay session.csv --scene my_boom.yaml --out out/replay --start 10 --duration 20 --table csv",
    ),
    "calibrate": ("calibrate bags/today bags/tomorrow --out calibrated.yaml",),
    "modal": ("modal bags/night --out out/modal",),
    "batch": ("batch 'bags/*' --out out/batch",),
    "compare": ("compare bags/before bags/after",),
    "warm": ("warm", "warm --remove"),
    "study": ("study error --out out/study/error",),
    "rig": ("rig --out out/soft --fault cylinder_2.k:softer:0.3", "rig --list-faults"),
}
"""Examples that the help of each command ends with: arguments of `boom_twin`."""


DESCRIPTION = "Digital twin of a concrete placing boom."
EXIT_CODES = "exit codes: 0 done, 1 the input or the run failed (the reason is on stderr), 2 usage"


class CommandParser(ArgumentParser):
    """Parser whose errors name the nearest option or choice."""

    def __init__(self, *args: object, **options: object) -> None:
        options.setdefault("formatter_class", RawDescriptionHelpFormatter)
        super().__init__(*args, **options)  # type: ignore[arg-type]
        self._negative_number_matcher = re.compile(r"-\.?\d")  # values, no options: also lists, as -5,-170

    def parse_known_args(  # type: ignore[override]
        self, args: Sequence[str] | None = None, namespace: Namespace | None = None
    ) -> tuple[Namespace, list[str]]:
        """Parse arguments as `ArgumentParser` does; report unknown ones here, where the options of the command are known."""
        found, extra = super().parse_known_args(args, namespace)
        if extra:
            self.error(f"unrecognized arguments: {' '.join(extra)}{self._near(extra[0], list(self._option_string_actions))}")
        return found, extra

    def error(self, message: str) -> NoReturn:
        """Print usage and message, with the nearest choice if one was wrong, and exit with 2."""
        wrong = message.partition("invalid choice: ")[2].split("'")[1:2]
        known = [str(choice) for action in self._actions for choice in action.choices or ()]
        super().error(message + (self._near(wrong[0], known) if wrong else ""))

    @staticmethod
    def _near(word: str, known: list[str]) -> str:
        near = get_close_matches(word, known, n=1, cutoff=0.5)
        return f". Did you mean {near[0]}?" if near else ""


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command and return the exit code. `argv` is None in the console script, whose process then ends."""
    if argv is not None:
        return _main(argv)
    open_closed_streams()
    collect_rarely()
    try:
        return _main(sys.argv[1:])
    finally:
        gc.freeze()  # without, the collection at the exit takes 0.09 s


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
        with quiet() if args.quiet else nullcontext():
            code: int = _command(args.command).run(args)
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


def _command(name: str) -> ModuleType:
    return import_module(f".{name}_" if iskeyword(name) else f".{name}", __package__)


def _parser(arguments: Sequence[str]) -> ArgumentParser:
    """Return the parser of all commands; only the module of the command that is named gets imported."""
    listed = [f"  {name:{max(map(len, COMMANDS))}}  {purpose}" for name, purpose in COMMANDS.items()]
    ends = "\n".join(["commands:", *listed, "", EXIT_CODES])
    parser = CommandParser(prog="boom_twin", description=DESCRIPTION, epilog=ends)
    parser.add_argument("--version", action="version", version=f"boom_twin {__version__}")
    commands = parser.add_subparsers(dest="command", metavar="COMMAND", required=True, help="see below")
    for name, purpose in COMMANDS.items():
        about = purpose[0].upper() + purpose[1:] + "."
        examples = [f"  boom_twin {example}" for example in EXAMPLES.get(name, ())]
        own = commands.add_parser(name, description=about, epilog="\n".join(["examples:", *examples] if examples else []))
        own.add_argument("--quiet", action="store_true", help="print results, warnings and errors only")
        if name in arguments:
            _command(name).add_arguments(own)
    return parser


if __name__ == "__main__":
    sys.exit(main())
