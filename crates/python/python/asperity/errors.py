"""What the package raises, besides Python's own exceptions."""

from __future__ import annotations

from pathlib import Path
from typing import TypedDict


class Fault(TypedDict):
    """One thing that is wrong with a scenario."""

    place: str | None
    """File, line and column, or the value given here; None for a default."""
    key: str | None
    problem: str
    accepted: str | None


class Error(Exception):
    """Something was asked for rightly and failed: a file that cannot be written, a run that cannot continue."""


class Refused(Error, ValueError):
    """A value that is not accepted; the message names it and what is accepted."""


class ScenarioError(Refused):
    """A scenario with values that are not accepted, or that contradict each other."""

    def __init__(self, message: str, faults: list[Fault] | None = None) -> None:
        super().__init__(message)
        self.faults: list[Fault] = faults or []
        """Everything that is wrong, in the order of the keys."""


class LogError(Error):
    """A file that is not a run log, or a log that is damaged or incomplete."""

    def __init__(self, message: str, verdict: str = "none") -> None:
        super().__init__(message)
        self.verdict = verdict
        """The verdict on the log, as `asperity check` prints it."""


class Interrupted(Error):
    """A run that `stop` ended."""

    def __init__(self, message: str, log: str | None = None) -> None:
        super().__init__(message)
        self.log = None if log is None else Path(log)
        """The unfinished log, from which `asperity.resume` continues; None if there is none."""
