"""What a detector is."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any, Protocol

if TYPE_CHECKING:
    from ._native import StepRecord


class Detector(Protocol):
    """Observes the step records of a run, and finds rows of a table in them.

    `observe`, and `finish` if there is one, return nothing, a row as a dict, or several. An attribute `name`, or
    else the class, names the table. Units are taken from the ends of the names in rows: `time_s`, `force_n`.
    """

    def observe(self, record: StepRecord, /) -> Mapping[str, Any] | Iterable[Mapping[str, Any]] | None:
        """Takes the next record, in the order of steps."""
        ...
