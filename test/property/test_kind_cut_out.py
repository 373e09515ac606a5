"""The code of parts that a boom does not have does nothing for it: cut out of a copy of the package, the motion is the same."""

from __future__ import annotations

from pathlib import Path

import pytest
from bench.cut_out import CUTS, PACKAGE, Machinery, cut_out


@pytest.mark.slow
@pytest.mark.parametrize("kind", CUTS)
def test_the_code_of_what_is_absent_changes_no_bit(kind: str, tmp_path: Path) -> None:
    """What it costs, nothing within noise, is printed by `test/bench/cut_out.py`: a time is no test."""
    bare, whole = Machinery(cut_out(tmp_path, kind), tmp_path / "cache"), Machinery(PACKAGE.parent)
    try:
        assert bare.step()[1] == whole.step()[1]
    finally:
        bare.close()
        whole.close()
