"""The error report of the default scene: well-formed, consistent with itself, and honest about failures."""

from __future__ import annotations

import io
import json
from contextlib import redirect_stderr
from pathlib import Path

import numpy as np
import pytest
from command import main


@pytest.fixture(scope="module")
def report(tmp_path_factory) -> Path:
    """The quick report, made by the command."""
    pytest.importorskip("exudyn")
    out = tmp_path_factory.mktemp("report")
    with redirect_stderr(io.StringIO()) as told:
        assert main(["study", "error", "--quick", "--out", str(out)]) == 0
    assert "\r" not in told.getvalue()  # no bar, for this is no terminal
    return out


@pytest.fixture(scope="module")
def content(report):
    return json.loads((report / "error.json").read_text())


def rows_of(content, **wanted):
    return [row for row in content["rows"] if all(row.get(key) == value for key, value in wanted.items())]


def test_witnesses_agree(content):
    """Exudyn extrapolated and the transfer-matrix boom with many shapes: one motion."""
    assert content["references_differ"]["tip_mm"] < 0.005  # shear as of GA = 10 EA would be 0.016 mm
    assert content["references_differ"]["acceleration"] < 1e-3
    assert min(row["own_mm"] for row in rows_of(content, program="exudyn")) < 1.5


@pytest.mark.parametrize(("method", "expected"), [("generalised-alpha 0.8", 2.0), ("newmark 0.6", 1.0)])
def test_errors_fall_with_the_order_of_the_scheme(content, method, expected):
    rows = [row for row in rows_of(content, method=method) if row["step"] >= 2e-3]
    steps, errors = np.array([[row["step"], row["own_mm"]] for row in rows]).T
    assert np.polyfit(np.log(steps), np.log(errors), 1)[0] == pytest.approx(expected, abs=0.15)
