"""Reads exported tables with DuckDB, pandas and polars and holds them against the log.

    exported.py RUN.mcap PARQUET_FOLDER CSV_FOLDER NDJSON_FOLDER

The expected rows are made here from the log's messages, read with the `mcap`
package; every double must be the same to the bit in every format and reader.
Exits with a traceback at the first thing that is not.
"""

import json
import math
import pathlib
import struct
import sys

import duckdb
import pandas
import polars
import pyarrow.parquet
from mcap.reader import make_reader
from messages import fields

# Per block in the log, and so one row per block in a table.
PER_BLOCK = {"/fields", "/window"}


def rows_of(log):
    """The rows that each topic's table must have, and the run's metadata."""
    rows = {}
    with open(log, "rb") as file:
        reader = make_reader(file, validate_crcs=True)
        rows = {channel.topic: [] for channel in reader.get_summary().channels.values()}
        for schema, channel, message in reader.iter_messages():
            message = fields(schema, channel, message)
            if channel.topic not in PER_BLOCK:
                rows[channel.topic].append(message)
                continue
            arrays = {name: values for name, values in message.items() if isinstance(values, list)}
            first = message.get("first_block", 1)
            scalars = {
                name: value
                for name, value in message.items()
                if name not in arrays and name != "first_block"
            }
            for index, values in enumerate(zip(*arrays.values())):
                row = {**scalars, "block": first + index, **dict(zip(arrays, values))}
                if "detached" in row:
                    row["detached"] = row["detached"] == 1
                rows[channel.topic].append(row)
        metadata = {record.name: record.metadata for record in reader.iter_metadata()}
    return rows, metadata["run"]


def same(a, b):
    if a is None or b is None or isinstance(a, (bool, str)):
        return a is b or a == b
    return struct.pack("<d", a) == struct.pack("<d", b)


def hold(what, found, expected):
    """Compares rows as lists of dictionaries."""
    assert len(found) == len(expected), (what, len(found), len(expected))
    for number, (row, wanted) in enumerate(zip(found, expected)):
        assert set(row) == set(wanted), (what, set(row) ^ set(wanted))
        for name, value in wanted.items():
            assert same(row[name], value), (what, number, name, row[name], value)


def gapless(frame):
    """The rows of a pandas frame, with None where it has no value."""
    rows = frame.to_dict("records")
    missing = lambda value: value is pandas.NA or (isinstance(value, float) and math.isnan(value))
    return [{name: None if missing(value) else value for name, value in row.items()} for row in rows]


def duck(query):
    relation = duckdb.sql(query)
    return [dict(zip(relation.columns, row)) for row in relation.fetchall()]


def check(log, parquet, csv, ndjson):
    expected, run = rows_of(log)
    for topic, rows in expected.items():
        name = "run." + topic[1:].replace("/", ".")
        in_parquet, in_csv = parquet / f"{name}.parquet", csv / f"{name}.csv"
        in_ndjson = ndjson / f"{name}.ndjson"
        frame = polars.read_parquet(in_parquet)
        hold(f"polars, Parquet, {topic}", frame.to_dicts(), rows)
        hold(
            f"polars, CSV, {topic}",
            polars.read_csv(in_csv, schema_overrides=frame.schema).to_dicts(),
            rows,
        )
        hold(f"DuckDB, Parquet, {topic}", duck(f"from '{in_parquet}'"), rows)
        hold(f"pandas, Parquet, {topic}", gapless(pandas.read_parquet(in_parquet)), rows)
        units = {column for column in frame.columns if column.endswith(("_m", "_s", "_n", "_fn"))}
        metadata = pyarrow.parquet.read_schema(in_parquet).metadata
        told = json.loads(metadata[b"asperity:units"])
        assert units <= set(told), (topic, units - set(told))
        assert told.get("velocity_m_per_s", "m/s") == "m/s", told
        for key in ["scenario_hash", "run_id", "code_version", "blocks", "steps", "solver"]:
            assert metadata[f"asperity:{key}".encode()].decode() == run[key], key
        assert metadata[b"asperity:log"] == b"whole"
        if not rows:
            continue
        hold(f"DuckDB, CSV, {topic}", duck(f"from read_csv('{in_csv}', sample_size = -1)"), rows)
        hold(f"pandas, CSV, {topic}", gapless(pandas.read_csv(in_csv)), rows)
        with open(in_ndjson) as lines:
            hold(f"NDJSON, {topic}", [json.loads(line) for line in lines], rows)
        hold(f"polars, NDJSON, {topic}", polars.read_ndjson(in_ndjson).select(frame.columns).to_dicts(), rows)


if __name__ == "__main__":
    check(sys.argv[1], *map(pathlib.Path, sys.argv[2:5]))
