"""Tables, JSON and provenance of reports."""

from __future__ import annotations

import json

import numpy as np

from boom_twin.validation.study.report import machine, provenance, table, write_json


def test_table():
    text = table(("a", "b | c"), [(1, 0.123456), ("x|y", float("nan")), (None, 12345.6)])
    assert text == "| a | b | c |\n| --- | --- |\n| 1 | 0.123 |\n| x\\|y | - |\n| - | 12346 |\n"


def test_json_holds_no_numbers_that_are_none(tmp_path):
    write_json(tmp_path / "new" / "x.json", {"rows": [{"a": float("nan"), "b": np.arange(2.0)}, {"c": (1, None)}], "d": True})
    text = (tmp_path / "new" / "x.json").read_text()
    assert json.loads(text) == {"rows": [{"a": None, "b": [0.0, 1.0]}, {"c": [1, None]}], "d": True}


def test_machine_names_versions():
    found = machine()
    assert found["cores"] >= 1 and found["numpy"] and found["boom_twin"] and found["cpu"]
    assert "surrogates" in provenance() and "numpy " in provenance()
