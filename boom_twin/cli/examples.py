"""Examples that the help of each command ends with."""

from __future__ import annotations

EXAMPLES: dict[str, tuple[str, ...]] = {
    "check": ("check my_boom.yaml", "check my_boom.yaml --need tip=1mm"),
    "info": ("info bags/arch_session", "info session.csv --mapping rig.yaml"),
    "monitor": ("monitor", "monitor --bag bags/arch_session --start 10"),
    "play": ("play bags/arch_session --rate 2 --loop --clock 100",),
    "record": ('record --out bags/today --note "wind 5 m/s"',),
    "recover": ("recover bags/broken --out out/saved",),
    "scene": ("scene", "scene --clearance"),
    "mapping": ("mapping",),
    "views": ("views --namespace front --out out/views",),
    "urdf": ("urdf my_boom.yaml",),
    "statics": ("statics my_boom.yaml --posture arch", "statics --strokes=0.63,0.165,0.235,0.187 --json"),
    "response": ("response my_boom.yaml --posture arch", "response --posture arch --pump 0.4:130"),
    "envelope": ("envelope my_boom.yaml --out out/envelope",),
    "init": ("init --example-table > boom_table.yaml", "init --table boom_table.yaml --out my_boom.yaml"),
    "simulate": (
        "simulate my_boom.yaml --drive examples/strokes.csv --out motion.csv",
        "simulate --drive examples/strokes.csv --out spread.csv --samples 100 --vary cylinder_2.k=0.1",
    ),
    "replay": (
        "replay bags/arch_session --out out/replay --report",
        "replay bags/arch_session --out out/numbers --no-bag --no-pictures --table csv",
        "replay session.csv --scene my_boom.yaml --out out/replay --start 10 --duration 20 --table csv",
    ),
    "calibrate": ("calibrate bags/today bags/tomorrow --out calibrated.yaml",),
    "batch": ("batch 'bags/*' --out out/batch",),
    "compare": ("compare bags/before bags/after --out out/compare",),
    "study": ("study error --out out/study/error",),
    "rig": ("rig --out out/soft --fault cylinder_2.k:softer:0.3", "rig --list-faults"),
}
"""Arguments of `boom_twin` by command."""


def epilog_of(command: str) -> str:
    """Return the lines below the options; none for a command without examples."""
    lines = [f"  boom_twin {example}" for example in EXAMPLES.get(command, ())]
    return "\n".join(["examples:", *lines]) if lines else ""
