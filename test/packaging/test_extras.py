"""What a command says where an optional package is not installed: what to install."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest
from command import main

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
