"""Marks a union of settings classes whose members differ in the value of one key, without importing pydantic.

    TopologySettings = Annotated[FixedGraph | PathLoss, ToldApartBy("kind")]
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any


@dataclass(frozen=True)
class ToldApartBy:
    key: str

    def __get_pydantic_core_schema__(self, source: Any, handler: Any) -> Any:
        """Called by pydantic on a marker in `Annotated`."""
        from pydantic import Field  # late: only a table that is judged by pydantic needs it

        return handler(Annotated[source, Field(discriminator=self.key)])
