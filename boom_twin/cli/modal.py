"""``boom_twin modal``: natural frequencies, damping and mode shapes of a recorded session."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .arguments import add_json, add_session, files_of, window_of
from .output import open_session_scene, open_session_settings, print_result, tell

if TYPE_CHECKING:
    from ..report.operational_modes import MeasuredRest


def add_arguments(parser: ArgumentParser) -> None:
    parser.add_argument("bag", metavar="BAG", help="session with rest of at least 20 s, better 2 minutes")
    place = "folder for modes.json and stabilisation diagrams, new or empty"
    parser.add_argument("--out", required=True, metavar="DIR", help=place)
    add_session(parser)
    add_json(parser)


def run(args: Namespace) -> int:
    import json

    import numpy as np

    from ..calibration.run import rigged_sessions
    from ..plots.results import stabilisation_picture
    from ..report.operational_modes import measured_rests
    from ..system.files import write_atomic
    from ..system.result_folder import MODAL, result_folder

    bag, out = Path(args.bag), Path(args.out)
    scene, settings = open_session_scene(bag, args.scene).scene, open_session_settings(bag, args.params, args.namespace)
    with result_folder(out, MODAL, files_of(args, "bag", "scene", "params", "mapping")) as building:
        tell("reading the session ..")
        _, rigging, (session,) = rigged_sessions([bag], scene, settings, args.mapping, args.namespace, window_of(args))
        tell("identifying modes ..")
        rests = measured_rests(session, scene, rigging)
        files = ["modes.json"]
        for number, rest in enumerate(rests, 1):
            files.append(f"rest_{number}.png")
            title = f"{session.name}, rest period {rest.start:.1f} to {rest.stop:.1f} s"
            found = np.array([(each["frequency_Hz"], each["frequency_sigma_Hz"]) for each in rest.modes]).reshape(-1, 2)
            stabilisation_picture(building / files[-1], title, rest.poles, found, rest.model)
        content = [
            {"start_s": rest.start, "stop_s": rest.stop, "model_Hz": rest.model.tolist(), "modes": rest.modes} for rest in rests
        ]
        write_atomic(building / "modes.json", json.dumps(content, indent=2) + "\n")
    print_result(args.json, _flat(rests), [*_as_text(rests), *(str(out / name) for name in files)])
    return 0


def _flat(rests: list[MeasuredRest]) -> dict[str, Any]:
    """Return the modes of all rest periods as lists of equal length, without their shapes."""
    rows = [(number, mode) for number, rest in enumerate(rests, 1) for mode in rest.modes]
    names = ("frequency_Hz", "frequency_sigma_Hz", "damping_ratio", "damping_ratio_sigma", "model_Hz")
    found: dict[str, Any] = {"rest_start_s": [rest.start for rest in rests], "rest_stop_s": [rest.stop for rest in rests]}
    found["rest"] = [number for number, _ in rows]
    return found | {name: [mode[name] for _, mode in rows] for name in names}


def _as_text(rests: list[MeasuredRest]) -> list[str]:
    lines = []
    for number, rest in enumerate(rests, 1):
        lines.append(f"rest period {number}, {rest.start:.1f} to {rest.stop:.1f} s")
        for each in rest.modes:
            model = "no mode of the model is near" if each["model_Hz"] is None else f"model {each['model_Hz']:.3f} Hz"
            note = ", hardly damped: the line of a pump rather than a mode" if each["is_line_of_a_load"] else ""
            frequency = f"{each['frequency_Hz']:7.3f} +- {each['frequency_sigma_Hz']:.3f} Hz"
            damping = f"damping ratio {100.0 * each['damping_ratio']:5.2f} +- {100.0 * each['damping_ratio_sigma']:.2f} %"
            lines.append(f"  {frequency}, {damping}, {model}{note}")
        if not rest.modes:
            lines.append("  no stable mode: record longer, or under more wind")
    return lines
