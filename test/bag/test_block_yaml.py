"""YAML in block style: the same bytes as ruamel.yaml writes, whatever is in it."""

from __future__ import annotations

from io import StringIO
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from ruamel.yaml import YAML

from boom_twin.bag import block_yaml
from boom_twin.bag.block_yaml import dump
from boom_twin.config.yaml_text import plain

BAGS = Path(__file__).parents[2] / "bags"
WORDS = [
    "", "a", "/boom_twin/tip", "1e3", "0x1f", "12", "true", "No", "null", "~", "y", "a b", "a: b", "# no", "- no", "e5", "_",
    ".inf", "one\ntwo\n\nthree", "two\n", "'quoted'", "it's", "*a", "&a", "!a", "%a", "@a", "x" * 5000, "1:20",
    "2026-01-02", "=", "<<",
]  # fmt: skip
VALUES: list[Any] = [*WORDS, 0, -5, 2**63 - 1, True, False, None, 1.5, [], {}]


def by_ruamel(document: Any) -> str:
    yaml, text = YAML(), StringIO()
    yaml.default_flow_style, yaml.width = False, 4096
    yaml.dump(document, text)
    return text.getvalue()


def some(rng: np.random.Generator, depth: int) -> Any:
    kind, size = int(rng.integers(4)), int(rng.integers(1, 5))
    if depth and kind == 0:
        return {WORDS[int(rng.integers(1, len(WORDS)))]: some(rng, depth - 1) for _ in range(size)}
    if depth and kind == 1:
        return [some(rng, depth - 1) for _ in range(size)]
    return VALUES[int(rng.integers(len(VALUES)))]


@pytest.mark.parametrize("value", VALUES, ids=lambda value: repr(value)[:12])
def test_a_value_is_written_as_ruamel_writes_it(value: Any) -> None:
    for document in ({"key": value}, {"key": [value, "a"]}, [{"key": value, "more": 1}]):
        assert dump(document) == by_ruamel(document)


def test_what_is_written_is_read_again() -> None:
    rng = np.random.default_rng(1)
    for _ in range(300):
        document = {"root": some(rng, 4)}
        assert plain(dump(document)) == plain(by_ruamel(document))


@pytest.mark.parametrize("bag", sorted(path.name for path in BAGS.iterdir()))
def test_metadata_of_a_bag_needs_no_ruamel(bag: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(block_yaml, "_left_to_ruamel", lambda value: pytest.fail(f"left to ruamel: {value!r}"))
    text = (BAGS / bag / "metadata.yaml").read_text()
    document = plain(text)
    notes = document["rosbag2_bagfile_information"].pop("custom_data", None)
    assert dump(document) == by_ruamel(document) and (notes is None or isinstance(notes, dict))
