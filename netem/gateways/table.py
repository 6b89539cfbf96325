"""The gateways that a scenario can name under `kind`."""

from __future__ import annotations

from typing import Final

from netem.core.kinds import Kinds

GATEWAYS: Final = Kinds({
    "udp": "netem.gateways.udp:UdpGateway",
})
USUAL: Final = "udp"                # of a gateway that does not say its kind
