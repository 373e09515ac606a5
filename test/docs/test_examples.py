"""What the documentation and the examples tell to run runs as it stands, in a folder laid out as a clone is."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from command import main
from recordings import load_mapping

from boom_twin.cli.main import COMMANDS, EXAMPLES

ROOT = Path(__file__).parents[2]


@pytest.fixture
def clone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with the sessions and examples of the clone."""
    for name in ("bags", "examples"):
        shutil.copytree(ROOT / name, tmp_path / name)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_python_of_the_page_on_the_api_runs_as_it_is_pasted(clone: Path) -> None:
    blocks = re.findall(r"```python\n(.*?)```", (ROOT / "docs" / "api.md").read_text(encoding="utf-8"), re.DOTALL)
    assert blocks
    done = subprocess.run([sys.executable, "-c", "\n".join(blocks)], capture_output=True, text=True, timeout=600)
    assert done.returncode == 0, done.stderr
    assert re.search(r"[0-9a-f]{64}", done.stdout)


def test_the_notebook_runs(clone: Path) -> None:
    nbformat = pytest.importorskip("nbformat", reason="pip install .[test]")
    nbclient = pytest.importorskip("nbclient", reason="pip install .[test]")
    pytest.importorskip("ipykernel", reason="pip install .[test]")
    pytest.importorskip("pandas", reason="pip install .[test]")
    notebook = nbformat.read(clone / "examples" / "first_steps.ipynb", as_version=4)
    nbclient.NotebookClient(notebook, timeout=600, resources={"metadata": {"path": str(clone / "examples")}}).execute()
    text = str(notebook.cells)
    assert "<caption>Equilibrium</caption>" in text and "residual_joint_1_rad" in text


def test_the_stroke_file_is_a_drive_and_a_session(clone: Path, capsys: pytest.CaptureFixture[str]) -> None:
    arguments = ["simulate", "--drive", "examples/strokes.csv", "--out", "motion.csv", "--no-error-estimate"]
    assert main(arguments) == 0
    told = capsys.readouterr().out
    assert "started at rest   strokes 0.630" in told and "81 rows, 4 s" in told and told.endswith("motion.csv\n")
    assert main(["info", "examples/strokes.csv"]) == 0
    assert "/cylinder_strokes" in capsys.readouterr().out


def test_the_mapping_is_one_and_info_judges_by_it(clone: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert load_mapping(clone / "examples" / "mapping.yaml", 4).sensors["cylinder_1"].zero == 12.5
    assert main(["info", "bags/arch_session", "--mapping", "examples/mapping.yaml"]) == 0
    assert "no topic /plc/joint_states" in capsys.readouterr().out
    assert main(["mapping"]) == 0
    (clone / "own.yaml").write_text(capsys.readouterr().out)
    assert load_mapping(clone / "own.yaml") == load_mapping()


def test_the_mappings_of_the_page_are_ones(tmp_path: Path) -> None:
    blocks = re.findall(r"```yaml\n(.*?)```", (ROOT / "docs" / "mapping.md").read_text(encoding="utf-8"), re.DOTALL)
    assert len(blocks) >= 3
    for block in blocks:
        (tmp_path / "rig.yaml").write_text(block, encoding="utf-8")
        load_mapping(tmp_path / "rig.yaml", 4)


def test_every_command_has_examples() -> None:
    assert EXAMPLES.keys() == COMMANDS.keys()
