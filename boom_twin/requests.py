"""What is asked of a running twin, until a stroke sample takes it over."""

from __future__ import annotations

from collections.abc import Mapping

from .records import Change
from .settings import Settings


class Requests:
    """Collects what is asked for between two stroke samples.

    Attributes
    ----------
    settings : Settings
    zeros : dict of str to float
        As they will be.
    from_rest : bool
        Whether the model is to begin again.
    due : bool
        Whether anything waits.
    """

    def __init__(self, settings: Settings) -> None:
        self.settings = settings
        self.zeros: dict[str, float] = {}
        self.from_rest = self.due = False

    def tune(self, live: Mapping[str, float]) -> None:
        """Other live settings; another load needs a start from rest.

        Raises
        ------
        UsageError
            A value is out of bounds, or cannot change while the twin runs.
        """
        settings = self.settings.tuned(live)
        self.from_rest |= settings.load != self.settings.load
        self.settings, self.due = settings, True

    def zero(self, values: Mapping[str, float]) -> None:
        """Other zeros of some sensors; those of strokes drive the model, which then starts from rest."""
        self.from_rest |= any(name.startswith("cylinder") for name in values)
        self.zeros, self.due = {**self.zeros, **values}, True

    def rest(self) -> None:
        """The model is to begin again."""
        self.from_rest = self.due = True

    def repeat(self, change: Change) -> None:
        """All that was done to another twin with the sample of that stamp; UsageError as for `tune`."""
        self.settings = self.settings.tuned(change.settings)
        self.zeros, self.from_rest, self.due = change.zeros, change.from_rest, True

    def take(self) -> bool:
        """Nothing waits any more; tells whether the model is to begin again."""
        from_rest, self.from_rest, self.due = self.from_rest, False, False
        return from_rest
