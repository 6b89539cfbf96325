"""An exception of a program, in words for its author: the place in the program, the rule, the remedy.

Works on the text of a traceback, as both hosts have it: the host with processes gets no more than the text.
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
_COMPILED_GENERATOR: Final = re.compile(        # as mypyc names its type
    r"<(?:\w+\.)+(?P<function>\w+?)(?:_(?P<owner>[A-Z]\w*))?_gen object>")
_OUR_TYPE: Final = re.compile(r"^(?:netem|fmus|firmware_sim|experiments)(?:\.\w+)*: ")
_PRIVATE_NAME: Final = re.compile(r"@[0-9a-f]{12}(?=\.)")          # of a module beside a scenario
_OURS: Final = str(Path(__file__).parents[2])
_PACKAGES: Final = tuple(f"{root}{name}/" for root in (f"{_OURS}/", "")      # compiled: below the root
                         for name in ("netem", "fmus", "firmware_sim", "experiments"))
_LIBRARIES: Final = tuple(f"{path}/" for path in {sysconfig.get_paths()[key] for key in
                                                  ("stdlib", "platstdlib", "purelib", "platlib")})
MOST_FRAMES: Final = 5             # shown of a recursion
NO_EVENT: Final = "expected an event, as `yield self.board.until(local_ns)` or `yield port.receive()` wait for"


def what_failed(trace: str) -> str:
    """The last line of a traceback, "Type: message", with the remedy where the mistake is a known one.

    Without addresses in memory, by which the same mistake of several robots would differ.
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
    if "'NoneType' object has no attribute" in last and re.search(r"^    .*\.plant\.", trace, re.MULTILINE):
        return f"{last}: this agent has no plant; give it one, plant = {{ fmu = \"...\" }}"
    return _OUR_TYPE.sub("", _PRIVATE_NAME.sub("", last, count=1))


def _generator_named(value: str) -> str:
    """The qualified name of the generator function whose generator `value` describes, "" if it is no generator."""
    if (generator := _GENERATOR.fullmatch(value)) is not None:
        return generator["name"]
    if (generator := _COMPILED_GENERATOR.fullmatch(value)) is not None:
        return ".".join(filter(None, (generator["owner"], generator["function"])))
    return ""


def own_lines(trace: str) -> str:
    """The frames that lie in the files of the program's author, "" if there are none."""
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
    """Whether a source file is neither marconet's nor a library's."""
    return not os.path.normpath(file).startswith((*_PACKAGES, *_LIBRARIES, f"{sys.prefix}/", "<"))
