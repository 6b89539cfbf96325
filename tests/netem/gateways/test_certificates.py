"""Folders of certificates that are complete, incomplete or foreign, and what a failed handshake is told as."""

from __future__ import annotations

import shutil
import ssl
from collections.abc import Callable
from pathlib import Path

import pytest
import trustme
from cryptography.hazmat.primitives import serialization

from netem.gateways.certificates import (
    EMULATOR,
    Certificates,
    _handshake,
    common_name,
    why_not_admitted,
    why_refused,
)
from tests.netem.gateways.certificate_folders import EXPIRED, make, put


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, trustme.CA, Path]:
    """A folder, its authority, and a folder of another one."""
    here = tmp_path_factory.mktemp("certificates")
    authority = make(here / "ours", "r1", "r2")
    make(here / "theirs", "r1")
    return here / "ours", authority, here / "theirs"


def client(folder: Path, name: str = "") -> ssl.SSLContext:
    """The context of a client that is not ours."""
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
    context.load_verify_locations(folder / "authority.crt")
    if name:
        context.load_cert_chain(folder / f"{name}.crt", folder / f"{name}.key")
    return context


def test_the_server_learns_the_common_name_of_a_client(made):
    ours, _, _ = made
    certificates = Certificates(ours)

    assert certificates.names() == ["r1", "r2"]
    for name in certificates.names():
        assert common_name(_handshake(certificates.server_context(), certificates.client_context(name))) == name


@pytest.mark.parametrize(("subject", "name"), [
    ((), ""), (((("commonName", "r1"),),), "r1"), (((("commonName", "r1"),), (("commonName", "r2"),)), ""),
    (((("organizationName", "r1"),),), "")])
def test_a_certificate_has_one_common_name_or_none(subject, name):
    assert common_name({"subject": subject}) == name
    assert common_name(None) == ""


def lock(key: Path) -> None:
    private = serialization.load_pem_private_key(key.read_bytes(), None)
    key.write_bytes(private.private_bytes(serialization.Encoding.PEM, serialization.PrivateFormat.PKCS8,
                                          serialization.BestAvailableEncryption(b"secret")))


def copy(here: Path, there: Path, *names: str) -> None:
    for name in names:
        (here / name).write_bytes((there / name).read_bytes())


@pytest.mark.parametrize(("spoil", "complaint"), [
    (lambda ours, ca, theirs: (ours / "emulator.crt").unlink(), "emulator.crt: is missing; "),
    (lambda ours, ca, theirs: (ours / "authority.crt").write_text("no certificate"),
     "authority.crt: is no certificate in PEM text; "),
    (lambda ours, ca, theirs: (ours / "emulator.crt").write_bytes(bytes(range(256))),
     "emulator.crt: is no certificate in PEM text; "),
    (lambda ours, ca, theirs: (ours / "emulator.key").write_text("no key"),
     "emulator.key: is no private key in PEM text without a password; "),
    (lambda ours, ca, theirs: lock(ours / "emulator.key"),
     "emulator.key: is no private key in PEM text without a password; "),
    (lambda ours, ca, theirs: copy(ours, theirs, "emulator.crt"), "emulator.key: does not belong to emulator.crt; "),
    (lambda ours, ca, theirs: copy(ours, theirs, "emulator.crt", "emulator.key"),
     "emulator.crt: is signed by another authority than authority.crt; "),
    (lambda ours, ca, theirs: put(ours, ca, EMULATOR, not_after=EXPIRED), "emulator.crt: has expired; "),
    (lambda ours, ca, theirs: put(ours, ca, EMULATOR, "elsewhere"), "emulator.crt: does not name 'emulator'; "),
    (lambda ours, ca, theirs: shutil.rmtree(ours), "is no folder; "),
])
def test_an_unusable_folder_is_refused_with_file_rule_and_remedy(made, tmp_path, spoil: Callable, complaint):
    shutil.copytree(made[0], tmp_path / "ours")
    spoil(tmp_path / "ours", made[1], made[2])

    with pytest.raises(ValueError) as caught:
        Certificates(tmp_path / "ours")

    assert complaint in str(caught.value)
    assert f"marconet certificates new {tmp_path / 'ours'}" in str(caught.value)


@pytest.mark.parametrize(("spoil", "complaint"), [
    (lambda ours, ca, theirs: (ours / "r1.key").unlink(), "r1.key: is missing; "),
    (lambda ours, ca, theirs: put(ours, ca, "r1", not_after=EXPIRED), "r1.crt: has expired; "),
    (lambda ours, ca, theirs: copy(ours, theirs, "r1.crt", "r1.key"), "r1.crt: is signed by another authority"),
    (lambda ours, ca, theirs: [(ours / f"r1{end}").write_bytes((ours / f"r2{end}").read_bytes())
                               for end in (".crt", ".key")], "r1.crt: its common name is 'r2'; "),
])
def test_a_client_of_ours_is_told_before_it_connects(made, tmp_path, spoil: Callable, complaint):
    shutil.copytree(made[0], tmp_path / "ours")
    spoil(tmp_path / "ours", made[1], made[2])

    with pytest.raises(ValueError) as caught:
        Certificates(tmp_path / "ours").client_context("r1")

    assert complaint in str(caught.value)


def expired(made: tuple[Path, trustme.CA, Path], tmp_path: Path) -> ssl.SSLContext:
    put(tmp_path, made[1], "r1", not_after=EXPIRED)
    copy(tmp_path, made[0], "authority.crt")
    return client(tmp_path, "r1")


def of_another_authority(made: tuple[Path, trustme.CA, Path], tmp_path: Path) -> ssl.SSLContext:
    context = client(made[0])
    context.load_cert_chain(made[2] / "r1.crt", made[2] / "r1.key")
    return context


def old(made: tuple[Path, trustme.CA, Path], tmp_path: Path) -> ssl.SSLContext:
    context = client(made[0], "r1")
    context.maximum_version = ssl.TLSVersion.TLSv1_2
    return context


@pytest.mark.parametrize(("of", "why"), [
    (lambda made, tmp_path: client(made[0]), "it showed no certificate; "),
    (of_another_authority, "its certificate is from another authority; "),
    (expired, "its certificate has expired; "),
    (old, "it speaks a version of TLS before 1.3; "),
])
def test_the_reason_of_a_failed_handshake_is_sure(made, tmp_path, of: Callable, why):
    with pytest.raises(ssl.SSLError) as caught:
        _handshake(Certificates(made[0]).server_context(), of(made, tmp_path))

    assert why_refused(caught.value).startswith(why)


@pytest.mark.parametrize("said", [b"GET / HTTP/1.1\r\n\r\n", b"hello hello hello\n", bytes(64),
                                  b"\x16\x03\x03\xff\xff" + bytes(64)])
def test_what_is_no_tls_is_told_as_that(made, said):
    coming, going = ssl.MemoryBIO(), ssl.MemoryBIO()
    side = Certificates(made[0]).server_context().wrap_bio(coming, going, server_side=True)
    coming.write(said)

    with pytest.raises(ssl.SSLError) as caught:
        side.do_handshake()

    assert why_refused(caught.value).startswith("it does not speak TLS; ")


def test_a_client_that_trusts_another_authority_is_told_as_that(made):
    to_server, to_client = ssl.MemoryBIO(), ssl.MemoryBIO()
    door = Certificates(made[0]).server_context().wrap_bio(to_server, to_client, server_side=True)
    here = client(made[2], "r1").wrap_bio(to_client, to_server, server_hostname=EMULATOR)
    for side, expected in ((here, ssl.SSLWantReadError), (door, ssl.SSLWantReadError),
                           (here, ssl.SSLCertVerificationError)):
        with pytest.raises(expected) as caught:
            side.do_handshake()
    assert "the certificate of the door is from another authority" in why_not_admitted(caught.value, "r1")

    with pytest.raises(ssl.SSLError) as caught:
        door.do_handshake()

    assert why_refused(caught.value).startswith("it does not accept the emulator's certificate (unknown ca); ")


@pytest.mark.parametrize(("error", "why"), [
    (TimeoutError(), "it did not finish the TLS handshake in time"),
    (ConnectionResetError(), "it closed the connection within the TLS handshake")])
def test_a_connection_that_ends_within_the_handshake_is_told_as_that(error, why):
    assert why_refused(error).startswith(why)
