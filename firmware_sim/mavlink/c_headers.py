"""Generates MAVLink's headers in C for a dialect, once: they are kept in the cache of plants.

    DIALECT.xml --generator of pymavlink--> DIALECT/mavlink.h, protocol.h, ...      #include <DIALECT/mavlink.h>

Definitions and generator come with pymavlink, and so does a dialect's set of messages. The headers are those that the
MAVLink project hands out; they are MAVLink 2, and parse MAVLink 1 too.
"""

from __future__ import annotations

import io
from contextlib import redirect_stdout
from functools import partial
from importlib.metadata import version
from importlib.util import find_spec
from pathlib import Path
from typing import Final

from fmus.cache import cache_folder, kept

LAYOUT: Final = 1       # raised by one whenever a change of this file changes the headers


def c_headers(dialect: str, cache: Path | None = None) -> Path:
    """Return the folder that `#include <DIALECT/mavlink.h>` is relative to.

    Raises ValueError for an unknown dialect, PlantError if the cache cannot be used."""
    known = dialects()
    if dialect not in known:
        raise ValueError(f"no dialect of MAVLink: expected one of {', '.join(sorted(known))}")
    return kept((cache or cache_folder()) / "mavlink" / f"{dialect}-{version('pymavlink')}-{LAYOUT}",
                partial(_generate, known[dialect]))


def dialects() -> dict[str, Path]:
    """Return the definitions that come with pymavlink, by the name of the dialect."""
    found = find_spec("pymavlink")
    assert found is not None
    assert found.origin is not None
    return {file.stem: file for file in (Path(found.origin).parent / "dialects" / "v20").glob("*.xml")}


def _generate(definition: Path, draft: Path) -> None:
    from pymavlink.generator import mavgen

    options = mavgen.Opts(str(draft), wire_protocol="2.0", language="C", validate=False)
    with redirect_stdout(io.StringIO()):        # it tells of each file
        done = mavgen.mavgen(options, [str(definition)])
    assert done, f"{definition}: pymavlink's own definitions contradict each other"
