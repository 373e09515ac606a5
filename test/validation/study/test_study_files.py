"""What a study writes: a folder of its own, in which it replaces nothing but an earlier study of its kind."""

from __future__ import annotations

from pathlib import Path

import pytest
from command import main

from boom_twin import BagError
from boom_twin.cli.study import KINDS
from boom_twin.system.result_folder import result_folder, study


@pytest.mark.parametrize("kind", KINDS)
def test_a_file_that_is_there_is_kept(kind: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Which is found before the work begins: it may take minutes."""
    for name in (f"{kind}.md", f"{kind}.png", "notes.txt"):
        (out := tmp_path / name).mkdir()
        (out / name).write_text("mine")
        assert main(["study", kind, "--quick", "--out", str(out)]) == 1
        assert f"{out}: holds {name}, and no manifest of `boom_twin study {kind}`" in capsys.readouterr().err
        assert [path.read_text() for path in out.iterdir()] == ["mine"]


def test_of_two_kinds_each_has_its_own_folder(tmp_path: Path) -> None:
    with result_folder(tmp_path / "out", study("error"), []) as building:
        (building / "error_methods.png").write_text("one")
    with result_folder(tmp_path / "out", study("error"), []) as building:
        (building / "error_methods.png").write_text("two")
    assert (tmp_path / "out" / "error_methods.png").read_text() == "two"
    with (
        pytest.raises(BagError, match="only an earlier result of this command is"),
        result_folder(tmp_path / "out", study("parts"), []),
    ):
        raise AssertionError("it is another study's")
    assert (tmp_path / "out" / "error_methods.png").read_text() == "two"
