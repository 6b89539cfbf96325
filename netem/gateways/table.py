"""The gateways that a scenario can name under `kind`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

from netem.gateways.udp import UdpGateway

GATEWAYS: Final[Mapping[str, Any]] = {
    "udp": UdpGateway,
}
USUAL: Final = "udp"                # the default of `kind`
