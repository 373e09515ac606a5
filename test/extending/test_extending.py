"""Every way to extend the package, added from outside; ``docs/extending.md`` names the files of each."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
EXAMPLES = Path(__file__).parent
DRIVES = ROOT / "test" / "data" / "drives" / "arch_session"
PACKAGE = ("boom_twin", "msg_config")
BEING_WRITTEN = shutil.ignore_patterns("*.pyc.*")  # byte code, by another process
TOUCHED = re.compile(r"^\+\+\+ b/(\S+)$", re.MULTILINE)

RUN = """
import runpy, sys
from pathlib import Path
import boom_twin
assert Path(boom_twin.__file__).is_relative_to(Path.cwd()), boom_twin.__file__
sys.argv = sys.argv[1:]
runpy.run_path(sys.argv[0], run_name="__main__")
"""


@dataclass(frozen=True)
class WorkedExample:
    """One folder of this directory."""

    name: str

    @property
    def folder(self) -> Path:
        return EXAMPLES / self.name

    @property
    def patch(self) -> str:
        """What changes in files of the package; empty if nothing does."""
        path = self.folder / "change.patch"
        return path.read_text() if path.exists() else ""

    @property
    def new_files(self) -> dict[str, str]:
        """Text of every new file by its path in the package."""
        paths = (
            path for part in PACKAGE for path in sorted((self.folder / part).rglob("*")) if path.suffix in (".py", ".yaml")
        )
        return {path.relative_to(self.folder).as_posix(): path.read_text() for path in paths}

    @property
    def touched(self) -> list[str]:
        return sorted({*self.new_files, *TOUCHED.findall(self.patch)})

    def apply(self, copy: Path) -> None:
        """Copy the package, with the byte code of what does not change, to the folder `copy` and put the example on it."""
        for part in PACKAGE:
            shutil.copytree(ROOT / part, copy / part, symlinks=True, ignore=BEING_WRITTEN)
        for path, text in self.new_files.items():
            assert not (copy / path).exists(), f"{path} is no new file"
            (copy / path).write_text(text)
        if self.patch:
            subprocess.run(["git", "apply", "-"], input=self.patch, text=True, cwd=copy, check=True, env=_outside_git(copy))

    def check(self, copy: Path, **variables: str) -> None:
        """Run ``check.py`` on the copy; AssertionError with all that it printed if it fails."""
        environment = os.environ | {"PYTHONPATH": str(copy), "PYTHONDONTWRITEBYTECODE": "1"} | variables
        command = [sys.executable, "-c", RUN, str(self.folder / "check.py"), str(DRIVES)]
        done = subprocess.run(command, cwd=copy, env=environment, capture_output=True, text=True, check=False, timeout=600)
        assert done.returncode == 0, f"{done.stdout}\n{done.stderr}"


def _outside_git(copy: Path) -> dict[str, str]:
    """Let git take the copy for a plain folder, wherever it lies."""
    return os.environ | {"GIT_CEILING_DIRECTORIES": str(copy.parent)}


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
