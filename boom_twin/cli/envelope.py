"""`boom_twin envelope`: deflection, forces, frequencies, moments and stresses over the working range, worst postures named."""

from __future__ import annotations

import csv
import io
from argparse import ArgumentParser, Namespace
from contextlib import nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ..system.result_text import json_text
from .arguments import add_file, add_json, add_scene, files_of
from .output import columns, open_scene, print_result

if TYPE_CHECKING:
    from ..analysis.envelope import Envelope
    from ..offline.progress import ProgressBar
    from ..scene import Scene
    from ..types import Array


def add_arguments(parser: ArgumentParser) -> None:
    add_scene(parser)
    add_file(parser, "--out", "folder for envelope.csv (a row a posture), .json and .png", "DIR")
    add_json(parser)


class Quantity(NamedTuple):
    """Column of the envelope: key of ``--json``, words, values by posture, factor and name of the unit that people read."""

    key: str
    words: str
    values: Array
    factor: float
    unit: str


def run(args: Namespace) -> int:
    """Compute, print and write."""
    from ..system.result_folder import ENVELOPE, result_folder

    scene = open_scene(args.scene)
    with nullcontext() if args.out is None else result_folder(args.out, ENVELOPE, files_of(args, "scene")) as building:
        result = _computed(scene)
        quantities = quantities_of(result)
        values, lines = _summary(result, quantities), _report(result, quantities)
        if building is not None:
            _write(building, result, quantities, values, scene)
    if args.out is not None:
        lines += ["", *(f"Written: {args.out / name}" for name in ("envelope.csv", "envelope.json", "envelope.png"))]
    print_result(args.json, values, lines)
    return 0


def _computed(scene: Scene) -> Envelope:
    """Compute the envelope, with progress on stderr."""
    from ..analysis.envelope import envelope
    from ..offline.progress import ProgressLine

    bars: list[ProgressBar] = []

    def progress(done: int, total: int) -> None:
        if done == 1:
            bars.append(ProgressLine(total, "extremes" if bars else "postures", "envelope"))
        bars[-1].update(1)
        if done == total:
            bars[-1].close()

    return envelope(scene, progress)


def quantities_of(result: Envelope) -> list[Quantity]:
    """Return all columns of numbers, in the order of the table; without moments and stresses that a section does not have."""
    found_columns = [Quantity("deflection_m", "tip deflection", result.deflections, 1e3, "mm")]
    for key, words, values, factor, unit in (
        ("cylinder_{}_force_N", "cylinder {} force", result.forces, 1e-3, "kN"),
        ("frequency_{}_Hz", "frequency {}", result.frequencies, 1.0, "Hz"),
        ("section_{}_moment_N_m", "section {} bending moment", result.moments, 1e-3, "kN m"),
        ("section_{}_stress_Pa", "section {} bending stress", result.stresses, 1e-6, "MPa"),
    ):
        for i, column in enumerate(values.T, 1):
            if not (column != column).any():
                found_columns.append(Quantity(key.format(i), words.format(i), column, factor, unit))
    return found_columns


def _summary(result: Envelope, quantities: list[Quantity]) -> dict[str, Any]:
    values: dict[str, Any] = {"postures": len(result.names), "searched": result.searched}
    values |= {f"skipped_{reason.replace(' ', '_')}": count for reason, count in result.skipped.items()}
    for quantity in quantities:
        for name, row in (("least", quantity.values.argmin()), ("greatest", quantity.values.argmax())):
            values[f"{quantity.key}_{name}"] = float(quantity.values[row])
            values[f"{quantity.key}_{name}_angles_deg"] = result.angles[row]
    return values


def _report(result: Envelope, quantities: list[Quantity]) -> list[str]:
    skipped = ", ".join(f"{count} {reason}" for reason, count in result.skipped.items() if count)
    lines = [f"{len(result.names)} postures at rest{f'; left out: {skipped}' if skipped else ''}"]
    lines += [f"{result.searched} of them were found by a search (L-BFGS-B) for each extreme, from the best of a grid"]
    lines += ["postures: by name, or section angles to the base in degrees, as --posture takes them", ""]
    rows = [["", "least", "in posture", "greatest", "in posture"]]
    for quantity in quantities:
        row = [f"{quantity.words}, {quantity.unit}"]
        for place in (int(quantity.values.argmin()), int(quantity.values.argmax())):
            row += [f"{round(quantity.factor * quantity.values[place], 9) + 0.0:.4g}", result.posture(place)]
        rows.append(row)
    lines += columns(rows, left=(0, 2, 4))
    rigid, bare = np.isnan(result.moments[0]), np.isnan(result.stresses[0])
    for lacking, told in (
        (rigid, "No moments of section {}: it has no beam. Give it one, with modes: 0 if it shall not bend."),
        (bare & ~rigid, "No stresses of section {}: give its height, the outer height of the box in m."),
    ):
        lines += ["", told.format(", ".join(map(str, np.flatnonzero(lacking) + 1)))] if lacking.any() else []
    return lines


def _write(folder: Path, result: Envelope, quantities: list[Quantity], values: dict[str, Any], scene: Scene) -> None:
    from ..plots.analysis import envelope_picture

    (folder / "envelope.csv").write_text(_csv(result, quantities), encoding="utf-8")
    (folder / "envelope.json").write_text(json_text(values) + "\n", encoding="utf-8")
    bars = [(f"{q.words}, {q.unit}", q.factor * q.values) for q in quantities[1:]]
    envelope_picture(folder / "envelope.png", scene, result, bars)


def _csv(result: Envelope, quantities: list[Quantity]) -> str:
    stream = io.StringIO()
    table = csv.writer(stream, lineterminator="\n")
    angles = [f"section_{i + 1}_deg" for i in range(result.angles.shape[1])]
    table.writerow(["posture", *angles, "tip_x_m", "tip_y_m", *(quantity.key for quantity in quantities)])
    for row, name in enumerate(result.names):
        numbers = [*result.angles[row], *result.tips[row], *(quantity.values[row] for quantity in quantities)]
        table.writerow([name, *(f"{float(number):.9g}" for number in numbers)])
    return stream.getvalue()
