"""What a boom does not have costs it nothing: the same boom in a copy of the package from which that code is cut out.

``python test/bench/cut_out.py`` prints the time of a step with the code over that without it: 1 within noise.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

import boom_twin

RUNS = 30
PACKAGE = Path(boom_twin.__file__).parent
PLACE = "kernels/transfer/forward_kinematics.py"
LINKS = "range(joint.first_link, joint.first_link + joint.links)"
# kind: file: what is cut out of its text, which must be there
CUTS = {
    "beams": {PLACE: ("if kind == BEAM", "if False"), "kernels/transfer/riccati_sweep.py": ("if kind == BEAM", "if False")},
    "link masses": {PLACE: (LINKS, "range(0)"), "kernels/transfer/six_bar.py": (LINKS, "range(0)")},
    "barrels, rods": {"kernels/elements/cylinder.py": ("range(row.first_part, row.first_part + row.parts)", "range(0)")},
}
WORKER = """
import sys
from boom_twin.analysis.methods import integrate_with
from boom_twin.scene import load_scene
from boom_twin.analysis.motions import motion_of
from boom_twin.reduction.variants import KINDS, without
scene = load_scene()
motion = motion_of(scene)
for kind in KINDS:
    if kind.name in ("bending", "link masses", "barrel masses", "rod masses"):
        scene = without(scene, kind, range(4)).of(scene)
for _ in sys.stdin:
    run = integrate_with(scene, motion, 0.5, 1e-3, every=500, angles=motion.angles)
    print(run.seconds, run.tip[-1, 0].hex(), run.tip[-1, 1].hex(), run.status, flush=True)
"""


def cut_out(folder: Path, kind: str) -> Path:
    """A copy of the package without the code of a kind of part."""
    shutil.copytree(PACKAGE, folder / "boom_twin", ignore=shutil.ignore_patterns("__pycache__"))
    for name, (old, new) in CUTS[kind].items():
        path = folder / "boom_twin" / name
        text = path.read_text(encoding="utf-8")
        assert old in text, f"{name} has no {old!r}: bring the cut up to date"
        path.write_text(text.replace(old, new), encoding="utf-8")
    return folder


class Machinery:
    """A process that steps the boom without beams and masses with one state of the package."""

    def __init__(self, folder: Path, cache: Path | None = None) -> None:
        command, place = [sys.executable, "-c", WORKER], {} if cache is None else {"XDG_CACHE_HOME": str(cache)}
        environment = {key: value for key, value in os.environ.items() if key != "PYTHONPATH"} | place
        self.process = subprocess.Popen(
            command, cwd=folder, env=environment, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        )

    def step(self) -> tuple[float, list[str]]:
        """Seconds of stepping, and the words that must not differ."""
        assert self.process.stdin is not None and self.process.stdout is not None
        self.process.stdin.write("go\n")
        self.process.stdin.flush()
        seconds, *words = self.process.stdout.readline().split()
        return float(seconds), words

    def close(self) -> None:
        self.process.communicate()


def ratio(folder: Path, cache: Path) -> float:
    """Time of a step with the code over that without, least of interleaved runs of two new processes."""
    bare, whole = Machinery(folder, cache), Machinery(PACKAGE.parent)
    try:
        times = np.min([[machinery.step()[0] for machinery in (bare, whole)] for _ in range(RUNS)], axis=0)
    finally:
        bare.close()
        whole.close()
    return float(times[1] / times[0])


def main() -> None:
    """Print a line for every kind of part."""
    for kind in CUTS:
        with tempfile.TemporaryDirectory() as place:
            print(f"{kind}: {ratio(cut_out(Path(place), kind), Path(place) / 'cache'):.3f}", flush=True)


if __name__ == "__main__":
    main()
