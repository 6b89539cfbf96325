"""Certificates that are made, added and replaced, and what a person is told about a folder of them."""

from __future__ import annotations

import stat
from collections.abc import Callable
from datetime import UTC, datetime, timedelta
from pathlib import Path
from random import Random

import pytest

from netem.gateways.certificate_authority import NotMade, make_certificates
from netem.gateways.certificate_table import addresses_in, read_table
from netem.gateways.certificates import Certificates, _handshake, common_name
from tests.netem.gateways.certificate_folders import EXPIRED, make, put


def files(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def test_what_is_made_lets_its_clients_in_and_keys_are_the_owners_alone(tmp_path):
    folder = tmp_path / "certificates"

    made = make_certificates(folder, ["r1", "operator"], ["192.168.1.5", "base.local"])

    assert made.names == ["authority", "emulator", "r1", "operator"]
    assert addresses_in(folder / "emulator.crt") == ["192.168.1.5", "base.local"]
    assert stat.S_IMODE(folder.stat().st_mode) == 0o700
    assert {stat.S_IMODE(path.stat().st_mode) for path in folder.glob("*.key")} == {0o600}
    certificates = Certificates(folder)
    for name in ("r1", "operator"):
        assert common_name(_handshake(certificates.server_context(), certificates.client_context(name))) == name
    table = read_table(folder)
    assert table.problems == []
    assert [(row.name, row.kind, row.state, row.ours, row.has_key) for row in table.rows] == [
        ("authority", "authority", "valid", True, True), ("emulator", "emulator", "valid", True, True),
        ("operator", "client", "valid", True, True), ("r1", "client", "valid", True, True)]
    assert timedelta(days=364) < table.rows[1].ends - datetime.now(UTC) < timedelta(days=366)


def test_without_an_address_the_emulator_is_at_the_loopback(tmp_path):
    make_certificates(tmp_path / "new", [])

    assert addresses_in(tmp_path / "new" / "emulator.crt") == ["127.0.0.1", "::1", "localhost"]


def test_names_are_added_to_the_same_authority_and_nothing_else_changes(tmp_path):
    make_certificates(tmp_path, ["r1"])
    before = files(tmp_path)

    make_certificates(tmp_path, ["r2"])

    after = files(tmp_path)
    assert after.keys() - before.keys() == {"r2.crt", "r2.key"}
    assert {name: after[name] for name in before} == before
    assert all(row.ours for row in read_table(tmp_path).rows)


def test_nothing_is_replaced_unless_it_is_asked_for(tmp_path):
    make_certificates(tmp_path, ["r1"], ["10.0.0.1"])
    before = files(tmp_path)

    with pytest.raises(NotMade, match=r"r1.crt and r1.key are already there; --overwrite"):
        make_certificates(tmp_path, ["r2", "r1"])
    with pytest.raises(NotMade, match=r"emulator.crt and emulator.key are already there"):
        make_certificates(tmp_path, ["r2"], ["10.0.0.2"])
    assert files(tmp_path) == before

    make_certificates(tmp_path, ["r1"], overwrite=True)
    after = files(tmp_path)
    assert {name for name in after if after[name] != before[name]} == {"r1.crt", "r1.key"}
    make_certificates(tmp_path, [], overwrite=True)
    assert files(tmp_path)["emulator.crt"] != before["emulator.crt"]
    assert addresses_in(tmp_path / "emulator.crt") == ["10.0.0.1"]
    assert read_table(tmp_path).problems == []


@pytest.mark.parametrize(("spoil", "complaint"), [
    (lambda here: (here / "authority.key").unlink(), "authority.key: is missing, and without it no name "),
    (lambda here: (here / "authority.crt").unlink(), "authority.crt: is missing; "),
    (lambda here: (here / "authority.crt").write_text("none"), "authority.crt: is no certificate in PEM text; "),
    (lambda here: (here / "authority.key").write_text("none"), "authority.key: is no private key in PEM text"),
    (lambda here: (here / "authority.key").write_bytes((here / "r1.key").read_bytes()),
     "authority.key: does not belong to authority.crt; "),
])
def test_an_authority_that_cannot_sign_is_told_and_nothing_is_written(tmp_path, spoil: Callable, complaint):
    make_certificates(tmp_path, ["r1"])
    spoil(tmp_path)
    before = files(tmp_path)

    with pytest.raises(NotMade) as caught:
        make_certificates(tmp_path, ["r2"])

    assert complaint in str(caught.value)
    assert files(tmp_path) == before


def test_all_that_is_wrong_with_the_names_and_addresses_is_told_at_once(tmp_path):
    with pytest.raises(NotMade) as caught:
        make_certificates(tmp_path / "new", ["emulator", "../r1", "r" * 65, ""], ["1.2.3.4:5", "0.0.0.0", "a b"],
                          days=0)

    assert [line.partition(": ")[0] for line in str(caught.value).splitlines()] == [
        "emulator", "'../r1'", f"'{'r' * 65}'", "''", "--address 1.2.3.4:5", "--address 0.0.0.0", "--address a b",
        "--days 0"]
    assert not (tmp_path / "new").exists()


def test_a_folder_that_cannot_be_made_is_told(tmp_path):
    (tmp_path / "file").write_text("")

    with pytest.raises(NotMade, match=r"file/new: cannot be written: Not a directory; name a folder in which you may"):
        make_certificates(tmp_path / "file" / "new", ["r1"])


def test_a_certificate_does_not_outlive_its_authority(tmp_path):
    make_certificates(tmp_path, [])

    with pytest.raises(NotMade, match=r"--days 5000: the authority .* ends on"):
        make_certificates(tmp_path, ["r1"], days=5000)


def test_what_is_wrong_in_a_folder_is_told_a_line_each_with_the_remedy(tmp_path):
    ours, theirs = tmp_path / "ours", tmp_path / "theirs"
    authority = make(ours, "r1", "r2", "r3", "r4", "r5")
    make(theirs, "r1", "r2")
    for path in ours.glob("*.key"):
        path.chmod(0o600)
    put(ours, authority, "r1", not_after=EXPIRED)
    (ours / "r1.key").chmod(0o600)
    for end in (".crt", ".key"):
        (ours / f"r2{end}").write_bytes((theirs / f"r2{end}").read_bytes())
    (ours / "r3.key").write_bytes((ours / "r4.key").read_bytes())
    (ours / "r4.crt").write_text("no certificate")
    (ours / "r5.key").chmod(0o644)
    (ours / "r6.key").write_text("no key")
    (ours / "r6.key").chmod(0o600)

    table = read_table(ours)

    assert {(row.name, row.state, row.ours) for row in table.rows if row.kind == "client"} == {
        ("r1", "expired", True), ("r2", "valid", False), ("r3", "valid", True), ("r5", "valid", True)}
    renew = f"; make a new one with marconet certificates new {ours} "
    assert table.problems == [
        f"{ours}/r4.crt: is no certificate in PEM text{renew}r4 --overwrite",
        f"{ours}/r1.crt: expired on 2020-01-01{renew}r1 --overwrite",
        f"{ours}/r2.crt: is signed by another authority than authority.crt{renew}r2 --overwrite",
        f"{ours}/r3.key: does not belong to r3.crt{renew}r3 --overwrite",
        f"{ours}/r5.key: other users of this machine may read it; chmod 600 {ours}/r5.key",
        f"{ours}/r6.key: is no private key in PEM text without a password{renew}r6 --overwrite"]


def test_no_file_makes_the_table_fail(tmp_path):
    make_certificates(tmp_path, ["r1"])
    whole, noise = (tmp_path / "r1.crt").read_bytes(), Random(7)
    for number in range(200):
        spoilt = bytearray(whole)
        for _ in range(noise.randint(1, 4)):
            spoilt[noise.randrange(len(spoilt))] = noise.randrange(256)
        (tmp_path / f"n{number}.crt").write_bytes(spoilt)
        (tmp_path / f"n{number}.key").write_bytes(noise.randbytes(40))

    table = read_table(tmp_path)

    assert {row.name for row in table.rows} >= {"authority", "emulator", "r1"}
    assert len(table.problems) >= 200
    assert all("\n" not in problem for problem in table.problems)
