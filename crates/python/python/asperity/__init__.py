"""Precursors to sliding: runs of sliders over a surface, their events, fields and figures.

Three lines to a figure::

    import asperity
    run = asperity.run("default")
    run.draw("lengths")

Numbers are in SI units, which stand last in names: `time_s`, `velocity_m_per_s`. Blocks are numbered from 1.
What a scenario key, a number or a column means is said in the manual (docs/) and by `.about` of each table.
"""

from ._native import (
    Diff,
    Events,
    Field,
    Figure,
    Nodes,
    Run,
    Scenario,
    StepRecord,
    Sweep,
    Table,
    __version__,
    diff,
    figures,
    open,
    recording,
    refine,
    reproduce,
    resume,
    run,
    scenarios,
    sweep,
)
from .detector import Detector
from .errors import Error, Interrupted, LogError, Refused, ScenarioError
from .numbers import Numbers, Verdict

__all__ = [
    "Detector",
    "Diff",
    "Error",
    "Events",
    "Field",
    "Figure",
    "Interrupted",
    "LogError",
    "Nodes",
    "Numbers",
    "Refused",
    "Run",
    "Scenario",
    "ScenarioError",
    "StepRecord",
    "Sweep",
    "Table",
    "Verdict",
    "__version__",
    "diff",
    "figures",
    "open",
    "recording",
    "refine",
    "reproduce",
    "resume",
    "run",
    "scenarios",
    "sweep",
]
