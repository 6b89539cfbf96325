"""Constructs an impairment from its class, the fields that a scenario sets, and two that the builder passes in.

    rng             the instance's own random stream
    recordings      the files read so far, shared by all impairments that are built together

A class gets those of the two that it declares as fields.
"""

from __future__ import annotations

from collections.abc import Mapping
from random import Random
from typing import Any, Final

from netem.impairments.recordings import Recordings

PASSED_IN: Final = ("rng", "recordings")


def construct_impairment(kind: Any, fields: Mapping[str, Any], rng: Random, recordings: Recordings) -> Any:
    passed = {"rng": rng, "recordings": recordings}
    return kind(**fields, **{name: value for name, value in passed.items() if name in kind.__dataclass_fields__})
