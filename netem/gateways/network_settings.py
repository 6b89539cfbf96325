"""The table `[network]` of a scenario: at which address the emulator's own doors listen, and how doors are locked.

    view, faults_port --listen:PORT, TLS--> those with a certificate of `tls` and a common name in `operators`

Without `tls` the view listens at 127.0.0.1 and faults come by the Unix socket of the run folder alone.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from ipaddress import ip_address
from pathlib import Path
from typing import Final

from netem.gateways.addresses import text_of

LOOPBACK: Final = "127.0.0.1"
NEEDS_TLS: Final = ("add tls = \"FOLDER\", a folder that marconet certificates new makes")


@dataclass(frozen=True)
class NetworkSettings:
    listen: str = LOOPBACK              # IP address of the emulator's own doors; another one only with `tls`
    tls: Path | None = None             # folder of certificates (certificates.py)
    operators: tuple[str, ...] = ("operator",)      # common names of those who may open the view and inject faults
    faults_port: int | None = None      # for `marconet fault` from other machines

    def __post_init__(self) -> None:
        wrong = [*self._wrong_doors(), *self._wrong_certificates()]
        if wrong:
            raise ValueError("\n".join(wrong))

    def _wrong_doors(self) -> Iterator[str]:
        try:
            ip_address(self.listen)
        except ValueError:
            yield f"listen={self.listen}: expected an IP address of this machine, such as \"192.168.1.5\""
        else:
            if self.tls is None and self.listen != LOOPBACK:
                yield (f"listen={self.listen}: without TLS the emulator's own doors listen at {LOOPBACK} only, as "
                       f"anybody could come in; {NEEDS_TLS}")
        if self.faults_port is not None:
            if not 1 <= self.faults_port < 65536:
                yield f"faults_port={self.faults_port}: expected a port from 1 to 65535"
            if self.tls is None:
                yield f"faults_port={self.faults_port}: faults come through a door with TLS only; {NEEDS_TLS}"
        if not self.operators or not all(self.operators):
            yield (f"operators={list(self.operators)}: expected the common names of those who may open the view and "
                   "inject faults, as [\"operator\"]")

    def _wrong_certificates(self) -> Iterator[str]:
        if self.tls is not None:
            from netem.gateways.certificates import Certificates  # late: few scenarios have it

            try:
                Certificates(self.tls)
            except ValueError as error:
                yield f"tls={self.tls}: {error}"

    def address(self, port: int) -> str:
        """Return "host:port" of one of the emulator's own doors."""
        return text_of((self.listen, port))
