"""Every way to extend the package, added from outside as ``docs/extending.md`` shows it."""

from __future__ import annotations

import subprocess
import sys

import pytest
from extending.worked_example import ROOT, WorkedExample

DOCUMENT = ROOT / "docs" / "extending.md"

MOST_FILES = {"command": 2, "output_topic": 3, "contact_law": 2, "fault": 1, "sensor_channel": 4, "element": 7}
"""Files of the package that each kind of thing may touch."""

UNCOMPILED = ("contact_law", "element")
"""Examples that change kernels, which would be compiled anew for most of a minute."""


@pytest.mark.parametrize("name", MOST_FILES)
def test_few_files_are_touched(name):
    touched = WorkedExample(name).touched
    assert 0 < len(touched) <= MOST_FILES[name], touched


@pytest.mark.parametrize("name", MOST_FILES)
def test_the_document_shows_what_is_applied(name):
    text, example = DOCUMENT.read_text(), WorkedExample(name)
    if example.patch:
        assert f"```diff\n{example.patch}```\n" in text
    for path, content in example.new_files.items():
        assert f"`{path}`:\n\n```{'python' if path.endswith('.py') else 'yaml'}\n{content}```\n" in text


@pytest.mark.parametrize("name", MOST_FILES)
def test_it_works(name, tmp_path):
    example = WorkedExample(name)
    example.apply(tmp_path)
    rules = ["--config", str(ROOT / "pyproject.toml"), "--quiet"]
    subprocess.run([sys.executable, "-m", "ruff", "check", *rules, str(tmp_path)], check=True)
    example.check(tmp_path, **({"NUMBA_DISABLE_JIT": "1"} if name in UNCOMPILED else {}))
