"""Tables are read by every library of data frames, without a copy; fields are arrays on the same memory."""

import copy
import pickle
from pathlib import Path

import asperity
import duckdb
import numpy as np
import pandas as pd
import polars as pl
import pyarrow as pa
import pytest
from conftest import ROOT, SMALL


def tables(run: asperity.Run) -> list[asperity.Table]:
    return [run.events, run.onsets, run.global_slips, run.ruptures, run.arrivals, run.loads, run.switches, run.states]


def test_every_library_reads_every_table(default_run: asperity.Run) -> None:
    for table in tables(default_run):
        arrow = pa.table(table)
        assert arrow.column_names == table.columns and arrow.num_rows == len(table) > 0
        assert pl.from_arrow(arrow).equals(table.to_polars())  # type: ignore[union-attr]
        assert pl.DataFrame(table).equals(table.to_polars()), "the stream is read again and again"
        frame = table.to_pandas()
        assert isinstance(frame, pd.DataFrame) and len(frame) == len(table)
        with duckdb.connect() as connection:
            counted = connection.sql("select count(*) from arrow").fetchall()
            assert counted == [(len(table),)]
        for column, values in table.to_numpy().items():
            expected = arrow[column].to_numpy()
            if values.dtype == object:
                assert list(values) == list(expected)
            else:
                np.testing.assert_array_equal(values.astype(float), expected.astype(float), strict=False)


def test_units_stand_in_the_fields(default_run: asperity.Run) -> None:
    schema = pa.table(default_run.arrivals).schema
    units = {field.name: (field.metadata or {}).get(b"unit", b"").decode() for field in schema}
    assert units["arrival_s"] == "s" and units["front_speed_m_per_s"] == "m/s" and units["block"] == ""
    assert {name: unit for name, unit in units.items() if unit} == default_run.arrivals.units
    assert "block" in default_run.arrivals.about["block"].lower()


def test_nothing_is_copied(default_run: asperity.Run) -> None:
    for name in ("onset_s", "first_block", "event"):
        for _ in range(2):
            column = default_run.events[name]
            arrow = pa.table(default_run.events)[name].chunk(0)
            address = arrow.buffers()[1].address
            assert column.ctypes.data == address
            polars = pl.DataFrame(default_run.events)[name].to_arrow()
            assert polars.buffers()[1].address == address
            assert pa.RecordBatchReader.from_stream(default_run.events).read_all()[name].chunk(0).buffers()[1].address == address
    assert not default_run.events["onset_s"].flags.writeable


def test_data_can_be_copied_and_pickled(default_run: asperity.Run) -> None:
    class Mixed:
        def observe(self, record: asperity.StepRecord) -> list[dict[str, object]]:
            return [{"time_s": record.time_s, "step": record.step, "slides": record.sliding > 0}, {"text": "\u00b5"}]

    events = default_run.detect(Mixed())
    mixed = events.found["Mixed"]
    assert pa.table(mixed).schema.field("text").type == pa.large_string(), "2 GiB are not the most"
    field = default_run.field("velocity", t=(0.7, 0.71), every=1e-3)
    nodes = asperity.run("slab", {"time.duration_s": 1e-4}).nodes(1e-4)
    for copied in (copy.copy, copy.deepcopy, lambda value: pickle.loads(pickle.dumps(value, 2))):
        for table in [*tables(default_run), mixed]:
            other = copied(table)
            assert pa.table(other).equals(pa.table(table), check_metadata=True) and repr(other) == repr(table)
        assert repr(copied(events)) == repr(events)
        assert repr(copied(field)) == repr(field) and (copied(field).values == field.values).all()
        assert (copied(field).steps == field.steps).all() and (copied(field).x == field.x).all()
        assert repr(copied(nodes)) == repr(nodes) and (copied(nodes).velocity == nodes.velocity).all()
        summary = copied(default_run.summary)
        assert summary == default_run.summary and summary.unit("front_speed_m_per_s") == "m/s"
    with pytest.raises(TypeError, match="a run is not pickled .accepted: .*run.ruptures and run.summary, or run.log"):
        pickle.dumps(default_run)


def test_a_column_outlives_its_run() -> None:
    column = asperity.run(asperity.Scenario("default", SMALL)).events["onset_s"]
    arrow = pa.table(asperity.run(asperity.Scenario("default", SMALL)).events)["onset_s"]
    assert column.tolist() == arrow.to_pylist() and len(column) > 5


def test_an_empty_table_keeps_its_columns() -> None:
    run = asperity.run(asperity.Scenario("default", SMALL, time={"duration_s": 1e-3}))
    assert len(run.ruptures) == 0 and pl.DataFrame(run.ruptures).columns == run.ruptures.columns
    assert run.ruptures["onset_s"].shape == (0,)
    assert "0 rows" in repr(run.ruptures) and "<table>" in run.ruptures._repr_html_()


DENSE = {"recording.rupture_fields_from_blocks": 1, "recording.rupture_fields_s": 1e-7}


@pytest.mark.parametrize("solver", ["fast", "plain"])
def test_a_field_is_that_of_a_run_that_recorded_it(solver: str, tmp_path: Path) -> None:
    scenario = asperity.Scenario("default", SMALL)
    dense = asperity.run(scenario.replace(DENSE), solver=solver, log=tmp_path / "dense.mcap")  # type: ignore[arg-type]
    runs = [
        asperity.run(scenario, solver=solver),  # type: ignore[arg-type]
        asperity.run(scenario, solver=solver, log=tmp_path / "bare.mcap"),  # type: ignore[arg-type]
        asperity.open(tmp_path / "bare.mcap"),
    ]
    widths = dense.ruptures["last_block"].astype(int) - dense.ruptures["first_block"].astype(int)
    number = int(widths.argmax())
    for run in runs:
        assert pl.DataFrame(run.switches).equals(pl.DataFrame(dense.switches))
        for quantity in ("displacement", "velocity", "tangential_force"):
            recorded = dense.field(quantity, rupture=number, every=1e-7)  # type: ignore[arg-type]
            found = run.field(quantity, rupture=number, every=1e-7)  # type: ignore[arg-type]
            assert found.values.shape == recorded.values.shape == (len(found.t), 20)
            assert (found.t == recorded.t).all() and (found.x == recorded.x).all() and (found.steps == recorded.steps).all()
            worst = np.abs(found.values - recorded.values).max()
            assert worst <= (0.0 if solver == "plain" else 1e-12 * np.abs(recorded.values).max())


def test_a_field_agrees_with_the_states_of_the_log(default_run: asperity.Run) -> None:
    states = pl.DataFrame(default_run.states)
    field = default_run.field("displacement", t=(0.0, 0.05), every=0.01)
    assert field.unit == "m" and field.steps.tolist() == [0, *range(1_000_000, 5_000_001, 1_000_000)]
    first = states.filter(pl.col("step") == 0)["displacement_m"].to_numpy()
    np.testing.assert_array_equal(field.values[0], first)
    assert field.x[0] == 0.0 and abs(field.x[-1] - 0.1) < 1e-12


def test_a_field_of_a_long_run_starts_at_a_checkpoint(tmp_path: Path) -> None:
    scenario = asperity.Scenario("default", {"time.duration_s": 25.0})
    log = tmp_path / "long.mcap"
    run = asperity.run(scenario, log=log)
    last = int(run.ruptures["rupture"][-1])
    found = run.field("velocity", rupture=last)
    again = asperity.run(scenario).field("velocity", rupture=last)
    assert found.values.shape == again.values.shape
    assert np.abs(found.values - again.values).max() <= 1e-12 * np.abs(again.values).max()


def test_logs_by_other_code_are_refused_with_the_reason() -> None:
    log = asperity.open(ROOT / "fixtures/logs/complete.mcap")
    assert log.verdict == "by other code or detectors"
    with pytest.raises(asperity.Refused, match="can only be computed by the code that made it"):
        log.field(t=(0.0, 0.1))


def test_nodes_of_a_slab(tmp_path: Path) -> None:
    scenario = asperity.Scenario("slab", {"time.duration_s": 1e-3})
    log = tmp_path / "slab.mcap"
    for run in (asperity.run(scenario), asperity.run(scenario, log=log), asperity.open(log)):
        nodes = run.nodes(5e-4)
        rows, columns = scenario["slider.rows"], scenario["slider.blocks"]
        assert nodes.displacement.shape == nodes.velocity.shape == (2, rows, columns)
        field = run.field("displacement", t=(nodes.t, nodes.t), every=1.0)
        np.testing.assert_allclose(nodes.displacement[0, 0], field.values[0], rtol=1e-12, atol=0)


class Loads:
    """Finds the largest load between slips."""

    name = "largest"

    def __init__(self) -> None:
        self.largest = 0.0
        self.is_over = False

    def observe(self, record: asperity.StepRecord) -> dict[str, float | int | bool | str] | None:
        self.largest = max(self.largest, record.ft_fn)
        if not record.sliding or not record.detached:
            return None
        return {"time_s": record.time_s, "ft_fn": self.largest, "block": record.detached[0], "is_first": record.step < 9}

    def finish(self) -> list[dict[str, str]]:
        self.is_over = True
        return [{"word": "end"}]


def test_a_detector_in_python_finds_the_same_live_and_later(tmp_path: Path) -> None:
    scenario = asperity.Scenario("default", SMALL)
    log = tmp_path / "a.mcap"
    live = asperity.run(scenario, log=log, detectors=[Loads()])
    frames = [
        pl.DataFrame(live.found["largest"]),
        pl.DataFrame(asperity.open(log).detect([Loads()]).found["largest"]),
        pl.DataFrame(asperity.run(scenario).detect([Loads()]).found["largest"]),
    ]
    assert frames[0].columns == ["time_s", "ft_fn", "block", "is_first", "word"]
    assert frames[0].dtypes == [pl.Float64, pl.Float64, pl.Int64, pl.Boolean, pl.String]
    assert frames[0].height > 5 and frames[0]["word"][-1] == "end"
    assert frames[0].equals(frames[1]) and frames[0].equals(frames[2])
    assert live.found["largest"].units == {"time_s": "s", "ft_fn": "1"}
    switches = pl.DataFrame(live.switches).filter(pl.col("direction") == "detach")
    assert set(frames[0]["time_s"].drop_nulls()) <= set(switches["time_s"])


class Fails:
    """Raises at some record."""

    def observe(self, record: asperity.StepRecord) -> None:
        if record.time_s > 0.5:
            raise ZeroDivisionError("a fault of the detector")


def test_an_exception_in_a_detector_ends_the_run_and_its_log_resumes(tmp_path: Path) -> None:
    scenario = asperity.Scenario("default", SMALL)
    log = tmp_path / "a.mcap"
    with pytest.raises(ZeroDivisionError, match="a fault of the detector"):
        asperity.run(scenario, log=log, detectors=[Fails()])
    left = asperity.open(tmp_path / "a.mcap.partial")
    assert left.summary.status == "interrupted"
    assert asperity.resume(log).digest == asperity.run(scenario, log=tmp_path / "b.mcap").digest
    with pytest.raises(ZeroDivisionError):
        asperity.open(log).detect([Fails()])


def test_what_is_no_detector_is_refused() -> None:
    scenario = asperity.Scenario("default", SMALL)
    with pytest.raises(TypeError, match="object with observe"):
        asperity.run(scenario, detectors=[7])  # type: ignore[list-item]
    with pytest.raises(asperity.Refused, match="two detectors are called largest"):
        asperity.run(scenario, detectors=[Loads(), Loads()])

    class Wrong:
        def observe(self, record: asperity.StepRecord) -> int:
            return 7

    with pytest.raises(TypeError, match="Wrong returned 7 .accepted: None, a dict"):
        asperity.run(scenario, detectors=[Wrong()])  # type: ignore[list-item]


def test_a_cell_is_a_value_and_a_column_of_one_kind() -> None:
    scenario = asperity.Scenario("default", SMALL)

    class Once:
        def __init__(self, *rows: object) -> None:
            self.rows = list(rows)

        def observe(self, record: asperity.StepRecord) -> None: ...

        def finish(self) -> object:
            return self.rows

    def table(*rows: object) -> pl.DataFrame:
        return pl.DataFrame(asperity.run(scenario, detectors=Once(*rows)).found["Once"])  # type: ignore[arg-type]

    gaps = table({"a": 1, "x": float("nan")}, {"a": None, "x": np.float64(2)}, {"b": np.int64(3), "w": "word"})
    assert gaps["a"].to_list() == [1, None, None] and gaps["b"].to_list() == [None, None, 3]
    assert np.isnan(gaps["x"][0]) and gaps["x"][1] == 2.0 and gaps["w"].to_list() == [None, None, "word"]
    assert table({"a": 1}, {"a": 2.5})["a"].to_list() == [1.0, 2.5]
    for rows, says in [
        ([{"a": 1}, {"a": "x"}], "column a has values of several kinds"),
        ([{"a": [1, 2]}], "Once: a = "),
        ([{"a": {"b": 1}}], "accepted: a number, a text, a truth value, or None"),
        ([{"a": b"x"}], "accepted: a number"),
        (["word"], "accepted: None, a dict"),
    ]:
        with pytest.raises(TypeError, match=says):
            table(*rows)
    with pytest.raises(UnicodeEncodeError):
        table({"a": "\ud800"})


def test_arrays_of_a_field_and_of_a_table(default_run: asperity.Run) -> None:
    field = default_run.field("velocity", t=np.array([0.0, 0.01]), every=1e-3)
    assert np.asarray(field).ctypes.data == field.values.ctypes.data
    assert np.array(field, dtype=np.float32).shape == field.values.shape
    with pytest.raises(TypeError, match="a table is no array"):
        np.asarray(default_run.events)
    assert "onset_s" in default_run.events and list(default_run.events) == default_run.events.columns


def test_a_field_of_a_fault_line_is_that_of_its_event(tmp_path: Path) -> None:
    run = asperity.run("seas-bp1-qd-coarse", log=tmp_path / "bp1.mcap")
    onset = float(run.ruptures["onset_s"][0])
    field = run.field("displacement", rupture=0, every=1.0)
    assert field.x[0] == 0.0 and field.x[-1] == 39_800.0 and abs(field.t[0] - onset) < 1e-2
    slip = field.values[-1] - field.values[0]
    # Another program has 2.785 m, at the surface.
    assert abs(slip.max() - 2.785) < 2e-3 and slip.argmax() == 0
