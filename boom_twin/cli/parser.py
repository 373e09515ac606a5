"""The parser of the command line: the nearest name where one is not known."""

from __future__ import annotations

import re
from argparse import Action, ArgumentParser, Namespace, RawDescriptionHelpFormatter
from collections.abc import Sequence
from difflib import get_close_matches
from typing import NoReturn


class CommandsFormatter(RawDescriptionHelpFormatter):
    """Help formatter that keeps the lines of examples, and leaves room for the longest name of a command."""

    def add_argument(self, action: Action) -> None:
        """Add an argument, and count the indentation of commands, which the base class forgets, so that no line breaks."""
        super().add_argument(action)
        for command in self._iter_indented_subactions(action):
            length = self._current_indent + len(self._format_action_invocation(command))
            self._action_max_length = max(self._action_max_length, length)


class CommandParser(ArgumentParser):
    """Parser whose errors name the nearest option or choice."""

    def __init__(self, *args: object, **options: object) -> None:
        options.setdefault("formatter_class", CommandsFormatter)
        super().__init__(*args, **options)  # type: ignore[arg-type]
        self._negative_number_matcher = re.compile(r"-\.?\d")  # values, no options: also lists, as -5,-170

    def parse_known_args(  # type: ignore[override]
        self, args: Sequence[str] | None = None, namespace: Namespace | None = None
    ) -> tuple[Namespace, list[str]]:
        """Parse arguments as `ArgumentParser` does; report unknown ones here, where the options of the command are known."""
        found, extra = super().parse_known_args(args, namespace)
        if extra:
            self.error(f"unrecognized arguments: {' '.join(extra)}{self._near(extra[0], list(self._option_string_actions))}")
        return found, extra

    def error(self, message: str) -> NoReturn:
        """Print usage and message, with the nearest choice if one was wrong, and exit with 2."""
        wrong = message.partition("invalid choice: ")[2].split("'")[1:2]
        known = [str(choice) for action in self._actions for choice in action.choices or ()]
        super().error(message + (self._near(wrong[0], known) if wrong else ""))

    @staticmethod
    def _near(word: str, known: list[str]) -> str:
        near = get_close_matches(word, known, n=1, cutoff=0.5)
        return f". Did you mean {near[0]}?" if near else ""
