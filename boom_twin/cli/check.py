"""`boom_twin check`: validate a scene and describe its model in words and numbers."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from collections.abc import Mapping, Sequence
from itertools import combinations
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..errors import BoomTwinError, Fault, SceneError, UsageError
from ..scene import Scene
from ..scene.kinematics import strokes_of_posture
from ..scene.load import DEFAULT_NAME, examine
from ..scene.schema import Base, Clearance
from ..scene.segmentation import LEAST_PARTS
from ..scene.summary import STATIONS, UNKNOWNS_BASE, UNKNOWNS_PIN, Account, JointAccount, SectionAccount, explain
from ..system.files import check_target
from ..system.terminal_text import several
from ..types import Place, Stream, StrokeReading
from . import reduce as need
from .arguments import SENSOR_LIST, add_file, add_json, add_scene, files_of, sensors_of
from .output import columns, print_result, tell

if TYPE_CHECKING:
    from ..deviation.accuracy import TipAccuracy

PNG = b"\x89PNG"  # first bytes of a picture; only such a file is replaced


def add_arguments(parser: ArgumentParser) -> None:
    add_scene(parser)
    add_json(parser)
    parser.add_argument("--strict", action="store_true", help="treat warnings as errors: exit code 1 if there are any")
    add_file(parser, "--picture", "PNG file to draw: all pins, links and cylinders over the range of each joint")
    need.add_arguments(parser)
    chosen = (
        f"also tell how accurate the estimate of the tip is with these and with fewer, at every posture of the scene: "
        f"{SENSOR_LIST}; a name given twice is two such sensors"
    )
    parser.add_argument("--sensors", metavar="NAME,..", help=chosen)
    driven = "what the sensors are beside: strokes (the default), or angles on a boom without stroke transducers"
    parser.add_argument("--drive", choices=["strokes", "angles"], default="strokes", help=driven)


def run(args: Namespace) -> int:
    """Check and describe the scene; an invalid one raises `SceneError`."""
    need.refuse_misuse(args)
    if args.picture is not None:
        check_target(args.picture, files_of(args, "scene"), PNG)
    scene, oddities = examine(args.scene)
    sensors = None if args.sensors is None else sensors_of(args.sensors, scene)
    if args.drive == "angles" and any(stream is Stream.ANGLES for _, stream, _ in sensors or ()):
        raise UsageError("--sensors angles: angles drive the model. Name only the further sensors.")
    name = args.scene or DEFAULT_NAME
    drawn = []
    if args.picture is not None:
        from ..plots.boom import joint_ranges_picture

        drawn = [f"Written: {joint_ranges_picture(args.picture, scene, Path(name).name)}"]
    warnings, notes = ([each for each in oddities if (each.kind == "note") is is_note] for is_note in (False, True))
    if args.strict and warnings:
        for line in drawn:  # the picture shows what the warnings are about
            tell(line)
        raise SceneError(name, tuple(warnings))
    account = explain(scene)
    values, lines = summary(name, account, warnings, notes), report(name, scene, account, warnings, notes)
    if scene.clearance is not None:
        law = scene.clearance.contact
        values |= {"restitution": law.restitution, "restitution_given": law.given_restitution}
    if args.need is not None:
        result = need.search(scene, args.need)
        values |= need.summary(result, args.need)
        lines += need.report(scene, result, args.need)
        if args.out is not None:
            need.write(args.scene, scene, result, args.need, args.out)
            lines.append(f"Written: {args.out}")
    if sensors is not None:
        accuracy, rows = _accuracy(scene, sensors, args.drive)
        values |= accuracy
        lines += rows
    print_result(args.json, values, lines + drawn)
    return 0


def summary(name: str, account: Account, warnings: Sequence[Fault], notes: Sequence[Fault]) -> dict[str, Any]:
    sections, joints, base = account.sections, account.joints, account.scene.base.stiffness
    return {
        "scene": name,
        "sections": len(sections),
        "kinds": [joint.kind for joint in account.scene.joints],
        "length_m": account.scene.reach,
        "section_length_m": [section.length for section in account.scene.sections],
        "mass_kg": account.mass,
        "section_mass_kg": [section.mass for section in sections],
        "joint_mass_kg": [joint.mass for joint in account.scene.joints],
        "payload_kg": account.scene.payload,
        **({"base_stiffness_Nm_rad": base} if base is not None else {}),
        "flexible_parts": [len(section.parts) for section in sections],
        "bending_per_part": [section.bending for section in sections],
        "split_at_m": [[split.x for split in section.splits] for section in sections],
        "section_unknowns": [section.unknowns for section in sections],
        "joint_unknowns": [joint.unknowns for joint in joints],
        "clearance_pins": [pin.at for pin in account.pins],
        "unknowns": account.unknowns,
        "stroke_low_m": [joint.stroke_low for joint in joints],
        "stroke_high_m": [joint.stroke_high for joint in joints],
        "lever_least_m": [joint.lever[0] for joint in joints],
        "lever_greatest_m": [joint.lever[1] for joint in joints],
        "transmission_least_deg": [joint.transmission_deg for joint in joints],
        "oil_stiffness_N_m": [list(joint.k_over_stroke) for joint in joints],
        "left_out": [f"{key}: {meaning}" for key, meaning in account.left_out.items()],
        "warnings": [*map(str, warnings)],
        "notes": [*map(str, notes)],
    }


def report(name: str, scene: Scene, account: Account, warnings: Sequence[Fault], notes: Sequence[Fault]) -> list[str]:
    kinds = " + ".join(joint.kind for joint in scene.joints)
    lines = [f"{name}: this scene can be used"]
    lines += [f"  {scene.description}"] if scene.description else []
    lines += [f"  {several(len(account.sections), 'section')}, {kinds}, {scene.reach:.2f} m, {account.mass:.1f} kg"]
    lines += _base(scene.base)
    lines += ["", "Masses, kg (links, barrel and rod: of the joint that turns the section)", *_masses(account)]
    sections = [[f"section {section.number}", _section_words(section)] for section in account.sections]
    lines += ["", "Sections", *_table(sections, left=2)]
    lines += ["", "Joints and cylinders", *_cylinders(account)]
    lines += ["", "Joints over their range: lever of the cylinder, angle of the links"]
    lines += _linkages(account)
    if any(joint.k_over_stroke for joint in account.joints):
        lines += ["", "Stiffness of the oil over the stroke, kN/mm", *_over_stroke(account)]
    if scene.clearance is not None and account.pins:
        pins = [[pin.at, f"{1e3 * pin.pin_radius:g}", f"{1e3 * pin.radial_clearance:g}"] for pin in account.pins]
        lines += ["", _clearance_title(scene.clearance), *_table([["", "pin radius mm", "radial clearance mm"], *pins])]
    left_out = _table([*map(list, account.left_out.items())], left=2)
    lines += ["", "Left out of the model (absent from the scene, zero or false)", *left_out]
    lines += ["", f"Unknowns per step: {account.unknowns}", *_unknowns(account)]
    lines += ["", *(f"Note: {note}" for note in notes)]
    lines += [f"Warnings: {len(warnings) or 'none'}", *(f"  {warning}" for warning in warnings)]
    return lines


def _base(base: Base) -> list[str]:
    if base.stiffness is None:
        return []
    damping = f"{base.damping / 1e3:.4g} kN m s/rad" if base.damping else "no damping"
    return [f"  elastic base: {base.stiffness / 1e6:.4g} MN m/rad about the pivot of joint 1, {damping}"]


def _masses(account: Account) -> list[str]:
    rows = [["", "length m", "beam", "root", "head", "line fill", "links", "barrel", "rod", "sum"]]
    for section, joint in zip(account.sections, account.joints, strict=True):
        part, drive = section.section, joint.joint
        ends = [end.mass if end is not None else 0.0 for end in (part.root, part.head)]
        rods = [rod.mass if rod is not None else 0.0 for rod in (drive.cylinder.barrel, drive.cylinder.rod)]
        own = [part.beam_mass, *ends, section.fill_mass, (drive.mL or 0.0) + (drive.mR or 0.0), *rods]
        masses = [f"{mass:.1f}" if mass else "-" for mass in own]
        rows.append([f"section {section.number}", f"{part.length:.2f}", *masses, f"{sum(own):.1f}"])
    if account.scene.payload:
        rows.append(["payload", *[""] * 8, f"{account.scene.payload:.1f}"])
    rows.append(["total", f"{account.scene.reach:.2f}", *[""] * 7, f"{account.mass:.1f}"])
    return _table(rows)


def _section_words(section: SectionAccount) -> str:
    if not section.parts and section.section.beam is not None:
        return "rigid (modes: 0), with the mass of its beam"
    if not section.parts:
        return "rigid (no beam), all of it described by root"
    x0, x1 = section.parts[0][0], section.parts[-1][1]
    coordinates = f"{section.bending} bending + {section.axial} axial coordinates"
    words = f"flexible from {x0:g} to {x1:g} m"
    if section.splits:
        words += ", split " + " and ".join(f"at {split.x:g} m by the {split.pin}" for split in section.splits)
    if len(section.parts) > len(section.splits) + 1:
        words += f", cut evenly so that at least {LEAST_PARTS} parts bend"
    parts = f"{len(section.parts)} parts with {coordinates} each" if len(section.parts) > 1 else coordinates
    return f"{words}: {parts}"


def _cylinders(account: Account) -> list[str]:
    rows = [["", "kind", "range deg", "stroke used m", "of m", "oil spring"]]
    for joint in account.joints:
        low, high = joint.joint.range_deg
        used = f"{joint.stroke_low:.3f} to {joint.stroke_high:.3f}"
        reach = [f"{low:g} to {high:g}", used, f"{joint.joint.cylinder.max_stroke:g}"]
        kind = f"{joint.joint.kind}, right" if joint.joint.side == "right" else joint.joint.kind
        rows.append([f"joint {joint.number}", kind, *reach, _oil(joint)])
    return _table(rows, left=6)


def _oil(joint: JointAccount) -> str:
    k, d = joint.joint.cylinder.k, joint.joint.cylinder.d
    damping = f"d = {d / 1e3:.4g} kN s/m" if d else "no damping"
    if joint.k_over_stroke:
        return f"by the oil over the stroke, {damping}"
    return "incompressible" if k is None else f"k = {k / 1e6:.4g} kN/mm, {damping}"


def _linkages(account: Account) -> list[str]:
    rows = [["", "lever m", "links meet at"]]
    for joint in account.joints:
        links = "-" if joint.transmission_deg is None else f"{joint.transmission_deg:.0f} deg at least"
        rows.append([f"joint {joint.number}", f"{joint.lever[0]:.3f} to {joint.lever[1]:.3f}", links])
    return _table(rows, left=3)


def _over_stroke(account: Account) -> list[str]:
    rows = [["of the full stroke", *(f"{share:.0%}" for share in STATIONS)]]
    for joint in account.joints:
        if joint.k_over_stroke:
            rows.append([f"cylinder {joint.number}", *(f"{k / 1e6:.4g}" for k in joint.k_over_stroke)])
    return _table(rows)


def _clearance_title(clearance: Clearance) -> str:
    law = clearance.contact
    given = f"restitution {law.restitution:g} (it really gives {law.given_restitution:.3f})"
    words = f"{law.law} contact, {given}, friction {law.friction:g}"
    linear = ", linearised at the preload" if clearance.treatment == "spring-damper" else ""
    return f"Pins with clearance ({words}{linear})"


def _unknowns(account: Account) -> list[str]:
    """Return the unknowns by kind: of a joint 2 (A) or 6, of a section those of its beam, of a pin the journal's offset."""
    rows = [("joints", [joint.unknowns for joint in account.joints])]
    rows += [("sections", [section.unknowns for section in account.sections])]
    rows += [("base", [UNKNOWNS_BASE])] if account.scene.base.stiffness is not None else []
    rows += [("pins with clearance", [UNKNOWNS_PIN] * len(account.pins))] if account.pins else []
    return _table([[name, str(sum(counts)), " + ".join(map(str, counts))] for name, counts in rows], left=3)


def _table(rows: list[list[str]], left: int = 1) -> list[str]:
    """Return indented columns. The first `left` are left-aligned, the others right-aligned."""
    return [f"  {line}" for line in columns(rows, range(left))] if rows else []


def _accuracy(
    scene: Scene, sensors: Sequence[tuple[str, Stream, Mapping[str, Place]]], drive: str
) -> tuple[dict[str, Any], list[str]]:
    """Return the accuracy at every posture with every selection of `sensors`, as values for ``--json`` and as lines."""
    from ..config.settings import Settings
    from ..deviation.accuracy import accuracy_at

    reads = StrokeReading.ANGLE if drive == "angles" else StrokeReading.LENGTH
    exact = Settings(scene_error=0.0)  # its part is the same with all sensors
    values: dict[str, Any] = {}
    sets = {
        ",".join(name for name, *_ in chosen) or f"{drive} only": chosen
        for count in range(len(sensors) + 1)
        for chosen in combinations(sensors, count)
    }
    acting = "an unknown load of 0.25 % of the boom's weight comes and goes at the tip"
    lines = ["", f"Accuracy of the estimate at rest, while {acting} (standard deviations, scene exact)"]
    titles = f"{'tip x, y mm':>16} {'pitch mrad':>11} {'acceleration':>13} {'load N':>14}"
    lines.append(f"  {'posture':12} {f'sensors beside {drive}':24} {titles}")
    for posture in scene.postures:
        for name, chosen in sets.items():
            try:
                streams, places = [stream for _, stream, _ in chosen], {k: v for *_, own in chosen for k, v in own.items()}
                drives = strokes_of_posture(scene, posture)
                result = accuracy_at(scene, drives, streams, exact, reads=reads, places=places)
            except BoomTwinError as error:
                lines.append(f"  {posture:12} {name:24} {error}")
                continue
            values[f"accuracy_{posture}:{name}"] = [*result.tip, *result.acceleration, *result.load]
            lines.append(f"  {posture:12} {name:24} {_accuracy_row(result)}")
            if not streams:
                usual = Settings()
                both = accuracy_at(scene, drives, streams, usual, reads=reads, places=places).tip
                added = [float(each) for each in (both**2 - result.tip**2) ** 0.5]
                values[f"scene_error_{posture}"] = added
                x, y, pitch = (1e3 * each for each in added)
                lines.append(
                    f"  {'':12} {f'a scene {usual.scene_error:.0%} wrong adds':24} {f'{x:.2f}, {y:.2f}':>16} {pitch:11.2f}"
                )
    return values, lines


def _accuracy_row(result: TipAccuracy) -> str:
    x, y, pitch = 1e3 * result.tip
    acceleration = float((result.acceleration**2).sum() ** 0.5)
    load = f"{result.load[0]:.0f}, {result.load[1]:.0f}"
    return f"{f'{x:.2f}, {y:.2f}':>16} {pitch:11.2f} {acceleration:7.3f} m/s² {load:>14}"
