"""`boom_twin init`: a first scene from the drawing's dimensions, out of a table or asked for on the terminal."""

from __future__ import annotations

import re
import shlex
import sys
from argparse import ArgumentParser, Namespace
from collections.abc import Iterator
from importlib.resources import files
from pathlib import Path
from typing import Any

from ..config.yaml_text import Document, Place, whole_text, words
from ..errors import UsageError
from ..scene.block_reader import NUMBER, meaning_at, validated
from ..scene.boom_table import BoomTable, checked_table, frozen, read_table
from ..scene.checks.values import NEEDED
from ..scene.first_scene import first_scene
from ..system.atomic_files import check_new, check_target, write_atomic
from .output import tell_oddities

QUESTIONS: tuple[tuple[Place, str | None], ...] = (
    (("base", "pivot"), "0, 0"),
    (("base", "cylinder_pin"), None),
    (("pipe",), "0"),
    (("payload",), "0"),
    (("bulk_modulus",), "1.4 GPa"),
    (("damping_ratio",), "0.01"),
)
"""Keys of the table that are no section's or joint's, with their defaults."""
KEPT = ".table.yaml"  # how the name of the file ends that keeps the answers, beside the scene


def add_arguments(parser: ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument("--table", metavar="FILE", help="dimensions in YAML or CSV; without it, they are asked for")
    parser.add_argument("--force", action="store_true", help="replace a scene that is there, after the table was mended")
    what = parser.add_mutually_exclusive_group(required=True)
    what.add_argument("--out", metavar="SCENE", type=Path, help="scene file to write; one that is there is left alone")
    what.add_argument("--example-table", action="store_true", help="print a table to start from, and do no more")


def run(args: Namespace) -> int:
    """Write the scene."""
    if args.example_table:
        sys.stdout.write((files("boom_twin") / "msg_config" / "boom_table.yaml").read_text(encoding="utf-8"))
        return 0
    sources = [Path(args.table)] if args.table else []
    check_target(args.out, sources)
    if not args.force and args.out.is_file() and args.out.stat().st_size:
        raise UsageError(f"{args.out}: is there already. Name another file, or give --force to replace it.")
    if args.table:
        table, document = read_table(Path(args.table))
        source = args.table
    else:
        kept = args.out.with_suffix(KEPT)
        check_new(kept, [args.out])
        document = Document(frozen(_asked()))
        write_atomic(kept, whole_text(document.values))
        print(f"Answers kept: {kept}; mend them there, then `boom_twin init --table {kept} --out {args.out}`")
        table, source = checked_table(document, str(kept)), str(kept)
    text, scene, oddities = first_scene(table, document, source)
    write_atomic(args.out, text)
    tell_oddities(oddities, source)
    count = len(scene.sections)
    size = f"{count} section{'s' * (count > 1)}, {scene.reach:.2f} m"
    print(f"Written: {args.out}, {size}. {_next(args.out, source, len(oddities))}")
    return 0


def _next(scene: Path, source: str, warnings: int) -> str:
    """Return in words what to do after the scene is written."""
    if not warnings:
        picture = str(scene.with_suffix(".png"))
        check = shlex.join(["boom_twin", "check", str(scene), "--strict", "--picture", picture])
        return f"Next: {check}, and look at {picture}."
    again = shlex.join(["boom_twin", "init", "--table", source, "--out", str(scene), "--force"])
    return f"Next: mend {source} where it is warned of, then {again}"


def _asked() -> dict[str, Any]:
    """Ask for the values of a table and return them."""
    print("Dimensions as on the drawing: `8500 mm`, `8.5`, two numbers as `1320 mm, -264 mm`. An empty line takes [..].")
    values: dict[str, Any] = {"base": {}, "sections": [], "joints": []}
    values["description"] = _line("description [none]: ") or "Boom described by boom_twin init."
    for place, default in QUESTIONS:
        _ask(values, place, default)
    count = 0
    while not 1 <= count <= 20:
        answer = _line("number of sections: ")
        count = int(answer) if answer.isdigit() else 0
    for i in range(count):
        values["sections"].append({})
        values["joints"].append({})
        for place, default in _questions_of_section(values, i):
            _ask(values, place, default)
    return values


def _questions_of_section(values: dict[str, Any], i: int) -> Iterator[tuple[Place, str | None]]:
    """Yield the keys of section and joint `i` with their defaults. Those of the joint depend on its kind, asked first."""
    section, joint = ("sections", i), ("joints", i)
    for key in ("length", "beam", "height", "width", "wall", *(["rod_pin"] if i == 0 else [])):
        yield (*section, key), None
    yield (*joint, "kind"), "B1" if i else "A"
    yield (*joint, "range_deg"), None
    for key in ("bore", "rod", *NEEDED[values["joints"][i]["kind"]]):
        yield (*joint, key), None
    for key in ("mL", "mR") if i else ():
        yield (*joint, key), "0"


def _ask(values: dict[str, Any], place: Place, default: str | None) -> None:
    """Ask for one value until the table takes it."""
    block: Any = values
    for step in place[:-1]:
        block = block[step]
    meaning = f"{words(place)}, {meaning_at(BoomTable, place)}"
    while True:
        answer = _line(f"{meaning}{f' [{default}]' if default else ''}: ") or default or ""
        block[place[-1]] = _value(answer)
        wrong = [fault for fault in validated(Document(frozen(values)), BoomTable).faults if _is_at(fault.path, place)]
        if answer and not wrong:
            return
        print("\n".join(f"  {fault}" for fault in wrong) or "  A value is needed.")


def _is_at(path: str, place: Place) -> bool:
    return path == words(place) or path.startswith(f"{words(place)}[")


def _line(prompt: str) -> str:
    """Ask for one line and return it."""
    print(prompt, end="", flush=True)
    line = sys.stdin.readline()
    if not line:
        raise UsageError(f"the answers end at `{prompt.strip()}`. Answer on a terminal, or give --table (--example-table).")
    return line.strip()


def _value(answer: str) -> Any:
    parts = [part.strip() for part in re.split(r"[,;]", answer.strip("[] "))]
    found = tuple(float(part) if NUMBER.fullmatch(part) else part for part in parts)
    return found if len(found) > 1 else found[0]
