"""The reference models know scenes and errors of the package, and none of its equations."""

from __future__ import annotations

import re
from pathlib import Path

KNOWN = {"scene.schema"}
NAMES = {"Scene", "SolverError"}


def test_reference_models_import_no_equation_of_the_twin() -> None:
    modules = list(Path(__file__).parent.glob("*/*.py"))
    text = "\n".join(path.read_text(encoding="utf-8") for path in modules)
    assert len(modules) > 8 and set(re.findall(r"^\s*(?:from|import) boom_twin\.([\w.]+)", text, re.MULTILINE)) == KNOWN
    assert set(re.findall(r"\w+", " ".join(re.findall(r"^\s*from boom_twin import (.+)", text, re.MULTILINE)))) == NAMES
