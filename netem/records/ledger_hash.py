"""The hash of a run's frame copies: BLAKE2b (RFC 7693) over the rows as MessagePack, one after the other.

Every row is an array of its columns in order: text as str, times and counts as the shortest int, the digest as bin. The
stream starts with the array of column names. Rows are encoded in chunks whose array headers are not hashed, so the hash
does not depend on the chunks: it is that of the concatenated rows.
"""

from __future__ import annotations

from collections.abc import Sequence
from hashlib import blake2b
from typing import Any

import msgspec

DIGEST_BYTES = 16


class LedgerHash:
    def __init__(self, columns: Sequence[str]) -> None:
        self._encoder = msgspec.msgpack.Encoder()
        self._hash = blake2b(self._encoder.encode(tuple(columns)), digest_size=DIGEST_BYTES)

    def add(self, rows: Sequence[tuple[Any, ...]]) -> bytes:
        """Add rows to the hash; return them as the MessagePack array that was hashed."""
        encoded = self._encoder.encode(rows)
        self._hash.update(memoryview(encoded)[array_header_bytes(len(rows)):])
        return encoded

    def hex(self) -> str:
        return self._hash.hexdigest()


def array_header_bytes(items: int) -> int:
    """Return the length of MessagePack's array header: fixarray, array 16, array 32."""
    return 1 if items < 1 << 4 else 3 if items < 1 << 16 else 5
