"""Makes the certificates of a folder (certificates.py): an authority, the emulator's, one for each client.

    authority.key --signs--> authority.crt, emulator.crt, NAME.crt          each with a key of its own, EC P-256

`authority.key` is needed to add names only. It may be moved to a safe place afterwards; no door reads it.
A certificate is valid from a day before it was made, so that a machine whose clock is behind accepts it.
"""

from __future__ import annotations

import os
import re
import secrets
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from ipaddress import ip_address
from pathlib import Path
from typing import TYPE_CHECKING, Final

from netem.gateways.certificates import AUTHORITY, EMULATOR, LONGEST_NAME

if TYPE_CHECKING:
    from cryptography import x509
    from cryptography.hazmat.primitives.asymmetric.ec import EllipticCurvePrivateKey

LOOPBACK: Final = ("127.0.0.1", "::1", "localhost")
AUTHORITY_DAYS: Final = 3650
CLOCK_BEHIND: Final = timedelta(days=1)
MOST_DAYS: Final = 36500
_NAME: Final = re.compile(r"[A-Za-z][A-Za-z0-9_-]*")
_HOST: Final = re.compile(r"(?!-)[A-Za-z0-9-]{1,63}(\.(?!-)[A-Za-z0-9-]{1,63})*\.?")


class NotMade(ValueError):
    """Certificates cannot be made; the text has a line for each reason, with what to do."""

    exit_code = 2


@dataclass(frozen=True)
class Made:
    """`names` have a certificate and a key that are new; `addresses` are those of the emulator's, if it is new."""

    names: Sequence[str]
    addresses: Sequence[str]
    until: datetime


def make_certificates(folder: Path, names: Sequence[str], addresses: Sequence[str] = (), *, days: int = 365,
                      overwrite: bool = False) -> Made:
    """Make in `folder` what is missing of the authority's, the emulator's and each name's.

    `addresses` are IP addresses and host names of the emulator. With `overwrite` the certificates of the names
    that are there are replaced, and the emulator's if it has other addresses or no name is given.
    """
    names = list(dict.fromkeys(names))
    problems = [*_wrong_names(names), *_wrong_addresses(addresses), *_wrong_days(days)]
    if folder.exists() and not folder.is_dir():
        problems.append(f"{folder}: is a file; name a folder, or a path where one can be made")
    if problems:
        raise NotMade("\n".join(problems))
    wanted = list(names)
    if not (folder / f"{EMULATOR}.crt").exists() or addresses or (overwrite and not names):
        wanted.insert(0, EMULATOR)
    taken = [] if overwrite else [f"{name}{end}" for name in wanted for end in (".crt", ".key")
                                  if (folder / f"{name}{end}").exists()]
    if taken:
        raise NotMade(f"{folder}: {_listed(taken)} already there; --overwrite replaces what is named")
    if not wanted:
        raise NotMade(f"{folder}: has an authority and the emulator's certificate; name the clients that get "
                      "certificates, as in r1 operator")
    authority = _Authority.of(folder, days)
    now = datetime.now(UTC)
    until = now + timedelta(days=days)
    if until > authority.until:
        raise NotMade(f"--days {days}: the authority in {folder} ends on {authority.until:%Y-%m-%d}, in "
                      f"{(authority.until - now).days} days; name fewer days, or another folder with a new authority")
    named = _addresses_of(addresses, folder)
    made = {name: authority.issue(name, named if name == EMULATOR else (), until) for name in wanted}
    if authority.new:
        made = {AUTHORITY: authority.pems(), **made}
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        for name, (certificate, key) in made.items():
            _write(folder / f"{name}.key", key, 0o600)
            _write(folder / f"{name}.crt", certificate, 0o644)
    except OSError as error:
        raise NotMade(f"{folder}: cannot be written: {error.strerror}; name a folder in which you may write") from None
    return Made(list(made), named if EMULATOR in made else (), until)


@dataclass(frozen=True)
class _Authority:
    certificate: x509.Certificate
    key: EllipticCurvePrivateKey
    new: bool

    @classmethod
    def of(cls, folder: Path, days: int) -> _Authority:
        """Return the authority in `folder`, a new one if there is none. Raises NotMade if it cannot sign."""
        paths = certificate, key = folder / f"{AUTHORITY}.crt", folder / f"{AUTHORITY}.key"
        there = [path.exists() for path in paths]
        if not any(there):
            return cls._made(max(days, AUTHORITY_DAYS) + 1)
        if not there[1]:
            raise NotMade(f"{key}: is missing, and without it no name can be added; put it back for this command, or "
                          "name another folder for a new authority")
        if not there[0]:
            raise NotMade(f"{certificate}: is missing; put it back, or name another folder for a new authority")
        return cls._read(certificate, key)

    @classmethod
    def _read(cls, certificate: Path, key: Path) -> _Authority:
        from cryptography import x509
        from cryptography.hazmat.primitives.asymmetric.ec import EllipticCurvePrivateKey
        from cryptography.hazmat.primitives.serialization import load_pem_private_key

        try:
            read = x509.load_pem_x509_certificate(certificate.read_bytes())
        except Exception:                   # the library's errors about a file have no base of their own
            raise NotMade(f"{certificate}: is no certificate in PEM text; put the right one back, or name another "
                          "folder for a new authority") from None
        try:
            own = load_pem_private_key(key.read_bytes(), None)
        except Exception:
            raise NotMade(f"{key}: is no private key in PEM text without a password; put the right one back, or name "
                          "another folder for a new authority") from None
        if not isinstance(own, EllipticCurvePrivateKey) or own.public_key() != read.public_key():
            raise NotMade(f"{key}: does not belong to {certificate.name}; put the right one back, or name another "
                          "folder for a new authority")
        return cls(read, own, new=False)

    @classmethod
    def _made(cls, days: int) -> _Authority:
        from cryptography import x509
        from cryptography.hazmat.primitives import hashes
        from cryptography.hazmat.primitives.asymmetric import ec

        key = ec.generate_private_key(ec.SECP256R1())
        name = _subject(f"marconet authority {secrets.token_hex(4)}")
        certificate = _builder(name, name, key, datetime.now(UTC) + timedelta(days=days)).add_extension(
            x509.BasicConstraints(ca=True, path_length=0), critical=True).add_extension(
            _usage(signs_certificates=True), critical=True)
        return cls(certificate.sign(key, hashes.SHA256()), key, new=True)

    @property
    def until(self) -> datetime:
        return self.certificate.not_valid_after_utc

    def pems(self) -> tuple[bytes, bytes]:
        return _pems(self.certificate, self.key)

    def issue(self, name: str, addresses: Sequence[str], until: datetime) -> tuple[bytes, bytes]:
        """Return certificate and key of the emulator, which has these addresses, or of a client, as PEM text."""
        from cryptography import x509
        from cryptography.hazmat.primitives import hashes
        from cryptography.hazmat.primitives.asymmetric import ec
        from cryptography.x509.oid import ExtendedKeyUsageOID

        key = ec.generate_private_key(ec.SECP256R1())
        purpose = ExtendedKeyUsageOID.SERVER_AUTH if name == EMULATOR else ExtendedKeyUsageOID.CLIENT_AUTH
        builder = _builder(_subject(name), self.certificate.subject, key, until).add_extension(
            x509.BasicConstraints(ca=False, path_length=None), critical=True).add_extension(
            _usage(signs_certificates=False), critical=True).add_extension(
            x509.ExtendedKeyUsage([purpose]), critical=False).add_extension(
            x509.AuthorityKeyIdentifier.from_issuer_public_key(self.key.public_key()), critical=False).add_extension(
            x509.SubjectAlternativeName([x509.DNSName(name), *map(_general_name, addresses)]), critical=False)
        return _pems(builder.sign(self.key, hashes.SHA256()), key)


def _builder(subject: x509.Name, issuer: x509.Name, key: EllipticCurvePrivateKey,
             until: datetime) -> x509.CertificateBuilder:
    from cryptography import x509

    return x509.CertificateBuilder(
        subject_name=subject, issuer_name=issuer, public_key=key.public_key(),
        serial_number=x509.random_serial_number()).not_valid_before(
        datetime.now(UTC) - CLOCK_BEHIND).not_valid_after(until).add_extension(
        x509.SubjectKeyIdentifier.from_public_key(key.public_key()), critical=False)


def _subject(name: str) -> x509.Name:
    from cryptography import x509
    from cryptography.x509.oid import NameOID

    return x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, name)])


def _usage(*, signs_certificates: bool) -> x509.KeyUsage:
    from cryptography import x509

    return x509.KeyUsage(
        digital_signature=not signs_certificates, key_cert_sign=signs_certificates, crl_sign=signs_certificates,
        content_commitment=False, key_encipherment=False, data_encipherment=False, key_agreement=False,
        encipher_only=False, decipher_only=False)


def _general_name(address: str) -> x509.GeneralName:
    from cryptography import x509

    try:
        return x509.IPAddress(ip_address(address))
    except ValueError:
        return x509.DNSName(address)


def _pems(certificate: x509.Certificate, key: EllipticCurvePrivateKey) -> tuple[bytes, bytes]:
    from cryptography.hazmat.primitives import serialization

    return (certificate.public_bytes(serialization.Encoding.PEM),
            key.private_bytes(serialization.Encoding.PEM, serialization.PrivateFormat.PKCS8,
                              serialization.NoEncryption()))


def _write(path: Path, text: bytes, mode: int) -> None:
    """Put the file there whole, so that a reader never finds a part, and a key is never readable by others."""
    new = path.with_name(f"{path.name}.new")
    new.unlink(missing_ok=True)
    with os.fdopen(os.open(new, os.O_WRONLY | os.O_CREAT | os.O_EXCL, mode), "wb") as file:
        file.write(text)
    new.replace(path)


def _addresses_of(addresses: Sequence[str], folder: Path) -> Sequence[str]:
    """Return the addresses that the emulator's certificate gets: these, those that it had, or the loopback's."""
    from netem.gateways.certificate_table import addresses_in

    return [*dict.fromkeys(addresses)] or addresses_in(folder / f"{EMULATOR}.crt") or LOOPBACK


def _wrong_names(names: Sequence[str]) -> list[str]:
    return [f"{name}: is the name of a file that every folder of certificates has; name the client otherwise"
            if name in (AUTHORITY, EMULATOR) else
            f"{name!r}: a name has letters, digits, - and _, starts with a letter, and has at most {LONGEST_NAME} "
            "characters; name the client so" for name in names
            if name in (AUTHORITY, EMULATOR) or not _NAME.fullmatch(name) or len(name) > LONGEST_NAME]


def _wrong_addresses(addresses: Sequence[str]) -> list[str]:
    return [f"--address {address}: expected an IP address or a host name without a port, as 192.168.1.5 or base.local"
            for address in addresses if not _is_address(address)]


def _is_address(address: str) -> bool:
    try:
        return not ip_address(address).is_unspecified
    except ValueError:
        return (_HOST.fullmatch(address) is not None and len(address) < 254
                and not address.replace(".", "").isdigit())


def _wrong_days(days: int) -> list[str]:
    return [] if 1 <= days <= MOST_DAYS else [f"--days {days}: expected 1 to {MOST_DAYS} days"]


def _listed(files: Sequence[str]) -> str:
    return f"{files[0]} is" if len(files) == 1 else f"{', '.join(files[:-1])} and {files[-1]} are"
