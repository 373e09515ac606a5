"""Scalars, keys and documents that YAML allows and few expect, put into a text."""

from __future__ import annotations

import re

from numpy.random import Generator

from .mutate import pick

NUMBER = re.compile(r"(?<![\w.#])[-+]?\d[\d.]*(?:e[-+]?\d+)?(?![\w.])")
KEY = re.compile(r"[A-Za-z_]\w*(?=:)")

SCALARS = (
    *(".nan", ".inf", "-.inf", "1e400", "1e308", "-1e308", "1e-320", "0", "-0.0", "0x10", "0o17", "0b11", "1_000"),
    *("12:30:45", "1,5", "1.5 m", "'3'", "+.5e3", "1e", "--1", "\u0661\u0662", "9" * 40, "9" * 6000, "1e99999999", "~"),
    *("null", "yes", "true", "", "2001-01-01", "2001-99-99", "[1]", "[]", "{}", "{a: 1}", "&a 1", "*a", "&a [*a]"),
    *("!!float x", "!!float ''", "!!int ''", "!!int 1.5", "!!bool maybe", "!!null x", "!!binary abc"),
    *("!!timestamp never", "!!set {a}", "!!str 3", "!x 3", "!!python/name:os.system", '"\\e[2J"', '"\\u202e"', '"\\0"'),
    *("|\n  x", ">-\n  1", "? x", "<<", "@x", "`x", "%x", "- 1", "1 # x", "[" * 50, "{" * 50, "[" * 5000),
)
DOCUMENTS = (
    *("---\n", "...\n", "--- {}\n", "%YAML 1.1\n---\n", "\ufeff", "\t", "\r", "\0", "\x85", "\u2028", "- x\n"),
    *("<<: *a\n", "x: &a [x]\n"),
)


def odd(random: Generator, text: str) -> str:
    """One number, key or place of `text` is something odd."""
    how = random.integers(4)
    if how == 0:
        return _with_at(random, text, pick(random, DOCUMENTS))
    if how == 1:
        key = str(pick(random, KEY.findall(text) or ["x"]))
        other = pick(random, (key, key.upper(), f'"{key}"', f"? {key}", "<<", f"{key} ", f"&a {key}"))
        return _with_one(random, KEY, text, str(other))
    if how == 2:
        return _with_one(random, NUMBER, text, str(pick(random, SCALARS)))
    return _scaled(random, text)


def _with_at(random: Generator, text: str, more: object) -> str:
    starts = [0, *(match.end() for match in re.finditer("\n", text))]
    place = int(pick(random, starts))
    return f"{text[:place]}{more}{text[place:]}"


def _with_one(random: Generator, pattern: re.Pattern[str], text: str, new: str) -> str:
    found = list(pattern.finditer(text))
    if not found:
        return text + new
    match = pick(random, found)
    return text[: match.start()] + new + text[match.end() :]


def _scaled(random: Generator, text: str) -> str:
    """A number in another unit, of another sign, or a digit mistyped."""
    found = list(NUMBER.finditer(text))
    if not found:
        return text
    match = pick(random, found)
    try:
        value = float(match[0])
    except ValueError:
        return text
    factor = pick(random, (-1.0, 0.0, 1e-3, 1e3, 1e6, 1e-9, 1e12, 1e30, 1e-30, 1e150, 0.5, 1.1, 3.141592653589793 / 180))
    return text[: match.start()] + repr(value * factor) + text[match.end() :]
