"""Odd scalars and tags give the right value or one clear refusal."""

from __future__ import annotations

from typing import Any

import pytest

from boom_twin.config.yaml_text import plain
from boom_twin.errors import SceneError
from boom_twin.scene.load import default_text, examine

NO_VALUES = [
    "!!bool maybe", "!!bool ''", "!!bool 1", "!!int ''", "!!int x", "!!int 0x", "!!int _", "!!int 1:30", "!!float ''",
    "!!float x", "!!float _", "!!float 0x1F", "9" * 5000,
]  # fmt: skip
REFUSED = [
    *NO_VALUES, "!!float 1e400", "1e400", "-1e400", ".inf", ".nan", "1:30", "!!binary aGk=", "!!set {a}", "!!omap [a: 1]",
    "!!int [1]", "!foo 3", "&a [*a]", "1e-400", "1e31", "yes", '"\\uD800"',
]  # fmt: skip
READ = {"0x1F": 31.0, "0o17": 15.0, "017": 17.0, "1_000": 1000.0, "0b101": 5.0, "&a 5": 5.0, "!!float 5": 5.0, "!!int 5": 5.0}


def with_modulus(text: str) -> str:
    return default_text().replace("E: 2.06e+11", f"E: {text}")


@pytest.mark.parametrize("text", REFUSED, ids=lambda text: text[:16])
def test_what_is_no_number_is_refused(bench: Any, text: str) -> None:
    with pytest.raises(SceneError) as caught:
        examine(bench.text(with_modulus(text)))
    assert {(fault.path.split("[")[0], fault.line) for fault in caught.value.faults} == {("material.E", 15)}
    str(caught.value).encode()
    assert max(map(len, str(caught.value).splitlines())) < 300


@pytest.mark.parametrize(("text", "value"), READ.items())
def test_other_spellings_of_a_number_are_read(bench: Any, text: str, value: float) -> None:
    assert value == examine(bench.text(with_modulus(text)))[0].material.E


@pytest.mark.parametrize("text", NO_VALUES, ids=lambda text: text[:16])
def test_text_does_not_take_them_either(bench: Any, text: str) -> None:
    (fault,) = bench.faults_of(bench.text(default_text() + f"description: {text}\n"))
    assert fault.path == "description"
    with pytest.raises(ValueError, match="line 1"):
        plain(f"a: {text}")


def test_half_a_character_is_refused(bench: Any) -> None:
    (fault,) = bench.faults_of(bench.text(default_text() + 'description: "\\uD800"\n'))
    assert "half a character" in fault.bound
