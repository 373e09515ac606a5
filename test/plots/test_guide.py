"""The guide tells the truth: its files load, its commands print what it quotes, its mistakes give its messages."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest
from command import main
from default_boom import examine

from boom_twin import SceneError, load_scene

DOCS = Path(__file__).parents[2] / "docs"
PARTS = ("your_boom.md", "your_boom_check.md")
GUIDE = "\n".join((DOCS / part).read_text(encoding="utf-8") for part in PARTS)
WHOLE = (DOCS.parent / "examples" / "two_section_boom.yaml").read_text(encoding="utf-8")
TOLD_MISTAKES = re.findall(r"```diff\n- (.*?)\n\+ ?(.*?)\n```\n```text\n(.*?)\n```", GUIDE, re.DOTALL)
MISTAKES = [
    *TOLD_MISTAKES,
    ("lL: 0.42", "lL: 0.15", "line 38: joints[1].range_deg = [-150.0, 0.0]: the links lL and lR, between D and E, do not"),
    ("D: [-0.14, -0.04]", "D: [-0.30, -0.04]", "line 40: joints[1].D = [-0.3, -0.04]: D must lie on the rigid head"),
    ("I: 2.02e-5", "I: 2020", "line 13: sections[0].I = 2020.0: more than 0.1 m^4: cm^4 or mm^4?"),
    (
        "range_deg: [-150, 0]",
        "range_deg: [-2.6, 0]",
        "line 38: joints[1].range_deg = [-2.6, 0.0]: both are within 6.28 degrees, and joints of booms turn further: radians?",
    ),
    ("kind: B1", "kind: B2", "line 37: joints[1].R is absent: a joint of kind B2 needs it."),
    ("beta: 1.0e-3", "betta: 1.0e-3", "line 15: sections[0].betta = 0.001: unknown key in sections[0]. The nearest known"),
    ("lL: 0.42", "lL: 0,42", "line 42: joints[1].lL = '0,42': a number is needed, not text. Write a decimal point: 0.42."),
    ("k: 2.5e+7", "", "line 48: joints[1].cylinder.d = 70000.0: a damper acts in parallel with the oil spring"),
]
NUMBER = re.compile(r"[-+]?\d+(?:\.\d+)?")


@pytest.fixture
def boom(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    Path("my_boom.yaml").write_text(WHOLE, encoding="utf-8")
    return Path("my_boom.yaml")


def quoted(command: str) -> str:
    found = re.search(rf"```\n{re.escape(command)}\n```\n\n```text\n(.*?)\n```", GUIDE, re.DOTALL)
    assert found, f"the guide does not quote `{command}`"
    return found[1]


def test_whole_file_loads_without_warning(boom: Path) -> None:
    scene, oddities = examine(boom)
    assert [joint.kind for joint in scene.joints] == ["A", "B1"]
    assert oddities == []


def test_check_prints_what_is_quoted(boom: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["check", "my_boom.yaml"]) == 0
    printed = capsys.readouterr().out
    assert printed.startswith(quoted("boom_twin check my_boom.yaml").removesuffix("..")) and "Warnings: none" in printed


def assert_quoted(printed: str, told: str, rel: float, tolerance: float = 0.0) -> None:
    """The same words, and numbers that differ by less than `rel` or `tolerance`."""
    assert NUMBER.sub("#", printed).split() == NUMBER.sub("#", told).split()
    numbers = [[float(number) for number in NUMBER.findall(text)] for text in (printed, told)]
    assert numbers[0] == pytest.approx(numbers[1], rel=rel, abs=tolerance)


def test_statics_prints_what_is_quoted(boom: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["statics", "my_boom.yaml", "--posture", "reach"]) == 0
    told = quoted("boom_twin statics my_boom.yaml --posture reach")
    assert_quoted(capsys.readouterr().out.strip(), told, 1e-3, 2e-3)


def test_the_leanest_model_is_the_one_quoted(boom: Path, capsys: pytest.CaptureFixture[str]) -> None:
    command = "boom_twin check my_boom.yaml --need tip=1mm --out my_lean.yaml"
    assert main(command.split()[1:]) == 0
    printed = capsys.readouterr().out
    printed = printed[printed.index("Leanest") : printed.index("\nIts tip")]
    assert_quoted(printed, quoted(command).removesuffix(".."), 5e-3)
    load_scene("my_lean.yaml")


@pytest.mark.parametrize(("right", "wrong", "message"), MISTAKES, ids=[wrong or "nothing" for _, wrong, _ in MISTAKES])
def test_mistakes_give_their_messages(boom: Path, right: str, wrong: str, message: str) -> None:
    assert WHOLE.count(right) >= 1
    boom.write_text(WHOLE.replace(right, wrong, 1), encoding="utf-8")
    assert len(TOLD_MISTAKES) >= 4
    try:
        _, said = examine(boom)
    except SceneError as error:
        said = [*error.faults, *error.oddities]
    assert any(str(fault).startswith(message) for fault in said), said


def without(*keys: str) -> str:
    """The guide's file without the lines that begin with these keys."""
    return "".join(line for line in WHOLE.splitlines(keepends=True) if not line.strip().startswith(keys))


def test_table_of_what_leaving_out_does(boom: Path) -> None:
    from boom_twin import statics

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
        "`base: stiffness: 5.0e+6`": WHOLE.replace("base:", "base:\n  stiffness: 5.0e+6"),
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
    drawn = {path.name for path in tmp_path.glob("*.png")} - {"monitor.png"}  # which needs a browser
    symbols = {f"symbols_{part}.png" for part in ("b1", "b2", "b3", "joint_a", "section", "side")}
    responses = {"response.png", "response_steady_state.png", "response_map.png"}
    assert drawn == {"boom.png", "z_fold_arch.png", "lengths_and_drives.png", *symbols, *responses}
    assert all((DOCS / name).is_file() for name in drawn)
