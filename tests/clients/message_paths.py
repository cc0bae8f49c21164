"""Evaluates message paths on a run log, with the parser that `pymcap-cli` uses.

    message_paths.py RUN.mcap PATH...

Prints a JSON list with what each path finds in the first messages of its topic;
null in it stands for a message that the path's filter leaves out. Exits with a
traceback at a path that is not one, or names what is not there.
"""

import json
import sys

from mcap.reader import make_reader
from messages import fields
from ros_parser.message_path import parse_message_path

MESSAGES = 20


def find(log, path):
    path = parse_message_path(path)
    found = []
    with open(log, "rb") as file:
        for one in make_reader(file, validate_crcs=True).iter_messages(topics=[path.topic]):
            found.append(path.apply(fields(*one)))
            if len(found) == MESSAGES:
                break
    return found


if __name__ == "__main__":
    print(json.dumps([find(sys.argv[1], path) for path in sys.argv[2:]]))
