"""The message types that can be read, by encoding."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from functools import lru_cache
from typing import Protocol

from kbs_process.errors import RecordingError, SchemaError
from kbs_process.recordings.mcap.framing import MalformedError, Schema
from kbs_process.recordings.mcap.kernels import Bytes, Words
from kbs_process.recordings.mcap.messages.fields import Elements, Field, Step
from kbs_process.recordings.mcap.messages.jsontext import JsonMessage
from kbs_process.recordings.mcap.messages.layout import Decoded
from kbs_process.recordings.mcap.messages.protobuf import ProtobufMessage
from kbs_process.recordings.mcap.messages.ros2 import Ros2Message
from kbs_process.signals.records import Stamps


class Decoder(Protocol):
    """Decodes the messages at `at`, of `size` bytes; `log` is their stamp where they carry none."""

    def __call__(self, buffer: Bytes, at: Words, size: Words, log: Stamps) -> Decoded: ...


class MessageType(Protocol):
    """A message type: the numbers it has, and how to get at them."""

    fields: tuple[Field, ...]

    def decoder(self, steps: tuple[Step, ...]) -> Decoder: ...

    def elements(self, payload: bytes, path: str) -> Elements: ...


Factory = Callable[[Schema, Iterable[bytes]], MessageType]

_TYPES = 64  # that are kept, as thousands of channels may have one


@lru_cache(_TYPES)
def _ros2(schema: Schema) -> MessageType:
    return Ros2Message(schema.name, schema.data.decode())


@lru_cache(_TYPES)
def _protobuf(schema: Schema) -> MessageType:
    return ProtobufMessage(schema.name, schema.data)


FACTORIES: Mapping[tuple[str, str | None], Factory] = {  # message encoding, schema encoding
    ("cdr", "ros2msg"): lambda schema, _: _ros2(schema),
    ("protobuf", "protobuf"): lambda schema, _: _protobuf(schema),
    ("json", None): lambda _, samples: JsonMessage(samples),
}


def message_type(encoding: str, schema: Schema, samples: Iterable[bytes], where: str) -> MessageType:
    """Return the type of a channel's messages; `samples` are some of them, for encodings without schema."""
    factory = FACTORIES.get((encoding, schema.encoding)) or FACTORIES.get((encoding, None))
    if factory is None:
        known = ", ".join(f"{message} with {schema or 'any'} schema" for message, schema in FACTORIES)
        raise RecordingError(
            f"its encoding '{encoding}' with schema '{schema.encoding}' cannot be read",
            where=where,
            remedy=f"record it as {known}",
        )
    try:
        return factory(schema, samples)
    except (MalformedError, UnicodeDecodeError) as error:
        raise SchemaError(f"the schema of {schema.name or 'its messages'} is damaged: {error}", where=where) from error
