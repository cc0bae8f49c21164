"""Whatever a file holds, opening it ends with a result or with an exception of the package: never with a panic."""

import random
from pathlib import Path

import asperity
import polars as pl
import pytest
from conftest import ROOT, SMALL

HOSTILE = ROOT / "fixtures" / "hostile"


def files(folder: str) -> list[Path]:
    found = sorted(path for path in (HOSTILE / folder).rglob("*") if path.is_file())
    assert found
    return found


def used(log: Path) -> asperity.Run | None:
    """Opens a log and asks for everything; None if it is refused."""
    try:
        run = asperity.open(log)
        for ask in (
            lambda: run.summary,
            lambda: run.loads,
            lambda: run.switches,
            lambda: run.states,
            lambda: run.table("/window"),
            lambda: run.field(t=(0.0, 1e-6)),
            lambda: run.detect(link_time_ratio=10),
            lambda: run.draw("load"),
        ):
            try:
                ask()
            except asperity.Error:
                pass
        return run
    except asperity.Error:
        return None


@pytest.mark.parametrize("path", files("logs"), ids=lambda path: path.name)
def test_hostile_logs(path: Path) -> None:
    used(path)


def test_mutants_of_a_log_are_damaged_or_the_same(tmp_path: Path) -> None:
    log = tmp_path / "small.mcap"
    whole = asperity.run(asperity.Scenario("ten-blocks", {"time.duration_s": 0.3}), log=log)
    expected = pl.DataFrame(whole.events)
    content = log.read_bytes()
    drawn = random.Random(1)
    mutant = tmp_path / "mutant.mcap"
    kept = 0
    for _ in range(150):
        hurt = bytearray(content)
        for _ in range(drawn.randint(1, 3)):
            hurt[drawn.randrange(len(hurt))] ^= 1 << drawn.randrange(8)
        if drawn.random() < 0.2:
            del hurt[drawn.randrange(len(hurt)) :]
        mutant.write_bytes(hurt)
        run = used(mutant)
        if run is not None and run.verdict == "whole":
            assert pl.DataFrame(run.events).equals(expected)
            kept += 1
    assert kept < 15, "flips are seen"


@pytest.mark.parametrize("path", files("scenarios"), ids=lambda path: path.name)
def test_hostile_scenarios(path: Path) -> None:
    try:
        scenario = asperity.Scenario(path)
        assert scenario.plan and scenario._repr_html_()
    except asperity.Error as error:
        assert str(error)


@pytest.mark.parametrize("path", files("sweeps"), ids=lambda path: path.name)
def test_hostile_studies(path: Path) -> None:
    try:
        asperity.sweep(path, stop=lambda: True)
    except asperity.Error as error:
        assert str(error)


def test_a_scenario_of_python_is_as_hostile_as_a_file() -> None:
    for key, value in [
        ("slider.blocks", 10**18),
        ("slider.blocks", "100"),
        ("time.duration_s", 1e300),
        ("time.step_s", 5e-324),
        ("normal_load.tilt", [1, 2]),
        ("friction.static_offsets", ["a"]),
        ("a" * 10_000, 1),
        ("\0", 1),
        ("friction", 1),
        ("name", "\n[time]\nstep_s = 1"),
        ('x"]', 1),
    ]:
        with pytest.raises((asperity.Error, TypeError, OverflowError)):
            asperity.run("default", {**SMALL, key: value})
