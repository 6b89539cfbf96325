"""Checks the hello of a node before it is used: bytes that can be decoded may still hold impossible values."""

from __future__ import annotations

from collections.abc import Sequence

from netem.wire.errors import NodeFailure
from netem.wire.messages import Hello

SHOWN = 40          # characters of a name that is nonsense


def credible(name: str, hello: Hello) -> Hello:
    """`hello` as it came from node `name`; NodeFailure for one that no node can say."""
    if hello.error:
        return hello
    problem = _problem(name, hello)
    if problem:
        raise NodeFailure(name, f"says nonsense of itself: {problem}")
    return hello


def _problem(name: str, hello: Hello) -> str:
    if hello.node != name:
        return f"its name {hello.node[:SHOWN]!r}, expected {name!r}"
    for what, time_ns in (("first event", hello.soft_ns), ("silence", hello.firm_ns)):
        if time_ns < 0:
            return f"its {what} at {time_ns} ns, expected 0 or more"
    signals = [signal for signal, _ in hello.signals]
    for kind, names in (("port", hello.ports), ("signal", signals)):
        if twice := _twice(names):
            return f"{kind} {twice[0][:SHOWN]!r} twice, expected each name once"
        if "" in names:
            return f"a {kind} without a name"
    for port in hello.quiet:
        if not 0 <= port < len(hello.ports):
            return f"port {port} of its {len(hello.ports)}, expected 0 <= port < {len(hello.ports)}"
    return ""


def _twice(names: Sequence[str]) -> list[str]:
    return [name for index, name in enumerate(names) if name in names[:index]]
