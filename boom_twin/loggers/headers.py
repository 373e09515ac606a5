"""Recognition of channels and units in English and German logger headers."""

from __future__ import annotations

import re
from dataclasses import dataclass

from ..types import NUMBER, SENSORS, Stream, stream_of

UNIT_NAMES = {
    "m": ("meter", "metre"),
    "cm": ("zentimeter",),
    "mm": ("millimeter", "millimetre", "milimeter"),
    "um": ("µm", "μm", "mikrometer"),
    "in": ("inch", "zoll"),
    "deg": ("°", "grad", "degree", "degrees"),
    "m/s^2": ("m/s2", "m/s²", "m/s**2", "m_s2", "m/sec^2"),
    "s": ("sec", "second", "seconds", "sek", "sekunde", "sekunden"),
    "ms": ("msec", "milliseconds", "millisekunden"),
    "us": ("µs", "μs", "microseconds"),
    "ns": ("nanoseconds",),
    "d": ("day", "days", "tage"),
}
"""Other spellings of units, in lower case."""
TIME_UNITS = {"s": 10**9, "ms": 10**6, "us": 10**3, "ns": 1, "min": 60 * 10**9, "h": 3600 * 10**9, "d": 86400 * 10**9}
"""Nanoseconds in a unit of time."""
CHANNEL_UNITS = {unit for kind in SENSORS.values() for unit in kind.units}
_OTHER_UNITS = (
    "bar", "mbar", "psi", "pa", "hpa", "kpa", "mpa", "°c", "degc", "k", "°f", "%", "v", "mv", "a", "ma", "hz", "khz", "rpm",
    "1/min", "u/min", "mm/s", "m/s", "m/s^3", "deg/s", "°/s", "rad/s", "nm", "knm", "kg", "t", "l/min", "l", "kw", "w",
    "counts", "digit",
)  # fmt: skip
_KNOWN = {unit.lower(): unit for unit in (*_OTHER_UNITS, *TIME_UNITS, *CHANNEL_UNITS)}
_KNOWN |= {name: unit for unit, names in UNIT_NAMES.items() for name in names}
_BRACKETS = re.compile(r"^(.*?)[\s_,]*(?:\[([^\[\]]*)\]|\(([^()]*)\)|<([^<>]*)>|\{([^{}]*)\})\s*$", re.DOTALL)
_WORD_IN = re.compile(r"^(.*\S)(?:\s+in\s+|\s*/\s*|\s*,\s*)(\S+)$", re.DOTALL)
_BARE = sorted((name for name, unit in _KNOWN.items() if unit in CHANNEL_UNITS | {*TIME_UNITS}), key=len, reverse=True)
_AT_END = re.compile(rf"^(.*[^\W_])[\s_]+({'|'.join(map(re.escape, _BARE))})$", re.DOTALL | re.IGNORECASE)

_WORDS = {
    Stream.FORCES: ("force", "kraft", "kraeft", "load pin"),
    Stream.IMU: ("accel", "beschl", "imu", r"\bacc\b"),
    Stream.ANGLES: ("joint", "gelenk", "winkel", "angle", "encoder", "drehgeber"),
    Stream.STROKES: (
        "cylinder",
        r"\bcyl",
        "zylinder",
        r"\bzyl",
        "stroke",
        "length",
        "piston",
        "hub",
        "laenge",
        r"\bweg\b",
        "kolben",
    ),
}
"""Patterns of the words for each stream."""
_OVER = (Stream.FORCES, Stream.IMU)  # streams that take precedence if a header names several, as in 'cylinder force'
_NOT_READINGS = (
    r"soll|setpoint|target|command|\bcmd|desired|\bref\b|speed|veloc|geschw|\brate\b|temp|druck|pressure|status|fehler|error"
    r"|alarm|quality|\bmin\b|\bmax\b|mittel|\bmean|\bavg|\brms\b|\bstd\b|offset|strom\b|current|spannung|volt|diff|abweich"
    r"|ventil|valve"
)
_INCLINATION = r"inclin|neigung|\bincl|tilt|horizont"
_PATH = re.compile(r"::|\\|(?<=\w)\.(?=[A-Za-z])")  # separators of device, message and signal in a name
_TIME = (
    r"^(t|x|abs|rel|log)?[ _]*(time|zeit|timestamp|zeitstempel|stamp|datum|date|uhrzeit|clock|x value|t|sekunden|seconds)s?\b"
)


@dataclass(frozen=True, slots=True)
class Guess:
    """Channel and unit of a column by its header, or the reason why none is recognised."""

    channel: str = ""
    unit: str = ""
    reason: str = ""


def unit_of(text: str) -> str:
    """Return this package's name of a unit, empty if the text is no known unit."""
    return _KNOWN.get(re.sub(r"\s+", "", text.strip("[](){}<> \t\n")).lower(), "")


def split_header(text: str) -> tuple[str, str]:
    """Return name and unit of a header such as ``Kraft 3 in kN`` or ``Winkel 2 (deg)``. The unit may be empty or unknown."""
    text = " ".join(text.split())
    if found := _BRACKETS.match(text):
        name, *units = found.groups()
        unit = next(each for each in units if each is not None).strip()
        if name and (unit_of(unit) or found[2] is not None):
            return name, unit_of(unit) or unit
    for pattern in (_WORD_IN, _AT_END):
        if (found := pattern.match(text)) and unit_of(found[2]):
            return found[1], unit_of(found[2])
    return text, ""


def is_time(name: str) -> bool:
    """Return True if a column has the name of a time."""
    return bool(re.search(_TIME, _folded(name)))


def guess(name: str, unit: str, joints: int | None) -> Guess:
    """Return the channel of a column if name and unit fit only one.

    Parameters
    ----------
    joints : int or None
        Number of joints of the boom, if it is known.
    """
    if (stream := stream_of(name)) is not None and not unit:
        return Guess(name, SENSORS[stream].unit)
    last = _folded(_PATH.split(name)[-1])
    words = last if _named(last) else _folded(name)
    if re.search(_INCLINATION, words):
        return Guess(reason="an inclinometer: name its joint, and give absolute: root or head in a mapping")
    named = _named(words)
    if not named:
        return Guess(reason="no channel's name is in it")
    if found := re.search(_NOT_READINGS, words):
        return Guess(reason=f"{found[0].strip()!r}: no reading of a channel")
    named = next(({stream} for stream in _OVER if stream in named), named)
    fitting = {stream for stream in named if unit in SENSORS[stream].units} if unit else named
    if not fitting:
        units = " or ".join(", ".join(SENSORS[stream].units) for stream in named)
        return Guess(reason=f"unit {unit}, not {units}")
    if len(fitting) > 1:
        return Guess(reason="it may be a stroke or an angle: give its unit")
    (stream,) = fitting
    end = _end(words, stream)
    channel = f"{SENSORS[stream].stem}_{end}"
    if not end or stream_of(channel) is not stream:
        ends = SENSORS[stream].ends
        return Guess(reason=f"its axis is none of {', '.join(ends)}" if ends else "its number is not known")
    if joints is not None and end.isdigit() and int(end) > joints:
        return Guess(reason=f"the scene has {joints} joints")
    return Guess(channel, unit)


def _named(words: str) -> set[Stream]:
    return {stream for stream, stems in _WORDS.items() if any(re.search(stem, words) for stem in stems)}


def _end(words: str, stream: Stream) -> str:
    """Return the suffix of a channel: axis, number beside the word, or only number. It is empty if unknown."""
    numbers = [text.lstrip("0") for text in re.findall(r"\d+", words)]
    if ends := SENSORS[stream].ends:
        axes = re.findall(rf"\b({'|'.join(ends)})\b", words)
        return axes[0] if len(axes) == 1 and not set(numbers) - {"1"} else ""
    beside = [
        match[1]
        for stem in _WORDS[stream]
        for match in re.finditer(rf"{stem}[a-z]*[ _.:#-]*(?:nr[ .]*|no[ .]*)?0*(\d+)", words)
    ]
    found = {*beside} or {*numbers}
    if not found and len(letters := re.findall(r"\b([a-h])\b", words)) == 1:
        return str("abcdefgh".index(letters[0]) + 1)
    end = found.pop() if len(found) == 1 else ""
    return end if NUMBER.fullmatch(end) else ""


def _folded(name: str) -> str:
    """Return a name in lower case, without umlauts, with spaces where case or kind of character changes."""
    name = re.sub(r"(?<=[a-zäöüß])(?=[A-ZÄÖÜ])", " ", name)
    for umlaut, letters in (("ä", "ae"), ("ö", "oe"), ("ü", "ue"), ("ß", "ss")):
        name = name.replace(umlaut, letters).replace(umlaut.upper(), letters)
    name = re.sub(r"(?<=[A-Za-z])(?=\d)|(?<=\d)(?=[A-Za-z])", " ", name)
    return re.sub(r"[_\W]+", " ", name).strip().lower()
