"""The interface that bound_activations.c and ctypes_activations.py implement alike: calls of one firmware's functions,
and what the firmware calls from within them.

*Invariants*
- the calls of one activation are carried out in order, at the instant of the activation;
- an exception that is raised while a question is answered reaches the caller of `start`, `timer` or `receive` after
  the firmware's function has returned; calls after it are dropped;
- there is no activation within another one.
"""

from collections.abc import Callable

from firmware_sim.firmware.host.operations import Carrier

class Activations:
    """`timer`, `receive` and `start` read the clock by `now`, call the firmware and hand its calls to `calls`.

    They raise RuntimeError within one another and after `close`, ValueError for numbers outside of the 32 bits of an
    id or the 64 bits of a time. What `now` and `calls` raise passes through."""

    def __init__(self, memory: int, start: int, timer: int, receive: int, now: Callable[[], int], calls: Carrier,
                 keep: object, ours: bool) -> None:
        """`memory` is the address of a `Host` (marconet_host.h) that was prepared, the next three of its functions.

        The caller keeps the library loaded until `close`; `keep`, whatever else the library has addresses of, is held
        as long. A firmware of `ours` keeps the interpreter lock while its functions run; any other firmware releases
        it, except while its questions are answered."""
    def start(self) -> int:
        """Call `board_start`; return its result."""
    def timer(self, timer: int) -> None:
        """Call `board_timer`."""
    def receive(self, port: int, data: bytes) -> None:
        """Call `board_receive`."""
    def close(self) -> None:
        """Let nothing be called any more; RuntimeError from within an activation."""
