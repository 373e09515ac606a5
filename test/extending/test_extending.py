"""Every way to extend the package, added from outside; ``docs/extending.md`` names the files of each."""

from __future__ import annotations

import re
import subprocess
import sys

import pytest
from extending.worked_example import ROOT, WorkedExample

DOCUMENT = ROOT / "docs" / "extending.md"

MOST_FILES = {"command": 2, "output_topic": 3, "contact_law": 1, "fault": 1, "sensor_channel": 3, "element": 6}
"""Files of the package that each kind of thing may touch."""

UNCOMPILED = ("contact_law", "element")
"""Examples that change kernels, which would be compiled anew for most of a minute."""


@pytest.mark.parametrize("name", MOST_FILES)
def test_few_files_are_touched(name):
    touched = WorkedExample(name).touched
    assert 0 < len(touched) <= MOST_FILES[name], touched


@pytest.mark.parametrize("name", MOST_FILES)
def test_the_page_names_the_files_that_are_touched(name):
    (files,) = re.findall(rf"^\| .* \| `{name}` \| (.*) \|$", DOCUMENT.read_text(encoding="utf-8"), re.MULTILINE)
    assert sorted(re.findall(r"`(\S+?)`", files)) == WorkedExample(name).touched


@pytest.mark.parametrize("name", MOST_FILES)
def test_it_works(name, tmp_path):
    example = WorkedExample(name)
    example.apply(tmp_path)
    rules = ["--config", str(ROOT / "pyproject.toml"), "--quiet"]
    subprocess.run([sys.executable, "-m", "ruff", "check", *rules, str(tmp_path)], check=True)
    example.check(tmp_path, **({"NUMBA_DISABLE_JIT": "1"} if name in UNCOMPILED else {}))
