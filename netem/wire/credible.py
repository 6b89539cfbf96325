"""Checks a node's hello before the conductor uses it: a message that decodes may still hold impossible values."""

from __future__ import annotations

from collections.abc import Sequence

from netem.wire.errors import NodeFailure
from netem.wire.messages import Hello

SHOWN = 40          # characters of an invalid name that the message quotes


def credible(name: str, hello: Hello) -> Hello:
    """Return the `hello` that node `name` sent; raises NodeFailure if a value in it is impossible.

    A hello that carries the traceback of the node's program is returned unchecked.
    """
    if hello.error:
        return hello
    problem = _problem(name, hello)
    if problem:
        raise NodeFailure(name, f"sent an invalid hello: {problem}")
    return hello


def _problem(name: str, hello: Hello) -> str:
    if hello.node != name:
        return f"its name {hello.node[:SHOWN]!r}, expected {name!r}"
    for what, time_ns in (("first event", hello.soft_ns), ("silence", hello.firm_ns)):
        if time_ns < 0:
            return f"its {what} at {time_ns} ns, expected 0 or more"
    signals = [signal for signal, _ in hello.signals]
    for kind, names in (("port", hello.ports), ("signal", signals)):
        if repeated := _repeated(names):
            return f"{kind} {repeated[0][:SHOWN]!r} twice, expected each name once"
        if "" in names:
            return f"a {kind} without a name"
    for port in hello.quiet:
        if not 0 <= port < len(hello.ports):
            return f"port {port} of its {len(hello.ports)}, expected 0 <= port < {len(hello.ports)}"
    return ""


def _repeated(names: Sequence[str]) -> list[str]:
    return [name for index, name in enumerate(names) if name in names[:index]]
