"""Reads a run log with the `mcap` package and its tables with polars.

    check.py RUN.mcap TABLES

Knows the layout that a run log promises and nothing of how asperity writes it.
Exits with a traceback at the first thing that is not as promised.
"""

import collections
import pathlib
import sys

import pandas
import polars
from mcap.reader import make_reader
from messages import fields
from polars.testing import assert_frame_equal

RECORDS = {"/step", "/switch", "/fields", "/window"}
BINARY = {"/fields", "/window"}
EVENTS = {"/events/onset", "/events/slip", "/events/global", "/events/rupture", "/events/arrival"}


def check_log(path):
    with open(path, "rb") as file:
        reader = make_reader(file, validate_crcs=True)
        topics = {channel.topic for channel in reader.get_summary().channels.values()}
        assert topics == RECORDS | EVENTS, topics

        messages = collections.defaultdict(list)
        for schema, channel, message in reader.iter_messages():
            encodings = ("protobuf", "protobuf") if channel.topic in BINARY else ("json", "jsonschema")
            assert (channel.message_encoding, schema.encoding) == encodings and schema.data, channel.topic
            messages[channel.topic].append(fields(schema, channel, message))

        metadata = {record.name: record.metadata for record in reader.iter_metadata()}
        assert set(metadata) == {"run", "run_end"}, set(metadata)
        attachments = [attachment.name for attachment in reader.iter_attachments()]
        assert attachments == ["scenario.toml"], attachments

    end = metadata["run_end"]
    assert end["status"] == "complete", end
    counts = {key.removeprefix("messages:"): int(end[key]) for key in end if key.startswith("messages:")}
    assert set(counts) == topics, counts
    for topic, count in counts.items():
        assert len(messages[topic]) == count, (topic, count, len(messages[topic]))
    assert len(messages["/switch"]) == int(end["switches"])

    # The default slider in ten blocks carries 400 N all the time, and its first
    # event is one of block 1 alone at 0.578954 s.
    assert all(step["normal_load_n"] == 400.0 for step in messages["/step"])
    assert all(len(state["displacement_m"]) == 10 for state in messages["/fields"])
    first = messages["/events/slip"][0]
    assert (first["first_block"], first["last_block"]) == (1, 1), first
    assert abs(first["onset_s"] - 0.578954) < 1e-6, first
    return messages


def check_tables(folder, messages):
    tables = sorted(path.stem for path in folder.glob("*.csv"))
    expected = ["events", "load", "precursor-ruptures", "precursors", "residuals", "ruptures", "summary"]
    assert tables == expected, tables
    # The summary is one row, and has JSON in place of Parquet.
    for name in set(tables) - {"summary"}:
        parquet = polars.read_parquet(folder / f"{name}.parquet")
        csv = polars.read_csv(folder / f"{name}.csv", schema_overrides=parquet.schema)
        assert parquet.height > 0, name
        assert_frame_equal(csv, parquet, check_exact=True)

    events = polars.read_parquet(folder / "events.parquet")
    assert events.to_dicts() == messages["/events/slip"]

    ruptures = polars.read_parquet(folder / "ruptures.parquet")
    logged = messages["/events/rupture"]
    assert ruptures.drop("event", "creeps", "events_mislead").to_dicts() == logged
    onsets = {event["event"]: (event["onset_step"], event["end_step"]) for event in messages["/events/slip"]}
    for rupture in ruptures.iter_rows(named=True):
        first, after = onsets[rupture["event"]]
        assert first <= rupture["onset_step"] and (after is None or rupture["onset_step"] < after), rupture

    # The precursors as the page defines them, and as pandas has them.
    longest, found = 0, []
    for rupture in sorted(logged, key=lambda rupture: rupture["onset_step"]):
        if rupture["first_block"] == 1 and rupture["last_block"] > longest:
            longest = rupture["last_block"]
            found.append((rupture["rupture"], rupture["reached_every_block"]))
    table = pandas.read_csv(folder / "precursor-ruptures.csv")
    assert table.reached_every_block.dtype == bool and table.creeps.dtype == bool, table.dtypes
    assert list(zip(table.rupture, table.reached_every_block)) == found, (table, found)
    assert list(table[~table.reached_every_block].lp_l) == sorted(set(table.lp_l) - {1.0}), table


if __name__ == "__main__":
    check_tables(pathlib.Path(sys.argv[2]), check_log(sys.argv[1]))
