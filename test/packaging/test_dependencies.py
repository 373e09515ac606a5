"""Dependencies: package.xml names those that the package imports; a command without an optional one says what to install."""

from __future__ import annotations

import ast
import re
import subprocess
import sys
from pathlib import Path
from xml.etree import ElementTree

import pytest
from command import main
from ros_messages import TYPES

import boom_twin

ROOT = Path(__file__).parents[2]
PACKAGE = ElementTree.parse(ROOT / "package.xml").getroot()
SETUP = (ROOT / "setup.py").read_text(encoding="utf-8")
NOT_OF_ROS = {"boom_twin", "numpy", "pydantic", "rpyutils"}  # rpyutils comes with rclpy

ON_REQUEST = {"robot_state_publisher", "rviz2"}  # started if asked for; an error says how to install them


def imported(folder: str) -> set[str]:
    """Top-level packages that the files of a folder import, less those of Python."""
    names: set[str] = set()
    for path in (ROOT / "boom_twin" / folder).rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Import):
                names |= {alias.name.split(".")[0] for alias in node.names}
            elif isinstance(node, ast.ImportFrom) and node.level == 0:
                names.add(str(node.module).split(".")[0])
    return names - sys.stdlib_module_names


def test_it_agrees_with_setup_py() -> None:
    assert PACKAGE.findtext("name") == boom_twin.__name__
    assert f'version="{PACKAGE.findtext("version")}"' in SETUP
    assert PACKAGE.findtext("version") == boom_twin.__version__
    assert f'license="{PACKAGE.findtext("license")}"' in SETUP
    assert PACKAGE.findtext("export/build_type") == "ament_python"


def test_it_tells_who_made_it_and_where_the_licence_is() -> None:
    (author,), (licence,) = (PACKAGE.findall(name) for name in ("author", "license"))
    assert author.text
    assert not [url.text for url in PACKAGE.findall("url") if "example" in str(url.text)]  # none is better than a made-up one
    assert "Apache License" in (ROOT / licence.attrib["file"]).read_text(encoding="utf-8")
    order = [each.tag for each in PACKAGE if each.tag not in ("exec_depend", "test_depend", "export")]
    assert [tag for tag in order if tag != "url"] == ["name", "version", "description", "maintainer", "license", "author"]


def test_the_declared_quality_is_that_of_the_version() -> None:
    """REP-2004: a level above 3 is all that a version below 1.0 may claim."""
    text = (ROOT / "QUALITY_DECLARATION.md").read_text(encoding="utf-8")
    (level,) = re.findall(r"claims to be in the \*\*Quality Level (\d)\*\* category", text)
    assert int(level) > 3 or int(str(PACKAGE.findtext("version")).split(".")[0]) >= 1
    for path in re.findall(r"\]\((?!http)([^)#]+)", text):
        assert (ROOT / path).exists(), path


def test_everything_of_ros_that_is_used_is_named() -> None:
    launched = re.findall(r'package="(\w+)"', "".join(p.read_text() for p in (ROOT / "boom_twin/launch").glob("*.py")))
    used = {name.split("/")[0] for name in TYPES.values()} | {"std_msgs"} | set(launched) | imported("ros") | imported("launch")
    named = {each.text for each in PACKAGE.findall("exec_depend")}
    assert used - NOT_OF_ROS - ON_REQUEST <= named and not ON_REQUEST & named


def test_no_module_hides_a_function_of_the_package():
    """Importing every module first must leave the public names what they are."""
    program = (
        "import pkgutil, importlib, boom_twin\n"
        "for found in pkgutil.iter_modules(boom_twin.__path__): importlib.import_module(f'boom_twin.{found.name}')\n"
        "import boom_twin.offline.replay, boom_twin.analysis.simulate, boom_twin.analysis.equilibrium\n"
        "from boom_twin import load_scene, replay, simulate, statics\n"
        "assert all(map(callable, (load_scene, replay, simulate, statics)))\n"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")


ARCH = str(Path(__file__).parents[2] / "bags" / "arch_session")
COMMANDS = {
    "pyarrow, batch": ("pyarrow", ["batch", ARCH], "boom_twin[batch]"),
    "pyarrow, table": ("pyarrow", ["replay", ARCH, "--table", "parquet"], "pip install pyarrow"),
    "rainflow": ("rainflow", ["replay", ARCH, "--report", "--fatigue", "80"], "boom_twin[fatigue]"),
    "exudyn": ("exudyn", ["rig"], "boom_twin[peers]"),
    "pyarrow, import": ("pyarrow", ["import", "log.parquet"], "boom_twin[import]"),
}


@pytest.mark.parametrize("case", COMMANDS)
def test_a_missing_package_is_named_with_what_installs_it(
    case: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    package, arguments, remedy = COMMANDS[case]
    monkeypatch.chdir(tmp_path)
    Path("log.parquet").write_bytes(b"PAR1")
    for name in [name for name in sys.modules if name.startswith("boom_twin.validation.rig")]:
        monkeypatch.delitem(sys.modules, name)  # imported anew without exudyn
    monkeypatch.setitem(sys.modules, package, None)
    assert main([*arguments, "--out", "out"]) in (1, 2)
    assert remedy in capsys.readouterr().err and not Path("out").exists()
