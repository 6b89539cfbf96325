"""The gateways that a scenario can name under `kind`."""

from __future__ import annotations

from typing import Final

from netem.core.kinds import Kinds

GATEWAYS: Final = Kinds({
    "udp": "netem.gateways.udp:UdpGateway",
    "tcp": "netem.gateways.tcp:TcpGateway",
    "can": "netem.media.can.can_gateway:CanGateway",
    "zenoh": "netem.gateways.zenoh:ZenohGateway",
    "serial": "netem.gateways.serial_port:SerialGateway",
})
USUAL: Final = "udp"                # the default of `kind`
