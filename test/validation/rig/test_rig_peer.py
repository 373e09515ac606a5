"""Without Exudyn the rig says what to install."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest
from command import main


def test_missing_exudyn_is_one_clear_error(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    for name in [name for name in sys.modules if name.startswith("boom_twin.validation.rig")]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "exudyn", None)
    assert main(["rig", "--out", str(tmp_path / "out")]) == 1
    assert 'pip install "boom_twin[peers]"' in capsys.readouterr().err
