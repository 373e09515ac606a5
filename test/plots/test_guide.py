"""The guide tells the truth: its files load, its commands print what it quotes, its mistakes give its messages."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest
from ruamel.yaml import YAML

from boom_twin.cli.main import main
from boom_twin.errors import SceneError
from boom_twin.scene import load_scene
from boom_twin.scene.load import examine

DOCS = Path(__file__).parents[2] / "docs"
PARTS = ("your_boom.md", "your_boom_check.md", "your_boom_faults.md")
GUIDE = "\n".join((DOCS / part).read_text(encoding="utf-8") for part in PARTS)
*STEPS, WHOLE = re.findall(r"```yaml\n(.*?)```", GUIDE, re.DOTALL)
MISTAKES = re.findall(r"```diff\n- (.*?)\n\+ ?(.*?)\n```\n```text\n(.*?)\n```", GUIDE, re.DOTALL)
NUMBER = re.compile(r"[-+]?\d+(?:\.\d+)?")


@pytest.fixture
def boom(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The guide's file in a folder of its own, which is the present one."""
    monkeypatch.chdir(tmp_path)
    Path("my_boom.yaml").write_text(WHOLE, encoding="utf-8")
    return Path("my_boom.yaml")


def quoted(command: str) -> str:
    """What the guide says that a command prints."""
    found = re.search(rf"```\n{re.escape(command)}\n```\n\n```text\n(.*?)\n```", GUIDE, re.DOTALL)
    assert found, f"the guide does not quote `{command}`"
    return found[1]


def test_whole_file_loads_without_warning(boom: Path) -> None:
    scene, oddities = examine(boom)
    assert [joint.kind for joint in scene.joints] == ["A", "B1"]
    assert oddities == []


def test_steps_make_up_the_whole_file() -> None:
    yaml = YAML(typ="safe", pure=True)
    assert len(STEPS) == 4
    assert yaml.load("\n".join(STEPS)) == yaml.load(WHOLE)


def test_check_prints_what_is_quoted(boom: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["check", "my_boom.yaml"]) == 0
    assert capsys.readouterr().out.strip() == quoted("boom_twin check my_boom.yaml")


def test_statics_prints_what_is_quoted(boom: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["statics", "my_boom.yaml", "--posture", "reach"]) == 0
    printed, told = capsys.readouterr().out.strip(), quoted("boom_twin statics my_boom.yaml --posture reach")
    assert NUMBER.sub("#", printed).split() == NUMBER.sub("#", told).split()
    numbers = [[float(number) for number in NUMBER.findall(text)] for text in (printed, told)]
    assert numbers[0] == pytest.approx(numbers[1], rel=1e-3, abs=2e-3)


def test_the_leanest_model_is_the_one_quoted(boom: Path, capsys: pytest.CaptureFixture[str]) -> None:
    command = "boom_twin check my_boom.yaml --need tip=1mm --out my_lean.yaml"
    assert main(command.split()[1:]) == 0
    printed, told = capsys.readouterr().out, quoted(command)
    printed = printed[printed.index("Leanest") :].strip()
    assert NUMBER.sub("#", printed).split() == NUMBER.sub("#", told).split()
    parts = [text.partition("Run time")[0] for text in (printed, told)]
    numbers = [[float(number) for number in NUMBER.findall(text)] for text in parts]
    assert numbers[0] == pytest.approx(numbers[1], rel=5e-3)
    load_scene("my_lean.yaml")


@pytest.mark.parametrize(("right", "wrong", "message"), MISTAKES, ids=[wrong or "nothing" for _, wrong, _ in MISTAKES])
def test_mistakes_give_the_quoted_messages(boom: Path, right: str, wrong: str, message: str) -> None:
    assert WHOLE.count(right) >= 1
    boom.write_text(WHOLE.replace(right, wrong, 1), encoding="utf-8")
    try:
        _, said = examine(boom)
    except SceneError as error:
        said = [*error.faults, *error.oddities]
    assert message in [str(fault) for fault in said]


def test_there_are_mistakes_and_pictures() -> None:
    assert len(MISTAKES) >= 10
    for name in re.findall(r"!\[.*?\]\((.*?)\)", GUIDE):
        assert (DOCS / name).is_file(), name


def without(*keys: str) -> str:
    """The guide's file without the lines that begin with these keys."""
    return "".join(line for line in WHOLE.splitlines(keepends=True) if not line.strip().startswith(keys))


def test_table_of_what_leaving_out_does(boom: Path) -> None:
    from boom_twin.analysis.equilibrium import statics

    without_k, without_mass = without("k:", "d:"), without("barrel:", "rod:", "mL:", "mR:")
    scenes = {
        "as above": WHOLE,
        "no `k`, no `d`": without_k,
        "`modes: 0`": WHOLE + "modes: 0\n",
        "both": without_k + "\nmodes: 0\n",
        "`axial: false`": WHOLE + "axial: false\n",
        "`geometric: false`": WHOLE + "geometric: false\n",
        "no `barrel`, `rod`, `mL`, `mR`": without_mass,
        "no `tip`": re.sub("tip: .*", "", WHOLE),
        "`line_fill: 20.0`": WHOLE + "line_fill: 20.0\n",
        "`base: inclination: 0.0524`": WHOLE.replace("base:", "base:\n  inclination: 0.0524"),
    }
    for name, text in scenes.items():
        row = re.search(rf"\| {re.escape(name)} \|.*\| (\S+) \| (\S+) \|", GUIDE)
        assert row, name
        boom.write_text(text, encoding="utf-8")
        found = statics(load_scene(boom), posture="reach")
        assert found.tip_rigid[1] - found.tip[1] == pytest.approx(1e-3 * float(row[1]), abs=1e-4), name
        assert (f"{found.frequencies[0]:.2f}" if len(found.frequencies) else "none") == row[2], name


@pytest.mark.slow
def test_the_pictures_of_the_guide_are_drawn(tmp_path: Path) -> None:
    subprocess.run([sys.executable, DOCS / "figures.py", tmp_path], check=True)
    drawn = {path.name for path in tmp_path.glob("*.png")}
    symbols = {f"symbols_{part}.png" for part in ("b1", "b2", "b3", "joint_a", "section", "side")}
    responses = {"response.png", "response_steady_state.png", "response_map.png"}
    assert drawn == {"boom.png", "z_fold_arch.png", "lengths_and_drives.png", *symbols, *responses}
    assert all((DOCS / name).is_file() for name in drawn)
