"""Folders of certificates for tests: of one authority, of another, expired."""

from __future__ import annotations

from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import trustme

EXPIRED = datetime(2020, 1, 1, tzinfo=UTC)


def put(folder: Path, authority: trustme.CA, name: str, *names: str, not_after: datetime | None = None) -> None:
    """Put NAME.crt and NAME.key into `folder`."""
    made = authority.issue_cert(*(names or [name]), common_name=name, not_after=not_after)
    made.cert_chain_pems[0].write_to_path(folder / f"{name}.crt")
    made.private_key_pem.write_to_path(folder / f"{name}.key")


def zenoh_settings(folder: Path, name: str = "", of: Path | None = None) -> dict[str, Any]:
    """Return the settings of a Zenoh program with the certificate of `name` in `of` (default: `folder`); "": none."""
    settings: dict[str, Any] = {"transport/link/tls/root_ca_certificate": str(folder / "authority.crt")}
    if name:
        settings |= {"transport/link/tls/enable_mtls": True,
                     "transport/link/tls/connect_certificate": str((of or folder) / f"{name}.crt"),
                     "transport/link/tls/connect_private_key": str((of or folder) / f"{name}.key")}
    return settings


def make(folder: Path, *clients: str, authority: trustme.CA | None = None) -> trustme.CA:
    """Make a folder with certificates of the emulator and of `clients`; return the authority."""
    authority = authority or trustme.CA()
    folder.mkdir()
    authority.cert_pem.write_to_path(folder / "authority.crt")
    put(folder, authority, "emulator", "emulator", "127.0.0.1", "::1")
    for name in clients:
        put(folder, authority, name)
    return authority
