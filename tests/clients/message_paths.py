"""Evaluates message paths on a run log, with the parser that `pymcap-cli` uses.

    message_paths.py RUN.mcap PATH...

Prints a JSON list with what each path finds in the first messages of its topic;
null in it stands for a message that the path's filter leaves out. Exits with a
traceback at a path that is not one, or names what is not there.
"""

import json
import sys

from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory
from ros_parser.message_path import parse_message_path

MESSAGES = 20


def find(log, path):
    path = parse_message_path(path)
    found = []
    with open(log, "rb") as file:
        for schema, _, message in make_reader(file, validate_crcs=True).iter_messages(topics=[path.topic]):
            decode = DecoderFactory().decoder_for(schema.encoding, schema)
            if decode is None:
                value = json.loads(message.data)
            else:
                fields = decode(message.data).ListFields()
                value = {field.name: list(value) if hasattr(value, "__len__") else value for field, value in fields}
            found.append(path.apply(value))
            if len(found) == MESSAGES:
                break
    return found


if __name__ == "__main__":
    print(json.dumps([find(sys.argv[1], path) for path in sys.argv[2:]]))
