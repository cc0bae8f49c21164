"""Writes a run log again with the writer of the `mcap` package, in every form that it offers.

    rewrite.py RUN.mcap FOLDER

Makes FOLDER/FORM.mcap: those whose messages are as they were, and after them those in which one is missing or
changed, whose names begin with `bad-`. Prints the names.
"""

import pathlib
import sys

from mcap.reader import make_reader
from mcap.writer import CompressionType, IndexType, Writer

NONE = {"compression": CompressionType.NONE}
UNCHECKED = {"enable_crcs": False}
BARE = {
    "index_types": IndexType.NONE,
    "repeat_channels": False,
    "repeat_schemas": False,
    "use_statistics": False,
    "use_summary_offsets": False,
}
# What the writer is told, and what is done to what it is given.
FORMS = {
    "zstd": ({}, []),
    "lz4": ({"compression": CompressionType.LZ4}, []),
    "none": (NONE, []),
    "chunks-of-1-kb": ({"chunk_size": 1000}, []),
    "chunks-of-40-mb": ({"chunk_size": 40_000_000}, []),
    "no-chunks": ({"use_chunking": False}, []),
    "no-chunks-no-crc": ({"use_chunking": False, **UNCHECKED, **BARE}, []),
    "no-index": ({"index_types": IndexType.NONE}, []),
    "no-summary": (BARE, []),
    "no-crc": (UNCHECKED, []),
    "no-crc-lz4": ({"compression": CompressionType.LZ4, **UNCHECKED}, []),
    "data-crc": ({"enable_data_crcs": True}, []),
    "sorted": ({}, ["sort"]),
    "metadata-last": ({}, ["metadata last"]),
    "no-numbers": ({}, ["no numbers"]),
    "added-metadata": ({}, ["add metadata"]),
    "added-attachment": ({}, ["add attachment"]),
    "same-header": ({"chunk_size": 4_000_000}, ["same header"]),
    "bad-left-out": ({}, ["leave out /step"]),
    "bad-left-out-event": ({}, ["leave out /events/slip"]),
    "bad-left-out-no-crc": ({**NONE, **UNCHECKED}, ["leave out /switch"]),
    "bad-changed": ({}, ["change /fields"]),
    "bad-changed-load": ({}, ["change /step"]),
    "bad-twice": ({}, ["twice /events/onset"]),
    "bad-order": ({}, ["by topic"]),
    "bad-added-topic": ({}, ["add topic"]),
}


def altered(messages, changes):
    """The messages after the changes, of which the middle one of a topic is the object."""
    for change in changes:
        if change == "sort":
            messages.sort(key=lambda message: message[2].log_time)
        if change == "by topic":
            messages.sort(key=lambda message: message[1].topic)
        verb, _, topic = change.rpartition(" ")
        of = [at for at, (_, channel, _) in enumerate(messages) if channel.topic == topic]
        if not of:
            continue
        at = of[len(of) // 2]
        if verb == "leave out":
            del messages[at]
        if verb == "twice":
            messages.insert(at, messages[at])
        if verb == "change":
            # One digit of a load, or bit of a force, which fits all other messages.
            data = bytearray(messages[at][2].data)
            if messages[at][1].message_encoding == "protobuf":
                data[len(data) // 2] ^= 1
            else:
                place = data.index(b".") + 2
                data[place] = ord("1") if data[place] != ord("1") else ord("2")
            messages[at][2].data = bytes(data)
    return messages


def rewrite(log, out, options, changes):
    with open(log, "rb") as file, open(out, "wb") as stream:
        reader = make_reader(file)
        header = reader.get_header()
        writer = Writer(stream, **options)
        if "same header" in changes:
            writer.start(header.profile, header.library)
        else:
            writer.start()
        others = [(writer.add_metadata, record.name, record.metadata) for record in reader.iter_metadata()]
        for one in reader.iter_attachments():
            others.append((writer.add_attachment, one.create_time, one.log_time, one.name, one.media_type, one.data))
        if "add metadata" in changes:
            others.insert(0, (writer.add_metadata, "lab", {"author": "x"}))
        if "add attachment" in changes:
            others.insert(0, (writer.add_attachment, 1, 2, "photo.png", "image/png", b"png"))
        if "metadata last" not in changes:
            for write, *what in others:
                write(*what)
        schemas, channels = {}, {}
        messages = altered(list(reader.iter_messages(log_time_order=False)), changes)
        for schema, channel, message in messages:
            if schema.id not in schemas:
                schemas[schema.id] = writer.register_schema(schema.name, schema.encoding, schema.data)
            if channel.id not in channels:
                channels[channel.id] = writer.register_channel(
                    channel.topic, channel.message_encoding, schemas[schema.id], channel.metadata
                )
            writer.add_message(
                channels[channel.id],
                message.log_time,
                message.data,
                message.publish_time,
                0 if "no numbers" in changes else message.sequence,
            )
        if "add topic" in changes:
            camera = writer.register_channel("/camera", "json", 0)
            writer.add_message(camera, messages[-1][2].log_time, b"{}", messages[-1][2].log_time)
        if "metadata last" in changes:
            for write, *what in others:
                write(*what)
        writer.finish()


if __name__ == "__main__":
    log, folder = sys.argv[1], pathlib.Path(sys.argv[2])
    for name, (options, changes) in FORMS.items():
        rewrite(log, folder / f"{name}.mcap", options, changes)
        print(name)
