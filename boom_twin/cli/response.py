"""``boom_twin response``: frequency response, steady state under a periodic load, resonance map of postures and pump rates."""

from __future__ import annotations

import re
from argparse import ArgumentParser, ArgumentTypeError, Namespace
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..errors import UsageError
from ..loggers.log_table import CsvLogTable, columns_of
from ..scene import Scene
from ..system.result_text import csv_text
from ..types import Array
from .arguments import add_json, add_place, add_scene, files_of, numbers
from .output import open_scene, print_result, warn

if TYPE_CHECKING:
    from ..analysis.frequency_response import FrequencyResponse

NO_MODES = "natural frequencies: none: nothing in this model can vibrate"
Flags = NDArray[np.bool_]
LOW, HIGH, POINTS, RATES = 0.05, 30.0, 300, (0.2, 1.2, 201)


@dataclass(frozen=True)
class Answer:
    """Result of one run of the command: keys of the JSON, lines for people, columns of the CSV, drawing function, warnings."""

    name: str
    values: dict[str, Any]
    lines: list[str]
    columns: dict[str, Array]
    draw: Callable[[Path], None]
    doubts: tuple[str, ...] = ()


def add_arguments(parser: ArgumentParser) -> None:
    add_scene(parser)
    swept = (
        "resonance map over these postures (angles in brackets), or `all` of the scene's; needs --pump, whose rate it varies"
    )
    add_place(parser).add_argument("--map", metavar="P1,P2,..", help=swept)
    load = parser.add_mutually_exclusive_group()
    load.add_argument("--tip", type=numbers, metavar="FX,FY", help="harmonic force at the tip, N (default 0,1)")
    load.add_argument("--drive", type=int, metavar="CYLINDER", help="harmonic drive of this cylinder, amplitude 1 m")
    pump = "steady state under pump pulses: rate (Hz), height (N), change-over (s, default 0.1); vertical, up"
    load.add_argument("--pump", type=_pump, metavar="RATE:HEIGHT[:S]", help=pump)
    load.add_argument("--load", metavar="CSV", help="steady state under this force at the tip: t_s,fx_N,fy_N, one period")
    parser.add_argument("--from", dest="low", type=float, default=LOW, metavar="F", help="lowest frequency, Hz (default 0.05)")
    parser.add_argument("--to", dest="high", type=float, default=HIGH, metavar="F", help="highest frequency, Hz (default 30)")
    parser.add_argument("--rates", type=_rates, default=RATES, metavar="F:F:N", help="rates of a map, Hz (default 0.2:1.2:201)")
    parser.add_argument("--out", metavar="DIR", help="folder for table and picture: new, empty, or of an earlier response")
    add_json(parser)


def _pump(text: str) -> tuple[float, ...]:
    try:
        result = tuple(float(part) for part in text.split(":"))
    except ValueError:
        result = ()
    if len(result) not in (2, 3):
        raise ArgumentTypeError(f"{text!r} is not RATE:HEIGHT or RATE:HEIGHT:CHANGE_OVER, like 0.4:130")
    return result


def _rates(text: str) -> tuple[float, float, int]:
    try:
        low, high, count = text.split(":")
        result = float(low), float(high), int(count)
    except ValueError:
        raise ArgumentTypeError(f"{text!r} is not LOWEST:HIGHEST:COUNT, like 0.2:1.2:201") from None
    if not 0.0 < result[0] < result[1] < float("inf") or not 2 <= result[2] <= 10_000:
        raise ArgumentTypeError(f"{text!r}: give two ascending rates above 0 Hz, and 2 to 10000 of them")
    return result


def run(args: Namespace) -> int:
    from ..analysis.equilibrium import statics
    from ..system.files import write_atomic
    from ..system.result_folder import RESPONSE, result_folder

    scene = open_scene(args.scene)
    is_map = args.map is not None
    for option, is_given in (("--from", args.low != LOW), ("--to", args.high != HIGH)):
        if is_given and (is_map or args.pump or args.load):
            raise UsageError(f"{option}: goes with a frequency response, not with --pump, --load or --map. Leave it out.")
    if args.rates != RATES and not is_map:
        raise UsageError("--rates: goes with --map. Leave it out.")
    args.strokes = args.strokes if args.lengths is None else statics(scene, lengths=args.lengths).strokes
    if is_map:
        answer = _map(scene, args)
    elif args.pump or args.load:
        answer = _steady(scene, args)
    else:
        answer = _response(scene, args)
    for doubt in answer.doubts:
        warn(f"{doubt}.")
    if args.out:
        with result_folder(Path(args.out), RESPONSE, files_of(args, "scene", "load")) as building:
            write_atomic(building / f"{answer.name}.csv", csv_text(answer.columns))
            answer.draw(building / f"{answer.name}.png")
        answer.lines.append(f"Written: {args.out}")
    print_result(args.json, answer.values | {"warnings": answer.doubts}, answer.lines)
    return 0


def _place(args: Namespace) -> str:
    return f"posture {args.posture}" if args.posture else "strokes " + ", ".join(f"{s:g}" for s in args.strokes) + " m"


def _response(scene: Scene, args: Namespace) -> Answer:
    """Return the frequency response at logarithmically even points, and at the natural frequencies among them."""
    from ..analysis.equilibrium import statics
    from ..analysis.frequency_response import UPWARD, frequency_response, with_all_shapes
    from ..plots.analysis import response_picture

    modes_sought = 40  # natural frequencies that are looked for within the band
    beside, sharp = 1.0 + 1e-6, 3.0  # undamped: at `beside` times the frequency, the peak is lower by the factor `sharp`

    if not 0.0 < args.low < args.high < float("inf"):
        raise UsageError(f"--from {args.low:g} --to {args.high:g}: both must be above 0 Hz. Give the lower one first.")
    rest = statics(with_all_shapes(scene), strokes=args.strokes, posture=args.posture, modes=modes_sought)
    natural = rest.frequencies[(rest.frequencies > args.low) & (rest.frequencies < args.high)]
    force = None if args.drive is not None else tuple(args.tip or UPWARD)
    place = args.strokes, args.posture, force, args.drive
    peak, flank = (frequency_response(scene, frequencies, *place).tip for frequencies in (natural, beside * natural))
    bounded = np.linalg.norm(peak, axis=1) < sharp * np.linalg.norm(flank, axis=1)
    frequencies = np.unique(np.concatenate([np.geomspace(args.low, args.high, POINTS), natural[bounded]]))
    result = frequency_response(scene, frequencies, *place)
    static = frequency_response(scene, np.zeros(1), *place)
    if force is None:
        load, unit = f"drive of cylinder {args.drive}, 1 m", "m of stroke"
    else:
        load, unit = f"force at the tip ({force[0]:g}, {force[1]:g}) N", f"load of ({force[0]:g}, {force[1]:g}) N"
    title = f"Frequency response: {load}, {_place(args)}"
    doubts = rest.doubts
    if not bounded.all():
        undamped = ", ".join(f"{frequency:.4f}" for frequency in natural[~bounded])
        no_bound = "there the answer has no bound, and is left out. Give the scene beta and d"
        doubts += (f"nothing damps the resonances at {undamped} Hz: {no_bound}",)
    channels = result.channels()
    values: dict[str, Any] = {"load": load, "frequency_Hz": frequencies, "natural_frequencies_Hz": natural}
    columns = {"frequency_Hz": frequencies}
    for name, column in channels.items():
        columns |= {f"{name}_amplitude": np.abs(column), f"{name}_phase_rad": np.angle(column)}
    return Answer(
        "response",
        values | {name: column for name, column in columns.items() if name != "frequency_Hz"},
        [title, "", *_resonances(result, static, natural, bounded), *([] if len(rest.frequencies) else [NO_MODES])],
        columns,
        lambda path: response_picture(path, title, unit, result, natural),
        doubts,
    )


def _resonances(result: FrequencyResponse, static: FrequencyResponse, natural: Array, bounded: Flags) -> list[str]:
    lines = ["frequency Hz   tip x m     tip y m     acceleration m/s2   largest cylinder force N   largest moment N m"]
    rows = [(0.0, static, 0)] + [(f, result, int(np.searchsorted(result.frequencies, f))) for f in natural[bounded]]
    for frequency, response, k in rows:
        tip, acceleration = np.abs(response.tip[k]), np.linalg.norm(response.tip_acceleration[k])
        forces, moments = np.abs(response.cylinder_forces[k]), np.abs(response.moments[k])
        cylinder, station = int(np.argmax(forces)), int(np.argmax(moments)) if len(moments) else None
        moment = "none" if station is None else f"{moments[station]:.4g}, {response.stations[station].name}"
        lines.append(
            f"{frequency:12.4f}   {tip[0]:.4e}  {tip[1]:.4e}  {acceleration:17.4e}   {forces[cylinder]:12.4g}, cylinder "
            f"{cylinder + 1}   {moment}"
        )
    return lines + [f"{frequency:12.4f}   no bound: nothing damps this mode" for frequency in natural[~bounded]]


def _steady(scene: Scene, args: Namespace) -> Answer:
    from ..analysis.steady_state import load_of_rows, pump_load, steady_state
    from ..plots.analysis import steady_state_picture

    fastest_pump = 2.0  # Hz, of pumps

    if args.pump:
        if args.pump[0] > fastest_pump:
            remedy = f"{args.pump[0]:g} a minute are {args.pump[0] / 60.0:.3g} Hz, and the rate comes first: --pump 0.35:130."
            raise UsageError(
                f"--pump rate = {args.pump[0]:g} Hz: a pump makes at most {fastest_pump:g} strokes a second. {remedy}"
            )
        load, told = pump_load(scene, *args.pump), f"pump pulses of {args.pump[1]:g} N at {args.pump[0]:g} Hz"
    else:
        rows = columns_of(CsvLogTable(Path(args.load)), ("t_s", "fx_N", "fy_N"))
        load = load_of_rows(rows[:, 0], rows[:, 1:])
        told = f"{Path(args.load).name}, {1.0 / load.period:.4g} Hz"
    result = steady_state(scene, load, args.strokes, args.posture)
    title = f"Steady state: {told}, {_place(args)}"
    acceleration = float(np.linalg.norm(result.tip_acceleration, axis=1).max())
    forces = np.ptp(result.cylinder_forces, axis=0)
    values = {
        "load": told,
        "rate_Hz": 1.0 / load.period,
        "tip_peak_to_peak_m": np.ptp(result.tip, axis=0),
        "tip_swing_m": result.swing,
        "tip_mean_m": result.tip.mean(axis=0),
        "tip_acceleration_max_m_s2": acceleration,
        "cylinder_force_peak_to_peak_N": forces,
        "harmonics_m": result.harmonics[:25],
    }
    (x, y), (mean_x, mean_y) = 1e3 * np.ptp(result.tip, axis=0), 1e3 * result.tip.mean(axis=0)
    lines = [
        title,
        "",
        f"tip peak to peak    x {x:.1f} mm, y {y:.1f} mm, {1e3 * result.swing:.1f} mm in the direction in which it is largest",
        f"tip mean            x {mean_x:+.1f} mm, y {mean_y:+.1f} mm from its place at rest",
        f"tip acceleration    {acceleration:.3f} m/s2 at most",
        "cylinder forces     " + ", ".join(f"{force:.0f}" for force in forces) + " N peak to peak",
    ]
    doubts = _large(scene, result.swing)
    return Answer(
        "steady_state", values, lines, result.columns(), lambda path: steady_state_picture(path, title, result), doubts
    )


def _map(scene: Scene, args: Namespace) -> Answer:
    from ..analysis.steady_state import pump_load, resonance_map
    from ..plots.analysis import resonance_picture
    from ..scene.kinematics import posture_angles

    if not args.pump:
        raise UsageError("--map needs --pump RATE:HEIGHT, the pulses whose rate it varies. Add --pump 0.4:130.")
    names = list(scene.postures) if args.map == "all" else re.findall(r"\[[^]]*]|[^,]+", args.map)
    if not names:
        raise UsageError("--map all: the scene names no posture. Add `postures` to it.")
    postures = {name: posture_angles(scene, name) for name in names}
    result = resonance_map(scene, postures, np.linspace(*args.rates), lambda rate: pump_load(scene, rate, *args.pump[1:]))
    title = f"Resonance map: pump pulses of {args.pump[1]:g} N"
    bands = result.to_avoid()
    values = {
        "postures": result.postures,
        "rates_Hz": result.rates,
        "swing_m": result.swing,
        "avoid_posture": [band.posture for band in bands],
        "avoid_from_Hz": [band.low for band in bands],
        "avoid_to_Hz": [band.high for band in bands],
        "avoid_worst_Hz": [band.rate for band in bands],
        "avoid_swing_m": [band.swing for band in bands],
        "avoid_harmonic": [band.harmonic for band in bands],
    }
    width = max(len(name) for name in result.postures)
    lines = [title, "", f"{'posture':{width}}   median mm   avoid Hz      worst Hz   swing mm   by harmonic"]
    for name, swing in zip(result.postures, result.swing, strict=True):
        own = [band for band in bands if band.posture == name]
        lines.append(f"{name:{width}} {1e3 * np.median(swing):11.1f}" + ("" if own else "   none"))
        lines += [
            f"{'':{width}} {'':11}   {band.low:.2f}-{band.high:.2f} {band.rate:13.3f} {1e3 * band.swing:10.0f}   "
            f"{band.harmonic}, at {band.harmonic * band.rate:.2f} Hz"
            for band in own
        ]
    columns = {"rate_Hz": result.rates}
    columns |= {f"swing_m_{name.replace(',', ' ')}": row for name, row in zip(result.postures, result.swing, strict=True)}
    doubts = _large(scene, float(result.swing.max()))
    return Answer("resonance_map", values, lines, columns, lambda path: resonance_picture(path, title, result), doubts)


def _large(scene: Scene, swing: float) -> tuple[str, ...]:
    """Return a warning if the swing is so large that the boom does not respond in proportion."""
    swing_share = 0.05  # of the reach: swings beyond are not in proportion to the load
    if swing > swing_share * scene.reach:
        share = f"more than {swing_share:g} of the reach, beyond which no boom answers in proportion"
        return (f"the largest swing, {swing:.2g} m, is {share}",)
    return ()
