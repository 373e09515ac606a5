"""Single values of a YAML text are set, added and taken out; all else stays."""

from __future__ import annotations

import pytest
from ruamel.yaml import YAML

from boom_twin.config.yaml_text import with_value

TEXT = """# head
tip: {payload: 1.0}   # kg
empty: {}
nothing:
description: |
  two lines
  of text
# between
sensors:
  joint_1: {zero: 0.1, unit: deg}  # mine
  joint_2:
    unit: deg   # own
joints:
  - {k: 1.0e+6}
"""


def loaded(text):
    return YAML(typ="safe", pure=True).load(text)


@pytest.mark.parametrize(
    ("place", "value"),
    [
        (("tip", "payload"), 15.25),
        (("empty", "a", "b"), 1.5),
        (("nothing", "a"), 2),
        (("description",), "three\nlines\nof text"),
        (("description",), "one: line # not a comment"),
        (("sensors", "joint_1", "zero"), -2.5e-5),
        (("sensors", "joint_2", "zero"), 4.0e-3),
        (("sensors", "joint_3", "zero"), 1.0),
        (("joints", 0, "k"), 4.39047e7),
        (("new",), {"payload": 2.0}),
    ],
)
def test_only_that_value_changes(place, value):
    expected, text = loaded(TEXT), with_value(TEXT, place, value)
    block = expected
    for step in place[:-1]:
        if isinstance(block, dict) and block.get(step) is None:
            block[step] = {}
        block = block[step]
    block[place[-1]] = value
    assert loaded(text) == expected
    for comment in ("# head", "# kg", "# between", "# mine", "# own"):
        assert comment in text


def test_a_key_is_taken_out():
    text = with_value(TEXT, ("sensors", "joint_1", "zero"), None)
    assert loaded(text)["sensors"]["joint_1"] == {"unit": "deg"} and "# mine" in text
    assert with_value(TEXT, ("tip", "absent"), None) == TEXT
