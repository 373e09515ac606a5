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
        Whether a start from rest is asked for.
    due : bool
        Whether anything waits.
    """

    def __init__(self, settings: Settings) -> None:
        self.settings = settings
        self.zeros: dict[str, float] = {}
        self.from_rest = self.due = False

    def tune(self, live: Mapping[str, float]) -> None:
        """Other live settings.

        Raises
        ------
        UsageError
            A value is out of bounds, or cannot change while the twin runs.
        """
        self.settings, self.due = self.settings.tuned(live), True

    def zero(self, values: Mapping[str, float]) -> None:
        """Other zeros of some sensors."""
        self.zeros, self.due = {**self.zeros, **values}, True

    def rest(self) -> None:
        """A start of the model from rest."""
        self.from_rest = self.due = True

    def repeat(self, change: Change) -> None:
        """All that was done to another twin with the sample of that stamp; UsageError as for `tune`."""
        self.settings = self.settings.tuned(change.settings)
        self.zeros, self.from_rest, self.due = change.zeros, change.from_rest, True

    def take(self) -> bool:
        """Nothing waits any more; tells whether a start from rest was asked for."""
        from_rest, self.from_rest, self.due = self.from_rest, False, False
        return from_rest
