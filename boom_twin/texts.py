"""Alarm sentences (``alarms.json``), and translations (``texts.json``) of all texts for operators.

The sentences are used by `/diagnostics`, live page, report, ``summary.json`` and command line. Sentences hold no figures:
figures are the alarm's evidence, which has no words.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import NamedTuple

LANGUAGES = ("en", "de", "zh")
FOLDER = Path(__file__).parent
FILE = FOLDER / "texts.json"
"""Translations of English texts, in the order of `LANGUAGES`. The live page reads this file."""


class Sentence(NamedTuple):
    """Alarm sentence: fault and remedy. `stops` is True if the boom must stop at once."""

    what: str
    remedy: str
    stops: bool = False


_ALARMS = json.loads((FOLDER / "alarms.json").read_bytes())
THINGS: dict[str, str] = _ALARMS["things"]
"""Names by kind of channel, or by last part of a parameter."""
SENTENCES = {key: Sentence(*parts) for key, parts in _ALARMS["sentences"].items()}
"""Sentences by kind of alarm, some by kind of channel or parameter too. The last one is for unknown kinds."""


@cache
def translations() -> Mapping[str, list[str]]:
    """Return the texts in German and Chinese by their English text."""
    return dict(json.loads(FILE.read_text(encoding="utf-8")))


def translated(english: str, language: str = "en") -> str:
    """Return the translation of a text, or the English text if there is none."""
    others = None if language == "en" else translations().get(english)
    return english if others is None else others[LANGUAGES.index(language) - 1]


def alarm_sentence(channel: str, kind: str, cause: str | None) -> Sentence:
    """Return the entry of an alarm in `SENTENCES`."""
    keys = (f"{kind} {(cause or '').rpartition('.')[2]}", f"{kind} {_parts(channel)[0]}", kind, "")
    return next(SENTENCES[key] for key in keys if key in SENTENCES)


def alarm_text(channel: str, kind: str, cause: str | None, language: str = "en") -> str:
    """Return the text of an alarm for an operator: fault and remedy."""
    sentence = alarm_sentence(channel, kind, cause)
    last, place = (cause or "").rpartition(".")[2], channel
    if last in THINGS:
        place = last
    name = THINGS.get(_parts(place)[0])
    thing = place if name is None else translated(name, language).format(n=_parts(channel)[1])
    what = translated(sentence.what, language).format(thing=thing)
    stop = "。" if language == "zh" else "."
    space = "" if language == "zh" else " "
    return f"{what[:1].upper()}{what[1:]}{stop}{space}{translated(sentence.remedy, language)}{stop}"


def _parts(channel: str) -> tuple[str, str]:
    """Return kind and number of a channel. All axes of the tip IMU are one channel."""
    if channel.startswith("tip_imu"):
        return "tip_imu", ""
    kind, _, number = channel.rpartition("_")
    return (kind, number) if number.isdigit() else (channel, "")
