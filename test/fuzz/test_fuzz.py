"""Every case of the corpus, and, as a slow test, a minute of new ones."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from .run import ROOT, TARGETS, judged, module
from .verdict import Kind

CORPUS = Path(__file__).parent / "corpus"
CASES = [
    pytest.param(target, path, id=f"{target}-{path.stem}") for target in TARGETS for path in sorted((CORPUS / target).iterdir())
]
SECONDS = 40
"""The workers take some 20 more to start."""


@pytest.mark.parametrize(("target", "path"), CASES)
def test_the_corpus(target: str, path: Path) -> None:
    """What was once a finding, or nearly so; what is cut off is refused, or told."""
    module(target).begin()
    verdict = judged(target, path)
    assert not verdict.is_finding, verdict.words
    if path.name.startswith("cut_"):
        assert verdict.kind in (Kind.REFUSED, Kind.TOLD)


@pytest.mark.slow
def test_a_minute_of_new_cases(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "fuzz.run", "--seconds", str(SECONDS), "--seed", "1", "--out", str(tmp_path / "found")]
    path = {**os.environ, "PYTHONPATH": str(ROOT / "test")}
    done = subprocess.run(command, cwd=tmp_path, env=path, capture_output=True, text=True, timeout=1500)
    assert done.returncode == 0, done.stdout + done.stderr
