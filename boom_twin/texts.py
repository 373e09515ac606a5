"""Alarm sentences, and translations (``texts.json``) of all texts for operators.

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
FILE = Path(__file__).parent / "texts.json"
"""Translations of English texts, in the order of `LANGUAGES`. The live page reads this file."""

THINGS = {
    "joint": "angle sensor of joint {n}",
    "cylinder": "length transducer of cylinder {n}",
    "cylinder_force": "force sensor of cylinder {n}",
    "tip_imu": "tip IMU",
    "joint_angles": "joint angles",
    "cylinder_strokes": "cylinder lengths",
    "cylinder_forces": "cylinder forces",
    "tip": "tip",
    "k": "oil spring of cylinder {n}",
    "drive": "cylinder {n}",
    "EI": "section {n}",
    "stiffness": "base",
}
"""Names by kind of channel, or by last part of a parameter."""


class Sentence(NamedTuple):
    """Alarm sentence: fault and remedy. `stops` is True if the boom must stop at once."""

    what: str
    remedy: str
    stops: bool = False


SENTENCES = {
    "stuck": Sentence("{thing} repeats one reading again and again", "Check its cable and supply"),
    "noise": Sentence("{thing} is much noisier than expected", "Check its cable, shield and mount"),
    "spikes": Sentence("{thing} gives single readings far from their neighbours", "Check its cable and plug"),
    "jump": Sentence("{thing} jumped faster than the boom can move", "Check its mount; if it stays, set its zero"),
    "dropout": Sentence("{thing} gives no readings", "Check its cable, supply and driver"),
    "dropout joint_angles": Sentence("no readings of {thing} are used", "Check that one driver sends them, and its cable"),
    "dropout cylinder_forces": Sentence("no readings of {thing} are used", "Check that one driver sends them, and its cable"),
    "intermittent": Sentence("{thing} fails again and again", "Check its cable and plug"),
    "range": Sentence("{thing} gives impossible readings", "Check its unit, sign and zero in the mapping"),
    "wiring": Sentence("{thing} is not wired as the mapping says", "Record slow moves, then run `boom_twin mapping --check`"),
    "wiring scene": Sentence("the scene is of another boom", "Give the scene of this boom"),
    "late": Sentence("stamps of {thing} are late", "Correct their delay in the mapping"),
    "late cylinder_strokes": Sentence("stamps of {thing} are late", "Give all other streams the negative delay in the mapping"),
    "deviation": Sentence("{thing} does not fit the cylinder lengths", "Compare both at rest, then set the zero"),
    "deviation cylinder_force": Sentence(
        "{thing} does not fit the model", "Check payload and line fill, then the sensor's zero"
    ),
    "exceeded": Sentence(
        "the force at the tip is above its limit",
        "Stop the pump, free the end hose, see if the boom touches anything",
        True,
    ),
    "creeps": Sentence(
        "{thing} changes its length slowly and evenly",
        "If nobody moves it, put the boom down, then look for a leak of its load-holding valve",
    ),
    "softer k": Sentence(
        "{thing} is softer than the scene says", "Finish the move, then look for air in the oil and loose pins"
    ),
    "softer EI": Sentence("{thing} is softer than the scene says", "Stop, and look for cracks", True),
    "softer stiffness": Sentence(
        "{thing} is softer than the scene says", "Stop, and look for outriggers that sink and loose bolts", True
    ),
    "more payload": Sentence(
        "the boom carries more than the payload that is set", "Check what hangs at the tip, then set the payload"
    ),
    "less payload": Sentence(
        "the boom carries less than the payload that is set", "Check what hangs at the tip, then set the payload"
    ),
    "more line_fill": Sentence("the pipe line holds more than the line fill that is set", "Set the line fill"),
    "less line_fill": Sentence("the pipe line holds less than the line fill that is set", "Set the line fill"),
    "off": Sentence("{thing} reads wrong", "Check the sensor's zero and scale"),
    "off joint": Sentence(
        "{thing}, or the length transducer beside it, reads wrong", "Compare both at rest, then set the zero"
    ),
    "gap": Sentence("cylinder lengths were missing", "Check cable and driver of the length transducers"),
    "gap joint_angles": Sentence("joint angles were missing", "Check cable and driver of the angle sensors"),
    "clock": Sentence("a clock was set", "No action is needed if this was intended"),
    "": Sentence("{thing} does not behave as the model", "Inspect it"),
}
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
