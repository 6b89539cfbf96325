"""Reads a folder of certificates (certificates.py) for people: whose each is, until when it is valid, what is wrong."""

from __future__ import annotations

import stat
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Final, Literal

from netem.gateways.certificates import AUTHORITY, EMULATOR

if TYPE_CHECKING:
    from cryptography import x509

LONGEST_FILE: Final = 1 << 20       # bytes
_UNREADABLE: Final = Exception       # cryptography's errors about what is in a file have no base of their own
State = Literal["valid", "expired", "not valid yet"]


@dataclass(frozen=True)
class Row:
    """One certificate. `ours`: whether the authority of the folder signed it; None if that cannot be told."""

    name: str
    kind: Literal["authority", "emulator", "client"]
    addresses: Sequence[str]
    begins: datetime
    ends: datetime
    state: State
    ours: bool | None
    has_key: bool


@dataclass
class Table:
    rows: list[Row] = field(default_factory=list)
    problems: list[str] = field(default_factory=list)       # one line each, with the remedy


def read_table(folder: Path) -> Table:
    """Return a row for each certificate in `folder`. Raises FileNotFoundError or NotADirectoryError if it is none."""
    if not folder.is_dir():
        kind = NotADirectoryError if folder.exists() else FileNotFoundError
        raise kind(f"{folder}: {'is a file' if folder.exists() else 'there is no such folder'}; name a folder of "
                   "certificates, or make one with marconet certificates new")
    table, reader = Table(), _Reader(folder)
    for path in sorted(folder.glob("*.crt"), key=_authority_first):
        try:
            table.rows.append(reader.row(path))
        except ValueError as error:
            table.problems.append(str(error))
    table.problems += reader.problems()
    if not reader.authority_path.exists():
        table.problems.append(f"{reader.authority_path}: is missing; copy it from the folder in which the certificates "
                              f"were made, or make new ones with marconet certificates new {folder}")
    return table


def addresses_in(path: Path) -> Sequence[str]:
    """Return the addresses that the emulator's certificate in `path` names; none if it cannot be read."""
    try:
        return _addresses(_certificate(path))
    except _UNREADABLE:
        return ()


class _Reader:
    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self.authority_path = folder / f"{AUTHORITY}.crt"
        try:
            self._authority: x509.Certificate | None = _certificate(self.authority_path)
        except _UNREADABLE:
            self._authority = None          # `row` tells why
        self._read: dict[str, tuple[x509.Certificate, Row]] = {}

    def row(self, path: Path) -> Row:
        """Raises ValueError, with the remedy, if `path` is no certificate."""
        try:
            certificate = _certificate(path)
            addresses = _addresses(certificate)
        except _UNREADABLE as error:
            why = f"cannot be read: {error.strerror}" if isinstance(error, OSError) else "is no certificate in PEM text"
            raise ValueError(f"{path}: {why}; {self._remedy(path.stem)}") from None
        name = path.stem
        row = Row(name, AUTHORITY if name == AUTHORITY else EMULATOR if name == EMULATOR else "client",
                  addresses if name == EMULATOR else (), certificate.not_valid_before_utc,
                  certificate.not_valid_after_utc, _state(certificate), self._ours(certificate),
                  path.with_suffix(".key").exists())
        self._read[name] = certificate, row
        return row

    def problems(self) -> Iterator[str]:
        """Yield what is wrong with the certificates that were read, and with keys."""
        for name, (certificate, row) in self._read.items():
            path = self._folder / f"{name}.crt"
            if row.state == "expired":
                yield f"{path}: expired on {_day(row.ends)}; {self._remedy(name)}"
            if row.state == "not valid yet":
                yield f"{path}: is valid from {_day(row.begins)} on; set the clock of this machine"
            if row.ours is False:
                yield f"{path}: is signed by another authority than {AUTHORITY}.crt; {self._remedy(name)}"
            found = _common_name(certificate)
            if row.kind != AUTHORITY and found != name:
                yield f"{path}: its common name is {found!r}, expected the name of the file; {self._remedy(name)}"
        for path in sorted(self._folder.glob("*.key"), key=_authority_first):
            yield from self._of_key(path)

    def _of_key(self, path: Path) -> Iterator[str]:
        from cryptography.hazmat.primitives.serialization import load_pem_private_key

        name = path.stem
        try:
            if stat.S_IMODE(path.stat().st_mode) & 0o077:
                yield f"{path}: other users of this machine may read it; chmod 600 {path}"
            key = load_pem_private_key(_bytes(path), None).public_key()
        except OSError as error:
            yield f"{path}: cannot be read: {error.strerror}; show the folder as its owner"
            return
        except _UNREADABLE:
            yield f"{path}: is no private key in PEM text without a password; {self._remedy(name)}"
            return
        if name not in self._read:
            if not path.with_suffix(".crt").exists():
                yield f"{path}: belongs to no certificate, as {name}.crt is missing; put it back or delete the key"
        elif key != self._read[name][0].public_key():
            yield f"{path}: does not belong to {name}.crt; {self._remedy(name)}"

    def _ours(self, certificate: x509.Certificate) -> bool | None:
        if self._authority is None:
            return None
        try:
            certificate.verify_directly_issued_by(self._authority)
        except _UNREADABLE:
            return False
        return True

    def _remedy(self, name: str) -> str:
        if name == AUTHORITY:
            return "make a new folder with marconet certificates new"
        more = "" if name == EMULATOR else f" {name}"
        return f"make a new one with marconet certificates new {self._folder}{more} --overwrite"


def _bytes(path: Path) -> bytes:
    with path.open("rb") as file:
        return file.read(LONGEST_FILE)


def _certificate(path: Path) -> x509.Certificate:
    from cryptography import x509

    certificate = x509.load_pem_x509_certificate(_bytes(path))
    certificate.public_key()            # raises for a kind that the library does not know
    return certificate


def _common_name(certificate: x509.Certificate) -> str:
    from cryptography.x509.oid import NameOID

    found = certificate.subject.get_attributes_for_oid(NameOID.COMMON_NAME)
    return str(found[0].value) if len(found) == 1 else ""


def _addresses(certificate: x509.Certificate) -> Sequence[str]:
    from cryptography import x509

    try:
        names = certificate.extensions.get_extension_for_class(x509.SubjectAlternativeName).value
    except x509.ExtensionNotFound:
        return ()
    found = [str(name.value) for name in names if isinstance(name, x509.DNSName | x509.IPAddress)]
    return [address for address in found if address != EMULATOR]


def _state(certificate: x509.Certificate) -> State:
    now = datetime.now(UTC)
    if now > certificate.not_valid_after_utc:
        return "expired"
    return "valid" if now >= certificate.not_valid_before_utc else "not valid yet"


def _authority_first(path: Path) -> tuple[bool, bool, str]:
    return path.stem != AUTHORITY, path.stem != EMULATOR, path.stem


def _day(instant: datetime) -> str:
    return f"{instant:%Y-%m-%d}"
