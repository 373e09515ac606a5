"""Events of the twin: names of irregularities of a sample, as in `Report.events`."""

from ..types import StrokeReading

EVENTS = {
    "late": "stamp not after the newest one of its stream; sample left out",
    "duplicate": "stamp as the newest one of its stream, within 20 us; sample left out",
    "partial": "some values missing, not finite or absurd; the others were used",
    "empty": "no usable value; sample left out",
    "waiting": "no message with all strokes yet, or started less than a second ago; the model has not started",
    "gap": "longer pause between strokes, bridged",
    "restart": "pause too long to bridge, or strokes elsewhere after it; started again from rest",
    "stroke elsewhere": "a stroke jumped where its cylinder cannot go, and stayed there for a second; started from rest",
    "leap": "stamp far from where its stream was; left out unless the next follows it within `gap`: slower strokes need more",
    "clock set": "stamps went on elsewhere, strokes where they were; the model goes on, by the new stamps",
    "jump back": "time was set back, and strokes did not go on where they were; started again from rest",
    "second source": "samples of another source among those that are followed; left out",
    "implausible": "a stroke where its cylinder cannot be; left out, for up to a second if it jumped there",
    "out of range": "a stroke outside 0 to max_stroke of its cylinder; used where it is plausible",
    "held": "a stroke missing for long; predicted by the other sensors and by how its cylinder moved",
    "model": "the model failed; it starts again with the next full sample",
    "reset": "asked for; the model started again from rest",
    "load": "payload or line fill changed; the model started again from rest",
    "limits": "other settings changed while the twin ran",
    "zero": "the zero of a sensor was set anew",
    "deflected": "tip further than half the boom's reach from the undeformed boom's: outside the model's validity",
    "not used": "a stroke, though angles drive the model; left out",
    "unmatched": "no prediction at the stamp of this sample; no residual",
}

CONSEQUENCES = frozenset({"waiting", "model"})
"""Events that follow from others."""

TOLD_AT_ONCE = frozenset({"restart", "stroke elsewhere", "clock set", "jump back", "reset", "load", "limits", "zero"})
"""Events that `Report.change` goes with."""


def event_meaning(name: str, reads: StrokeReading) -> str:
    """Return the meaning of an event where these readings drive the model; empty for an unknown event."""
    told = EVENTS.get(name, "")
    is_of_angles = reads is StrokeReading.ANGLE and name != "not used"
    return told.replace("strokes", "angles").replace("a stroke", "an angle") if is_of_angles else told
