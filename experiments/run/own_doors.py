"""The emulator's own doors beside those of gateways: who comes to a view, or to inject faults, and who is refused."""

from __future__ import annotations

import os
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

from experiments.judge.run_files import FAULT_SOCKET
from netem.gateways import Door, Tell
from netem.gateways.network_settings import NetworkSettings
from netem.wire.level import Level

if TYPE_CHECKING:
    from netem.gateways.tls_front import TlsFront

TellOfDoor = Callable[[str, str, Level], None]


def told_of(door: str, event: Tell) -> TellOfDoor:
    """Return what records an event of the front about `door`, under a kind that begins with "door"."""
    def tell(kind: str, text: str, level: Level) -> None:
        event(kind.replace("gateway", "door"), f"{door} {text}", level)

    return tell


class FaultDoor:
    """The door at `faults_port`, whose streams go to the socket `run.faults` in `folder`.

    Raises OSError, with address and remedy, if it cannot listen; the doors are closed then.
    """

    def __init__(self, network: NetworkSettings, folder: Path, front: TlsFront, event: Tell) -> None:
        assert network.faults_port is not None
        self._handle = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)    # a path through it is short enough for a socket
        try:
            front.open("network.faults_port", Door(network.address(network.faults_port), network.operators),
                       f"unix//proc/{os.getpid()}/fd/{self._handle}/{FAULT_SOCKET}",
                       told_of("network.faults_port", event))
        except BaseException:
            self.close()
            front.close()
            raise

    def close(self) -> None:
        with suppress(OSError):
            os.close(self._handle)
