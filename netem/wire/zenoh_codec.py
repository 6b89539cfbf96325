"""Zenoh's network messages in bytes, as the library 1.x writes them, and back.

    PUSH     = header | key | [qos] | PUT or DEL              REQUEST  = header | number | key | qos, time-out | QUERY
    RESPONSE = header | number | key | qos, who | REPLY or ERR        DECLARE = header | qos | entity | number | key

An integer is written in groups of 7 bits; an extension follows where the flag Z of the header before it says so.

Sources: the layouts in the documentation of eclipse-zenoh/zenoh, commons/zenoh-protocol/src/{network,zenoh} (2024), and
the bytes between two sessions of the library, with which tests/netem/wire/test_zenoh_library_bytes.py compares these.

Decoding raises `MalformedZenohFrame` for any other bytes, and nothing else.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from netem.wire.zenoh_messages import (
    DECLARED,
    ENCODINGS,
    USUAL,
    Data,
    Declare,
    Entity,
    Interest,
    MalformedZenohFrame,
    Message,
    Push,
    Qos,
    Request,
    Response,
    ResponseFinal,
    Stamp,
    Undeclare,
)

_PUSH, _REQUEST, _RESPONSE, _FINAL, _DECLARE, _INTEREST = 0x1D, 0x1C, 0x1B, 0x1A, 0x1E, 0x19      # network messages
_PUT, _DEL, _QUERY, _REPLY, _ERR = 0x01, 0x02, 0x03, 0x04, 0x05       # data messages
_ID = 0x1F                          # bits of a header that number the message
_Z, _HIGH, _LOW = 0x80, 0x40, 0x20  # flags of a header: extensions follow, and two that each message names by itself
_NAMED: Final = _HIGH | _LOW      # of a message with a key: in full, and in the sender's numbers if not
_INT, _BUF, _MANDATORY = 0x20, 0x40, 0x10       # of an extension: an integer, bytes; who cannot read it must not go on
_EVERYTHING: Final = 0x0E           # of an interest: subscribers, queryables and tokens
_CURRENT: Final = _LOW              # of an interest: what is declared now
_OWN_ENCODING: Final = 0xFFFF       # number of an encoding that is not in the table, whose text is the schema
_NUMBER_OF: Final = {name: number for number, name in enumerate(ENCODINGS)}


def encode(message: Message) -> bytes:
    """Return the network message as Zenoh writes it, with its whole key expression."""
    match message:
        case Push():
            qos = [] if message.qos == USUAL else [_qos(message.qos)]
            return (_header(_PUSH, qos, _NAMED) + _key(message.key) + _extended(qos)
                    + _data(message.data))
        case Request():
            return _request(message)
        case Response():
            return _response(message)
        case ResponseFinal():
            return _header(_FINAL, [b""]) + _int(message.number) + _extended([_qos(message.qos)])
        case Declare():
            info = [_INT_INFO] if message.complete else []
            return _DECLARE_HEAD + (_header(message.entity, info, _NAMED) + _int(message.number)
                                    + _key(message.key) + _extended(info))
        case Undeclare():
            key = [] if message.entity is Entity.SUBSCRIBER else [_NO_KEY]
            return _DECLARE_HEAD + _header(message.entity + 1, key) + _int(message.number) + _extended(key)
        case Interest():
            return (_header(_INTEREST, [b""], _LOW) + _int(message.number) + bytes([_EVERYTHING])
                    + _extended([_qos(DECLARED)]))


def _request(message: Request) -> bytes:
    extensions = [_qos(message.qos)]
    if message.target:
        extensions.append((_INT | _MANDATORY | 4, _int(message.target)))
    extensions.append((_INT | 6, _int(message.timeout_ms)))
    inner: list[tuple[int, bytes]] = []
    if message.payload is not None:
        inner.append((_BUF | 3, _sized(_encoding(message.encoding) + message.payload)))
    if message.attachment is not None:
        inner.append((_BUF | 5, _sized(message.attachment)))
    flags = (_LOW if message.consolidation else 0) | (_HIGH if message.parameters else 0)
    return (_header(_REQUEST, extensions, _NAMED) + _int(message.number) + _key(message.key)
            + _extended(extensions) + _header(_QUERY, inner, flags)
            + (_int(message.consolidation) if message.consolidation else b"")
            + (_sized(message.parameters.encode()) if message.parameters else b"") + _extended(inner))


def _response(message: Response) -> bytes:
    who = bytes([(len(message.session) - 1) << 4]) + message.session + _int(message.entity)
    extensions = [_qos(message.qos), (_BUF | 3, _sized(who))]
    head = (_header(_RESPONSE, extensions, _NAMED) + _int(message.number) + _key(message.key)
            + _extended(extensions))
    if not message.error:
        return head + bytes([_REPLY]) + _data(message.data)
    encoding = b"" if message.data.encoding == ENCODINGS[0] else _encoding(message.data.encoding)
    return head + bytes([_ERR | (_HIGH if encoding else 0)]) + encoding + _sized(message.data.payload)


def _data(data: Data) -> bytes:
    stamp = b"" if data.stamp is None else _int(data.stamp.ntp64) + _sized(data.stamp.clock)
    attachment = [] if data.attachment is None else [(_BUF | (2 if data.deletes else 3), _sized(data.attachment))]
    flags = _LOW if stamp else 0
    if data.deletes:
        return _header(_DEL, attachment, flags) + stamp + _extended(attachment)
    encoding = b"" if data.encoding == ENCODINGS[0] else _encoding(data.encoding)
    return (_header(_PUT, attachment, flags | (_HIGH if encoding else 0)) + stamp + encoding + _extended(attachment)
            + _sized(data.payload))


def _header(number: int, extensions: Sequence[object], flags: int = 0) -> bytes:
    return bytes([number | flags | (_Z if extensions else 0)])


def _extended(extensions: Sequence[tuple[int, bytes]]) -> bytes:
    """Return the extensions, each with the flag whether another one follows."""
    last = len(extensions) - 1
    return b"".join(bytes([head | (_Z if index < last else 0)]) + body
                    for index, (head, body) in enumerate(extensions))


def _qos(qos: Qos) -> tuple[int, bytes]:
    return _INT | 1, bytes([qos.priority | (8 if qos.block else 0) | (16 if qos.express else 0)])


def _encoding(name: str) -> bytes:
    prefix, separator, schema = name.partition(";")
    number = _NUMBER_OF.get(prefix)
    if number is None:
        number, separator, schema = _OWN_ENCODING, ";", name
    return _int(number << 1 | (1 if separator else 0)) + (_sized(schema.encode()) if separator else b"")


def _key(key: str) -> bytes:
    """Return a key expression that refers to no declared one."""
    return b"\0" + _sized(key.encode())


def _sized(data: bytes) -> bytes:
    return _int(len(data)) + data


def _int(value: int) -> bytes:
    """Return `value` < 2**64 in groups of 7 bits, the lowest first; a ninth byte holds 8 bits."""
    out = bytearray()
    while value > 0x7F and len(out) < 8:
        out.append(value & 0x7F | 0x80)
        value >>= 7
    out.append(value)
    return bytes(out)


_DECLARE_HEAD: Final = bytes([_DECLARE | _Z]) + _extended([_qos(DECLARED)])
_INT_INFO: Final = (_INT | 1, b"\1")                            # a queryable is complete
_NO_KEY: Final = (_BUF | _MANDATORY | 15, b"\2\0\0")            # the key expression of an undeclaration, left out


# --- bytes to network messages

class _Reader:
    """Reads the bytes of one batch; every method raises MalformedZenohFrame if they are not there."""

    def __init__(self, data: bytes) -> None:
        self._data = data
        self._at = 0

    @property
    def ended(self) -> bool:
        return self._at >= len(self._data)

    def byte(self) -> int:
        if self._at >= len(self._data):
            raise MalformedZenohFrame("it ends within a message")
        self._at += 1
        return self._data[self._at - 1]

    def number(self, most: int = 2**64 - 1) -> int:
        value = 0
        for shift in range(0, 64, 7):
            byte = self.byte()
            if shift == 56:
                value |= byte << shift
                break
            value |= (byte & 0x7F) << shift
            if byte < 0x80:
                break
        if value > most:
            raise MalformedZenohFrame(f"the number {value}, expected at most {most}")
        return value

    def take(self, length: int) -> bytes:
        if length > len(self._data) - self._at:
            raise MalformedZenohFrame(f"it ends within a field of {length} bytes")
        self._at += length
        return self._data[self._at - length:self._at]

    def sized(self) -> bytes:
        return self.take(self.number())

    def rest(self) -> bytes:
        return self.take(len(self._data) - self._at)

    def text(self) -> str:
        return _text(self.sized())

    def key(self, header: int) -> str:
        if self.number() or not header & _LOW:
            raise MalformedZenohFrame("a key expression that refers to a declared one")
        return self.text()

    def encoding(self) -> str:
        number = self.number(2 * _OWN_ENCODING + 1)
        schema = self.text() if number & 1 else ""
        number >>= 1
        if number == _OWN_ENCODING:
            return schema
        if number >= len(ENCODINGS):
            raise MalformedZenohFrame(f"encoding number {number}")
        return f"{ENCODINGS[number]};{schema}" if schema else ENCODINGS[number]

    def stamp(self) -> Stamp:
        ntp64, clock = self.number(), self.sized()
        if not 1 <= len(clock) <= 16:
            raise MalformedZenohFrame(f"a clock's identifier of {len(clock)} bytes")
        return Stamp(ntp64, clock)

    def extensions(self, header: int, known: Sequence[int]) -> dict[int, bytes | int]:
        """Return the known extensions by number; skip others, unless they are mandatory."""
        found: dict[int, bytes | int] = {}
        more = bool(header & _Z)
        while more:
            head = self.byte()
            more = bool(head & _Z)
            kind = head & (_INT | _BUF)
            value: bytes | int = self.sized() if kind == _BUF else self.number() if kind == _INT else 0
            if kind == _INT | _BUF:
                raise MalformedZenohFrame("an extension of an unknown form")
            number = head & (_INT | _BUF | 0x0F)
            if number in known:
                found[number] = value
            elif head & _MANDATORY:
                raise MalformedZenohFrame(f"mandatory extension {head & 0x0F} is not known")
        return found


_QOS: Final = _INT | 1


def decode(batch: bytes) -> list[Message]:
    """Return the network messages of a batch; raises MalformedZenohFrame."""
    reader = _Reader(batch)
    messages: list[Message] = []
    while not reader.ended:
        header = reader.byte()
        read = _READ.get(header & _ID)
        if read is None:
            raise MalformedZenohFrame(f"network message {header & _ID:#x}")
        messages.append(read(reader, header))
    return messages


def _read_push(reader: _Reader, header: int) -> Message:
    key = reader.key(header)
    extensions = reader.extensions(header, (_QOS,))
    return Push(key, _read_data(reader), _read_qos(extensions))


def _read_request(reader: _Reader, header: int) -> Message:
    number, key = reader.number(2**32 - 1), reader.key(header)
    extensions = reader.extensions(header, (_QOS, _INT | 4, _INT | 6))
    target, timeout_ms = int(extensions.get(_INT | 4, 0)), int(extensions.get(_INT | 6, 10_000))
    query = reader.byte()
    if query & _ID != _QUERY or target > 2:
        raise MalformedZenohFrame(f"a request for {query & _ID:#x} with target {target}")
    consolidation = reader.number(3) if query & _LOW else 0
    parameters = reader.text() if query & _HIGH else ""
    inner = reader.extensions(query, (_BUF | 3, _BUF | 5))
    payload, encoding = None, ENCODINGS[0]
    if (value := inner.get(_BUF | 3)) is not None:
        body = _Reader(bytes(value))
        encoding = body.encoding()
        payload = body.rest()
    attachment = inner.get(_BUF | 5)
    return Request(number, key, parameters, target, consolidation, timeout_ms, payload, encoding,
                   None if attachment is None else bytes(attachment), _read_qos(extensions))


def _read_response(reader: _Reader, header: int) -> Message:
    number, key = reader.number(2**32 - 1), reader.key(header)
    extensions = reader.extensions(header, (_QOS, _BUF | 3))
    session, entity = b"\0", 0
    if (who := extensions.get(_BUF | 3)) is not None:
        inner = _Reader(bytes(who))
        session = inner.take((inner.byte() >> 4) + 1)
        entity = inner.number(2**32 - 1)
    qos = _read_qos(extensions)
    body = reader.byte()
    if body & _ID == _REPLY:
        if body & _LOW:
            reader.number(3)           # consolidation, of which the receiver decides
        reader.extensions(body, ())
        return Response(number, key, _read_data(reader), session, entity, qos=qos)
    if body & _ID != _ERR:
        raise MalformedZenohFrame(f"a response with {body & _ID:#x}")
    encoding = reader.encoding() if body & _HIGH else ENCODINGS[0]
    reader.extensions(body, ())
    return Response(number, key, Data(reader.sized(), encoding), session, entity, error=True, qos=qos)


def _read_final(reader: _Reader, header: int) -> Message:
    number = reader.number(2**32 - 1)
    return ResponseFinal(number, _read_qos(reader.extensions(header, (_QOS,))))


def _read_declare(reader: _Reader, header: int) -> Message:
    if header & _LOW:
        reader.number(2**32 - 1)       # number of the interest that is answered
    reader.extensions(header, (_QOS,))
    body = reader.byte()
    kind, number = body & _ID, reader.number(2**32 - 1)
    if kind in tuple(Entity):
        key = reader.key(body)
        info = int(reader.extensions(body, (_INT | 1,)).get(_INT | 1, 0))
        return Declare(Entity(kind), number, key, kind == Entity.QUERYABLE and bool(info & 1))
    if kind - 1 in tuple(Entity):
        reader.extensions(body, (_BUF | 15,))
        return Undeclare(Entity(kind - 1), number)
    raise MalformedZenohFrame(f"declaration {kind:#x}")


def _read_interest(reader: _Reader, header: int) -> Message:
    number, options = reader.number(2**32 - 1), reader.byte()
    if header & (_LOW | _HIGH) != _CURRENT or options != _EVERYTHING:
        raise MalformedZenohFrame("an interest in other than all that is declared now")
    reader.extensions(header, (_QOS,))
    return Interest(number)


def _read_data(reader: _Reader) -> Data:
    header = reader.byte()
    kind = header & _ID
    stamp = reader.stamp() if header & _LOW else None
    if kind == _DEL:
        attachment = reader.extensions(header, (_BUF | 2,)).get(_BUF | 2)
        return Data(attachment=None if attachment is None else bytes(attachment), stamp=stamp, deletes=True)
    if kind != _PUT:
        raise MalformedZenohFrame(f"data message {kind:#x}")
    encoding = reader.encoding() if header & _HIGH else ENCODINGS[0]
    attachment = reader.extensions(header, (_BUF | 3,)).get(_BUF | 3)
    return Data(reader.sized(), encoding, None if attachment is None else bytes(attachment), stamp)


def _read_qos(extensions: dict[int, bytes | int]) -> Qos:
    value = int(extensions.get(_QOS, 5))
    return Qos(value & 7, bool(value & 8), bool(value & 16))


def _text(data: bytes) -> str:
    try:
        return data.decode()
    except UnicodeDecodeError:
        raise MalformedZenohFrame("text that is not UTF-8") from None


_READ: Final = {_PUSH: _read_push, _REQUEST: _read_request, _RESPONSE: _read_response, _FINAL: _read_final,
                _DECLARE: _read_declare, _INTEREST: _read_interest}
