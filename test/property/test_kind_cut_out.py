"""The code of parts that a boom does not have does nothing for it: cut out of a copy of the package, the motion is the same."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import boom_twin

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
from boom_twin.analysis.methods import integrate_with
from boom_twin import load_scene
from boom_twin.analysis.motions import motion_of
from boom_twin.reduction.variants import KINDS, without
scene = load_scene()
motion = motion_of(scene)
for kind in KINDS:
    if kind.name in ("bending", "link masses", "barrel masses", "rod masses"):
        scene = without(scene, kind, range(4)).of(scene)
run = integrate_with(scene, motion, 0.5, 1e-3, every=500, angles=motion.angles)
print(run.tip[-1, 0].hex(), run.tip[-1, 1].hex(), run.status)
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


def tip_moved(folder: Path, cache: Path | None = None) -> str:
    """Where the boom without beams and masses arrives, by the package in `folder`."""
    environment = {key: value for key, value in os.environ.items() if key != "PYTHONPATH"}
    environment |= {} if cache is None else {"XDG_CACHE_HOME": str(cache)}
    command = [sys.executable, "-c", WORKER]
    return subprocess.run(command, cwd=folder, env=environment, check=True, capture_output=True, text=True).stdout


@pytest.mark.slow
@pytest.mark.parametrize("kind", CUTS)
def test_the_code_of_what_is_absent_changes_no_bit(kind: str, tmp_path: Path) -> None:
    assert tip_moved(cut_out(tmp_path, kind), tmp_path / "cache") == tip_moved(PACKAGE.parent)
