"""The messages of run logs by the names of their fields."""

import json

from mcap_protobuf.decoder import DecoderFactory

BINARY = DecoderFactory()


def fields(schema, channel, message):
    """The fields of a message: of JSON, or by the descriptor in the log, with bytes as numbers and no empty arrays."""
    decode = BINARY.decoder_for(channel.message_encoding, schema)
    if decode is None:
        return json.loads(message.data)
    decoded = decode(message.data)
    values = {field.name: getattr(decoded, field.name) for field in decoded.DESCRIPTOR.fields}
    listed = {name: list(value) if hasattr(value, "__len__") else value for name, value in values.items()}
    return {name: value for name, value in listed.items() if value != []}
