"""An impairment from its class, the fields that its author set, and what the class asks for by the name of a field.

    rng             this instance's own random stream
    recordings      what has been read from files so far, shared by all that are built together
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
