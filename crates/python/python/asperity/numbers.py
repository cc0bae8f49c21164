"""Named numbers with units, and verdicts on logs."""

from __future__ import annotations

from html import escape
from typing import Any, NamedTuple


class Numbers(dict[str, Any]):
    """Numbers by name, also as attributes: `summary["precursor_count"]`, `summary.precursor_count`.

    None stands for a number that the run does not determine.
    """

    def __init__(
        self, values: dict[str, Any], units: dict[str, str | None], about: dict[str, str], text: str
    ) -> None:
        super().__init__(values)
        self._units = units
        self._about = about
        self._text = text

    def __str__(self) -> str:
        return self._text or "\n".join(f"{name} = {value} {self._units[name] or ''}" for name, value in self.items())

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__"):
            raise AttributeError(name)
        try:
            return self[name]
        except KeyError as error:
            raise AttributeError(*error.args) from None

    def __missing__(self, name: str) -> Any:
        raise KeyError(f"{name}: no such number (accepted: {', '.join(self)})")

    def __dir__(self) -> list[str]:
        return [*super().__dir__(), *self]

    def unit(self, name: str) -> str | None:
        """The unit of a number; "1" for ratios, None for counts and words."""
        self[name]
        return self._units[name]

    def about(self, name: str) -> str:
        """What a number means."""
        self[name]
        return self._about.get(name, "")

    def _repr_html_(self) -> str:
        rows = (
            f'<tr title="{escape(self.about(name))}"><td>{name}</td><td>{escape(str(value))}</td>'
            f"<td>{self._units[name] or ''}</td></tr>"
            for name, value in self.items()
        )
        return f"<table>{''.join(rows)}</table>"


class Verdict(NamedTuple):
    """The judgement of a check of a log."""

    word: str
    """As `asperity check` prints it: `whole`, `by other code or detectors`, `unreadable`, `incomplete`,
    `stopped`, `salvaged with gaps`, `not a run log`, `damaged`."""
    is_complete: bool
    """Whether the log is complete, whichever program made it."""
    message: str
    """The verdict with the part that was found sound, and what is wrong."""
