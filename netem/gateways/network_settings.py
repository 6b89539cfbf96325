"""The table `[network]` of a scenario: how the doors of a run are locked."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class NetworkSettings:
    tls: Path | None = None             # folder of certificates (certificates.py)

    def __post_init__(self) -> None:
        if self.tls is not None:
            from netem.gateways.certificates import Certificates  # late: few scenarios have it

            try:
                Certificates(self.tls)
            except ValueError as error:
                raise ValueError(f"tls={self.tls}: {error}") from None
