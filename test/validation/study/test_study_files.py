"""What a study writes: a folder of its own, in which it replaces nothing but an earlier study of its kind."""

from __future__ import annotations

from pathlib import Path

import pytest
from command import main

from boom_twin.cli.study import KINDS


@pytest.mark.parametrize("kind", KINDS)
def test_a_file_that_is_there_is_kept(kind: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Which is found before the work begins: it may take minutes."""
    for name in (f"{kind}.md", f"{kind}.png", "notes.txt"):
        (out := tmp_path / name).mkdir()
        (out / name).write_text("mine")
        assert main(["study", kind, "--quick", "--out", str(out)]) == 1
        assert f"{out}: holds {name}, and no manifest of a study {kind}" in capsys.readouterr().err
        assert [path.read_text() for path in out.iterdir()] == ["mine"]
