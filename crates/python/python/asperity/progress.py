"""A bar for runs that take a while, in terminals and in notebooks."""

from __future__ import annotations

import sys
import time

_WIDTH = 40
_INTERVAL_S = 0.1


class Bar:
    """Draws how much of a run or a study is done: on the last line of a terminal, or below a notebook's cell."""

    def __init__(self, name: str) -> None:
        self._name = name
        self._next_s = time.monotonic() + _INTERVAL_S
        self._is_drawn = False

    def __call__(self, done: int, total: int) -> None:
        """Draws the bar, at most ten times per second, and not at all for what is done at once."""
        is_over = done >= total
        if (not is_over and time.monotonic() < self._next_s) or (is_over and not self._is_drawn):
            return
        self._next_s = time.monotonic() + _INTERVAL_S
        self._is_drawn = True
        share = done / total if total else 1.0
        full = "#" * round(share * _WIDTH)
        end = "\n" if is_over else ""
        sys.stderr.write(f"\r{self._name} [{full:<{_WIDTH}}] {share:4.0%}{end}")
        sys.stderr.flush()
