"""Turns a program's traceback into a message for its author: the place in the program, the rule, the remedy.

The functions take the traceback as text, because a node in its own process sends nothing else.
"""

from __future__ import annotations

import os
import re
import sys
import sysconfig
from functools import lru_cache
from pathlib import Path
from typing import Final

_FRAME: Final = re.compile(r'  File "(?P<file>[^"]+)", line (?P<line>\d+), in (?P<function>.+)')
_INVALID_YIELD: Final = re.compile(r'Invalid yield value "(?P<value>.*)"\s*$', re.DOTALL)
_ADDRESS: Final = re.compile(r" at 0x[0-9a-f]+(?=>)")
_GENERATOR: Final = re.compile(r"<generator object (?P<name>\S+)>")
_COMPILED_GENERATOR: Final = re.compile(        # mypyc's name for the type of a generator
    r"<(?:\w+\.)+(?P<function>\w+?)(?:_(?P<owner>[A-Z]\w*))?_gen object>")
_OUR_TYPE: Final = re.compile(r"^(?:netem|fmus|firmware_sim|experiments)(?:\.\w+)*: ")
_PRIVATE_NAME: Final = re.compile(r"@[0-9a-f]{12}(?=\.)")          # suffix of a module that lies beside a scenario
_OURS: Final = str(Path(__file__).parents[2])
_PACKAGES: Final = tuple(f"{root}{name}/" for root in (f"{_OURS}/", "")      # compiled code has relative paths
                         for name in ("netem", "fmus", "firmware_sim", "experiments", "marconet"))
_LIBRARIES: Final = tuple(f"{path}/" for path in {sysconfig.get_paths()[key] for key in
                                                  ("stdlib", "platstdlib", "purelib", "platlib")})
MOST_FRAMES: Final = 5             # number of frames shown, the innermost ones
NO_EVENT: Final = "expected an event, as `yield self.board.until(local_ns)` or `yield port.receive()` wait for"


def what_failed(trace: str) -> str:
    """Return the last line of a traceback, "Type: message", with the remedy for a known mistake.

    Memory addresses are removed, so that the same mistake of several robots reads the same.
    """
    trace = _ADDRESS.sub("", trace)
    last = trace.strip().rpartition("\n")[2].strip()
    if (wrong := _INVALID_YIELD.search(trace)) is not None:
        frames = list(_FRAME.finditer(trace[:wrong.start()]))
        place = f"{Path(frames[-1]['file']).name}:{frames[-1]['line']}: " if frames else ""
        if generator := _generator_named(wrong["value"]):
            return (f"{place}yield of the generator {generator}: it waits only if it is delegated to; write "
                    f"`yield from ...{generator.rpartition('.')[2]}(...)`")
        return f"{place}yield {wrong['value']}: {NO_EVENT}"
    return _OUR_TYPE.sub("", _PRIVATE_NAME.sub("", last, count=1))


def _generator_named(value: str) -> str:
    """Qualified name of the function whose generator has the repr `value`; "" if it is not the repr of a generator."""
    if (generator := _GENERATOR.fullmatch(value)) is not None:
        return generator["name"]
    if (generator := _COMPILED_GENERATOR.fullmatch(value)) is not None:
        return ".".join(filter(None, (generator["owner"], generator["function"])))
    return ""


def own_lines(trace: str) -> str:
    """Return the traceback's frames that lie in files of the program's author; "" if there are none."""
    kept: list[str] = []
    keep = False
    for line in trace.rstrip().splitlines():
        if (frame := _FRAME.match(line)) is not None:
            keep = is_authors(frame["file"])
        elif not line.startswith("    "):
            keep = False
        if keep:
            kept.append(line)
    starts = [at for at, line in enumerate(kept) if _FRAME.match(line)]
    if len(starts) > MOST_FRAMES:
        kept[:starts[-MOST_FRAMES]] = [f"  ... {len(starts) - MOST_FRAMES} frames before"]
    return "\n".join(kept)


@lru_cache(maxsize=1 << 12)
def is_authors(file: str) -> bool:
    """Whether a source file belongs neither to marconet nor to an installed library."""
    return not os.path.normpath(file).startswith((*_PACKAGES, *_LIBRARIES, f"{sys.prefix}/", "<"))
