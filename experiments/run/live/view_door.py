"""The TLS door before the server of a view: `marconet run --view` of a scenario with [network] tls.

    browser --https, a certificate of an operator--> front --Unix socket of this user--> server of the view

The door outlives the run, so that pages are told of its end.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from ipaddress import ip_address

from netem.gateways import Attends, Door, Tell
from netem.gateways.certificate_table import addresses_in
from netem.gateways.network_settings import NetworkSettings
from netem.gateways.private_socket import PrivateSocket
from netem.gateways.tls_front import TlsFront
from netem.wire.level import Level

HTTPS_PORT = 443


class ViewDoor:
    """`behind` is the path at which the server listens; `hosts` are the names of the page, "host:port", the best first.

    Raises OSError, with address and remedy, if it cannot listen.
    """

    def __init__(self, network: NetworkSettings, port: int) -> None:
        assert network.tls is not None
        self._socket = PrivateSocket()
        self.behind = str(self._socket.path)
        self._tell: Tell | None = None
        self._front = TlsFront(network.tls)
        try:
            door = self._front.open("--view", Door(network.address(port), network.operators), f"unix/{self.behind}",
                                    self._told)
        except BaseException:
            self.close()
            raise
        self.hosts = hosts_of(network.listen, int(door.address.rpartition(":")[2]),
                              addresses_in(network.tls / "emulator.crt"))

    def begin(self, attends: Attends, tell: Tell) -> Callable[[], None]:
        """Tell who comes and is refused whenever `attends` lets time pass; return what ends that."""
        self._tell = tell
        self._front.begin(attends)
        return self._front.leave

    def close(self) -> None:
        self._front.close()
        self._socket.close()

    def _told(self, kind: str, text: str, level: Level) -> None:
        assert self._tell is not None
        self._tell(kind, text, level)


def hosts_of(listen: str, port: int, named: Sequence[str]) -> list[str]:
    """Return the Host headers that are right at this door: where it listens, and the emulator's names."""
    names = [*named] if ip_address(listen).is_unspecified and named else [listen, *named]
    hosts = [f"[{name}]" if ":" in name else name.lower() for name in dict.fromkeys(names)]
    return [f"{host}:{port}" for host in hosts] + (hosts if port == HTTPS_PORT else [])
