"""Reads a run log with the `mcap` package, every CRC checked, and prints what it found.

    read_log.py RUN.mcap FROM_NS TO_NS

Prints one JSON object: messages per topic after the log's statistics, the status
that the metadata record `run_end` gives, the last message of each topic as JSON,
and the same for /step and /fields in a range of time. A log without a summary is
streamed instead, up to where it ends. Exits with a traceback at the first thing
that is not MCAP as it should be.
"""

import json
import sys

from mcap.exceptions import EndOfFile, InvalidMagic, RecordLengthLimitExceeded
from mcap.reader import NonSeekingReader, make_reader
from messages import fields


def take(messages):
    found = {}
    for schema, channel, message in messages:
        entry = found.setdefault(channel.topic, {"count": 0})
        entry["count"] += 1
        entry["last"] = json.dumps(fields(schema, channel, message))
    return found


def indexed(file, from_ns, to_ns):
    reader = make_reader(file, validate_crcs=True)
    summary = reader.get_summary()
    counts = summary.statistics.channel_message_counts
    metadata = {record.name: record.metadata for record in reader.iter_metadata()}
    return {
        "counts": {channel.topic: counts.get(id, 0) for id, channel in summary.channels.items()},
        "attachments": [attachment.name for attachment in reader.iter_attachments()],
        "status": metadata.get("run_end", {}).get("status"),
        "all": take(reader.iter_messages()),
        "slice": take(reader.iter_messages(["/step", "/fields"], starting_at=from_ns, ending_before=to_ns)),
    }


def streamed(file):
    found = {"streamed": True, "done": False, "status": None, "all": {}}
    messages = NonSeekingReader(file, validate_crcs=True).iter_messages(log_time_order=False)
    try:
        for schema, channel, message in messages:
            entry = found["all"].setdefault(channel.topic, {"count": 0})
            entry["count"] += 1
            entry["last"] = json.dumps(fields(schema, channel, message))
        found["done"] = True
    except EndOfFile as error:
        found["ended"] = repr(error)
    return found


if __name__ == "__main__":
    path, from_ns, to_ns = sys.argv[1], int(sys.argv[2]), int(sys.argv[3])
    with open(path, "rb") as file:
        try:
            found = indexed(file, from_ns, to_ns)
        # A log that was cut off ends in the middle of a message, which is read as a
        # footer: it can be taken for anything.
        except (EndOfFile, InvalidMagic, RecordLengthLimitExceeded) as error:
            file.seek(0)
            found = {**streamed(file), "refused": repr(error)}
    print(json.dumps(found))
