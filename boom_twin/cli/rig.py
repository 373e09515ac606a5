"""``boom_twin rig``: a synthetic session of the virtual rig, an independent model in Exudyn."""

from __future__ import annotations

from argparse import Action, ArgumentParser, Namespace
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any, NoReturn

from .. import __version__
from ..errors import UsageError
from ..scene.schema import Scene
from ..types import SENSORS as KINDS
from ..types import Place, Stream, StrokeReading
from .arguments import SENSOR_LIST, add_scene, files_of, positive, sensors_of
from .output import tell, tell_oddities


def add_arguments(parser: ArgumentParser) -> None:
    add_scene(parser)
    parser.add_argument("--out", required=True, metavar="DIR", help="folder for the bag and its truth, new or empty")
    moves = parser.add_mutually_exclusive_group()
    moves.add_argument("--random", metavar="POSTURE", help="random moves from this posture (default: the bundled ones)")
    through = "moves through named postures, as arch,low,arch, with rest periods in each; one posture: the boom stands still"
    moves.add_argument("--through", metavar="POSTURES", help=through)
    acceleration = "of --through: largest acceleration of the undeformed boom's tip, m/s^2 (0.5)"
    parser.add_argument("--tip-acceleration", type=positive, default=0.5, metavar="A", help=acceleration)
    parser.add_argument("--duration", type=positive, metavar="S", help="duration, s (default 60)")
    parser.add_argument("--seed", type=int, default=0, help="seed of moves and sensor noise (default 0)")
    share = "relative standard deviation of every k, d, EI and mass of the rig: 0.02 is 2 %% (default 0)"
    parser.add_argument("--wrong", type=float, default=0.0, metavar="SHARE", help=share)
    parser.add_argument("--rig-seed", type=int, default=0, metavar="N", help="seed of --wrong (default 0)")
    fault = (
        "a fault, for instance cylinder_2.k:softer:0.3 or joint_3.sensor:bias:0.0035@20 (SI units); @20+5..40: from 20 s on, "
        "over 5 s, until 40 s; may be repeated"
    )
    parser.add_argument("--list-faults", action=ListFaults, nargs=0, help="print all faults with their sizes, and exit")
    parser.add_argument("--fault", action="append", default=[], metavar="CAUSE:KIND[:SIZE][@ONSET[+RAMP][..END]]", help=fault)
    load = (
        "a load at the tip that no twin knows of: pump:FREQUENCY:HEIGHT[:CHANGE_OVER] (Hz, N, s; pulses, upward) or "
        "wind:DEVIATION[:TIME_SCALE] (N, s; gusts, horizontal), with @ONSET (s), for instance pump:0.43:130; may be repeated"
    )
    parser.add_argument("--load", action="append", default=[], metavar="KIND:NUMBERS[@ONSET]", help=load)
    sensors = f"what is recorded beside strokes, default angles,imu: {SENSOR_LIST}"
    parser.add_argument("--sensors", default="angles,imu", metavar="LIST", help=sensors)
    pressure = "pressures of both sides of every cylinder; bore and rod (m) of all, or, without a value, as in the scene's oil"
    parser.add_argument("--pressures", nargs="?", const="", metavar="BORE:ROD", help=pressure)
    parser.add_argument("--rate", type=float, metavar="HZ", help="rate of all sensors, 50 to 1000 (default 200)")


class ListFaults(Action):
    """Action that prints the faults and ends, whatever else is given."""

    def __call__(self, parser: ArgumentParser, *_: object) -> NoReturn:
        from ..validation.rig.faults import listing

        print("\n".join(listing()))
        parser.exit()


def _refuse_unrecorded(causes: list[str], given: str, recorded: set[Stream]) -> None:
    for cause in causes:
        for stem, name, stream in (("joint_", "angles", Stream.ANGLES), ("cylinder_force_", "forces", Stream.FORCES)):
            if cause.startswith(stem) and stream not in recorded:
                raise UsageError(f"fault {cause}: {name} are not recorded. Give --sensors {given},{name}.")


def _mapping_text(places: Mapping[str, Place], cylinders: Sequence[tuple[float, float]]) -> str | None:
    """Return the mapping that places these sensors; None without any."""
    from ..config.yaml_text import whole_text

    if not (places or cylinders):
        return None
    blocks: dict[str, dict[str, Any]] = {"inputs": {}, "sensors": {}}
    for name, place in places.items():
        blocks["sensors" if name.startswith("moment_") else "inputs"][name] = {"place": asdict(place)}
    if cylinders:
        bore, rod = map(list, zip(*cylinders, strict=True))
        blocks["inputs"]["cylinder_pressures"] = {"bore": bore, "rod": rod}
    return whole_text({name: block for name, block in blocks.items() if block})


def _cylinders(text: str | None, scene: Scene) -> list[tuple[float, float]]:
    """Return bore and rod (m) of every cylinder whose pressures are recorded; UsageError if they are not known."""
    if text is None:
        return []
    if not text:
        found = [(oil.bore, oil.rod) for joint in scene.joints if (oil := joint.cylinder.oil) is not None]
        if len(found) < len(scene.joints):
            raise UsageError("--pressures: not every cylinder of the scene has `oil: {bore, rod, ..}`. Give BORE:ROD.")
        return found
    bore, _, rod = text.partition(":")
    try:
        one = float(bore), float(rod)
    except ValueError:
        one = 0.0, 0.0
    if not 0.0 < one[1] < one[0] <= 1.0:
        raise UsageError(f"--pressures {text}: write BORE:ROD, in m, the rod thinner than the bore.")
    return [one] * len(scene.joints)


def run(args: Namespace) -> int:
    from ..bag.session_model import RIG_ORIGIN, SessionMetadata, scene_from
    from ..bag.session_writer import samples_in_rows, write_samples
    from ..offline.ground_truth import FILE_NAME
    from ..system.result_folder import RIG, result_folder
    from ..validation.rig import BUNDLED_DURATION, Sensors, bundled, faults, random_programme, through_postures
    from ..validation.rig import record as record_session
    from ..validation.rig.motion import check_loads, parse_load, tip_load

    assumed, out = scene_from(args.scene), Path(args.out)
    tell_oddities(assumed.oddities, assumed.source)
    scene = assumed.scene
    duration = BUNDLED_DURATION if args.duration is None else args.duration
    chosen = sensors_of(args.sensors, scene)
    recorded = {stream for _, stream, _ in chosen}
    places = {name: place for *_, own in chosen for name, place in own.items()}
    sensors = Sensors() if args.rate is None else Sensors(args.rate)
    cylinders = _cylinders(args.pressures, scene)
    if cylinders and Stream.FORCES in recorded:
        raise UsageError("--pressures: pressures give the forces of cylinders. Leave forces out of --sensors.")
    wrong = [faults.parse(text) for text in args.fault]
    faults.check(wrong, scene, duration)
    _refuse_unrecorded([fault.cause for fault in wrong], args.sensors, recorded)
    boom, changes = faults.changes(faults.wrong_by(scene, args.wrong, args.rig_seed), wrong)
    pushing = [parse_load(text) for text in args.load]
    check_loads(pushing, duration)
    load = tip_load(scene, pushing, duration, args.seed) if pushing else None
    if args.through:
        programme = through_postures(scene, args.through.split(","), duration, args.tip_acceleration)
    else:
        programme = random_programme(scene, args.random, duration, args.seed) if args.random else bundled(scene)
    drive = faults.drifting(programme, wrong)
    notes = {"origin": RIG_ORIGIN, "noise": "standard", "seed": str(args.seed)}
    if args.wrong:
        notes["wrong"] = f"k, d, EI and masses off by {args.wrong:g}, rig seed {args.rig_seed}"
    if wrong:
        notes["faults"] = ", ".join(map(str, wrong))
    if pushing:
        notes["loads"] = f"at the tip, wind seed {args.seed}: " + ", ".join(map(str, pushing))
    if args.rate is not None:
        notes["rate"] = f"{args.rate:g} Hz"
    if Stream.FORCES in recorded:
        notes["forces"] = f"noise {sensors.force_sigma:g} N, resolution {sensors.force_resolution:g} N"
    with result_folder(out, RIG, files_of(args, "scene")) as building:
        tell(f"simulating {duration:g} s, about as long as that ..")
        session = record_session(
            boom, drive, duration, sensors, args.seed, load=load, changes=changes, places=places, cylinders=cylinders
        )
        session = faults.spoil(session, wrong, args.seed)
        readings = {Stream.STROKES: session.strokes, Stream.ANGLES: session.joints, Stream.IMU: session.imu}
        readings |= {Stream.FORCES: session.forces, **session.placed}
        wanted = {Stream.STROKES, Stream.PRESSURES, *recorded, *(Stream(KINDS[each].beside or each) for each in recorded)}
        there = {stream: rows for stream, rows in readings.items() if stream in wanted}
        write_samples(building, samples_in_rows(session.stamps, there, session.angle_stamps), there, notes)
        # the scene that a twin assumes, not the simulated boom
        own = _mapping_text(places, cylinders)
        metadata = SessionMetadata(__version__, assumed.text, mapping=own, origin=RIG_ORIGIN, strokes=StrokeReading.LENGTH)
        metadata.write(building)
        session.save_truth(building / FILE_NAME)
    print(out)
    return 0
