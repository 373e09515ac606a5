"""`boom_twin check --need tip=1mm`: the leanest model that keeps the tip, in words, as JSON and as a scene file."""

from __future__ import annotations

import math
import sys
from argparse import ArgumentParser, ArgumentTypeError, Namespace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..scene import Scene
from ..scene.block_reader import quantity
from ..scene.load import default_text, read_text, with_end_mark
from ..system.files import check_new, write_atomic
from .arguments import add_file, files_of, refuse_given

if TYPE_CHECKING:
    from ..reduction.search import Proposal
    from ..scene.edit import Edit


FORM = "give the error that the tip may have, with its unit, like tip=1mm, tip=0.5cm or tip=0.001m"
ANOTHER = "Another motion may differ: an error holds for the motion on which it was measured."
FREE = "Damping and the compliance of cylinders cost no time, so they stay."
MEANING = {
    "axial": "no axial coordinate",
    "geometric": "no geometric stiffness",
    "rho_I": "no rotary inertia of the beam",
    "mL": "massless link L",
    "mR": "massless link R",
    "barrel": "massless barrel",
    "rod": "massless rod",
}


def add_arguments(parser: ArgumentParser) -> None:
    purpose = "propose the leanest model whose tip stays so near to this scene's (mm, cm, m)"
    parser.add_argument("--need", type=tip_error, metavar="tip=1mm", help=purpose)
    add_file(parser, "--out", "with --need: write the lean scene file here", "LEAN")


def refuse_misuse(args: Namespace) -> None:
    """Raise UsageError for an option that needs ``--need``, without it, and for writing over a file."""
    if args.need is None:
        refuse_given(args, "goes with --need only. Add --need tip=1mm.", "out")
    elif args.out is not None:
        check_new(args.out, files_of(args, "scene"))


def tip_error(text: str) -> float:
    """Return the value of ``--need`` in m; raise ArgumentTypeError if it is not of the form ``tip=1mm``."""
    what, _, size = text.partition("=")
    value = quantity(size, "m")
    if value is None:
        value = "a number of mm, cm or m is needed, with its unit"
    if what.strip() != "tip":
        raise ArgumentTypeError(f"{text!r}: only the error of the tip can be stated; {FORM}")
    if isinstance(value, str) or not 0.0 < value < math.inf:
        raise ArgumentTypeError(f"{text!r}: {value if isinstance(value, str) else 'it must be positive and finite'}; {FORM}")
    return value


def search(scene: Scene, most: float) -> Proposal:
    """Search for the leanest model, with progress on stderr."""
    from ..reduction.search import propose

    def show(what: str) -> None:
        if sys.stderr.isatty():
            print(f"\r{what:70s}\r", end="", file=sys.stderr, flush=True)

    proposal = propose(scene, most, show)
    show("")
    return proposal


def summary(proposal: Proposal, most: float) -> dict[str, Any]:
    """Return the keys that ``--need`` adds to the flat object of ``check``."""
    return {
        "need_tip_m": most,
        "lean_edits": [str(edit) for edit in proposal.edits],
        "lean_tip_error_m": proposal.deviation.worst,
        "lean_rest_error_m": proposal.deviation.rest,
        "lean_rest_error_at": proposal.deviation.where,
        "lean_move_error_rms_m": proposal.deviation.rms,
        "lean_move_error_max_m": proposal.deviation.most,
        "measured_at_rest_in": list(proposal.course.names),
        "measured_in_move": proposal.course.motion.label,
        "note": ANOTHER,
        "step_s": proposal.course.step,
        "full_step_time_s": proposal.seconds[0],
        "lean_step_time_s": proposal.seconds[1],
        "full_unknowns": proposal.unknowns[0],
        "lean_unknowns": proposal.unknowns[1],
        "next": None if proposal.next is None else proposal.next[0],
        "next_tip_error_m": None if proposal.next is None else proposal.next[1],
    }


def report(scene: Scene, proposal: Proposal, most: float) -> list[str]:
    off, course, (full, lean) = proposal.deviation, proposal.course, proposal.seconds
    lines = ["", f"Leanest model found that keeps the tip within {_length(most)}"]
    width = max((len(str(edit)) for edit in proposal.edits), default=0)
    edits = [f"  {edit!s:{width}}  {_meaning(scene, edit)}" for edit in proposal.edits]
    lines += edits or ["  this one: nothing can be left out"]
    if proposal.next is not None:
        lines.append(f"  not: {proposal.next[0]}, the tip would be {_length(proposal.next[1])} off")
    lines += [f"  {FREE}", "", "Its tip against the full model's"]
    lines.append(f"  at rest    {_length(off.rest)} at most, in {off.where} (of: {', '.join(course.names)})")
    lines.append(f"  in a move  {_length(off.rms)} rms, {_length(off.most)} at most; {course.motion.label}")
    lines += [f"  {ANOTHER}", "", f"Run time of a step of {1e3 * course.step:g} ms, least of interleaved runs"]
    lines.append(f"  full  {1e6 * full:6.1f} us  {proposal.unknowns[0]:4d} unknowns")
    lines.append(f"  lean  {1e6 * lean:6.1f} us  {proposal.unknowns[1]:4d} unknowns, {full / lean:.2f} times as fast")
    return lines


def write(source: str | None, scene: Scene, proposal: Proposal, most: float, out: Path) -> None:
    """Write the lean scene as a file: the text of `source` (None: the default scene) with the edits made."""
    from ..scene.edit import rewritten

    text = default_text() if source is None else read_text(Path(source))
    head = [
        f"# Lean model of {source or 'the default scene'}, by boom_twin check --need tip={most:g}m:",
        *(f"#   {edit}" for edit in proposal.edits),
        f"# Tip at most {_length(proposal.deviation.worst)} from the full model's, at rest in the postures and in a move",
        f"# ({proposal.course.motion.label}).",
        f"# {ANOTHER}",
    ]
    body = "\n".join(head) + "\n\n" + rewritten(text, scene, proposal.scene)
    write_atomic(out, with_end_mark(body))


def _meaning(scene: Scene, edit: Edit) -> str:
    block, number, key = str(edit.place[0]).removesuffix("s"), int(edit.place[1]), str(edit.place[-1])
    what = MEANING.get(key, "")
    if key == "modes":
        several = f"{edit.value} bending coordinate{'s' * (edit.value != 1)} a part, not {scene.of_section(number, 'modes')}"
        what = several if edit.value else "rigid"
    return f"{block} {number + 1}: {what}"


def _length(value: float) -> str:
    return f"{1e3 * value:.3g} mm"
