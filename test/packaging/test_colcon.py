"""`colcon build` and `colcon test` in a workspace of its own; ``make test-extra`` sets colcon up in ``.venv-colcon``."""

from __future__ import annotations

import os
import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path
from xml.etree import ElementTree

import pytest

ROOT = Path(__file__).parents[2]
COLCON = ROOT / ".venv-colcon" / "bin" / "colcon"
LEFT_BEHIND = shutil.ignore_patterns(".*", "build", "install", "log", "out", "__pycache__", "*.egg-info", "bags", "docs")

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not COLCON.exists(), reason="no colcon in .venv-colcon; make test-extra installs it"),
]


def environment() -> dict[str, str]:
    """That of a shell in which colcon's environment was activated."""
    own = {name: value for name, value in os.environ.items() if name not in ("PYTHONPATH", "AMENT_PREFIX_PATH")}
    own.pop("_ROS_WHEELS_BOOTSTRAP_COMPLETE", None)  # of the environment that runs this test
    own.pop("PYTHONDONTWRITEBYTECODE", None)
    return own | {"PATH": f"{COLCON.parent}{os.pathsep}{own['PATH']}"}


@pytest.fixture(scope="module", params=["copied", "linked"])
def workspace(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """A workspace with this package as its only one, built."""
    path = tmp_path_factory.mktemp(request.param)
    shutil.copytree(ROOT, path / "src" / "boom_twin", symlinks=True, ignore=LEFT_BEHIND)
    said = run(path, "colcon", "build", *(["--symlink-install"] if request.param == "linked" else []))
    assert "1 package finished" in said and "stderr" not in said
    yield path


def run(path: Path, *command: str) -> str:
    """What a command said, in the workspace; fails with it if the command fails."""
    done = subprocess.run(command, cwd=path, env=environment(), capture_output=True, text=True, timeout=600, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout + done.stderr


def sourced(path: Path, *command: str) -> str:
    """What a command said in a shell that has sourced the workspace."""
    return run(path, "bash", "-c", '. install/setup.bash && "$@"', "bash", *command)


def test_the_index_knows_the_package(workspace: Path) -> None:
    prefix = workspace / "install" / "boom_twin"
    assert (prefix / "share" / "ament_index" / "resource_index" / "packages" / "boom_twin").is_file()
    assert ElementTree.parse(prefix / "share" / "boom_twin" / "package.xml").findtext("name") == "boom_twin"


def test_what_is_shared_is_installed(workspace: Path) -> None:
    share = workspace / "install" / "boom_twin" / "share" / "boom_twin"
    for folder in ("msg_config", "boom_twin/launch"):
        expected = {path.name for path in (ROOT / folder).iterdir() if path.is_file()}
        assert {path.name for path in (share / Path(folder).name).iterdir()} == expected


def test_ros2_run_finds_the_executables(workspace: Path) -> None:
    """Where `ros2 run` looks: lib/PACKAGE of the prefix that has the package in its index."""
    find = (
        "import os, pathlib; "
        "prefix = next(p for p in map(pathlib.Path, os.environ['AMENT_PREFIX_PATH'].split(os.pathsep)) "
        "if (p / 'share/ament_index/resource_index/packages/boom_twin').exists()); "
        "print(*sorted(p.name for p in (prefix / 'lib/boom_twin').iterdir() if os.access(p, os.X_OK)))"
    )
    assert sourced(workspace, "python", "-c", find).split() == ["boom_twin", "twin_node"]


def test_the_executables_run_what_was_built(workspace: Path) -> None:
    lib = str(workspace / "install" / "boom_twin" / "lib" / "boom_twin")
    assert sourced(workspace, f"{lib}/boom_twin", "urdf").startswith("<?xml")
    assert "a ROS 2 lifecycle node" in sourced(workspace, f"{lib}/twin_node", "--help")
    where = sourced(workspace, "python", "-c", "import boom_twin; print(boom_twin.__file__)").strip()
    assert Path(where).is_relative_to(workspace)


def test_colcon_test(workspace: Path) -> None:
    """One file of the tests, found, run and counted."""
    run(workspace, "colcon", "test", "--pytest-args", "test/ros/test_ros_layouts.py")
    summary = run(workspace, "colcon", "test-result", "--verbose")
    count = int(summary.split("Summary: ")[1].split()[0])
    assert count > 0 and "0 errors, 0 failures, 0 skipped" in summary
