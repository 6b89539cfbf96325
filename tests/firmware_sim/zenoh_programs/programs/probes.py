"""Programs that tests of single properties run."""

import os
import random
import threading
import time

import zenoh

CONF = zenoh.Config


def tell(*what):
    print("TOLD", *what, flush=True)


def attempt(name, call):
    try:
        tell(name, call())
    except Exception as error:
        tell(name, type(error).__name__, str(error))


def alive(key="live/a", first_s=0.0):
    with zenoh.open(CONF()) as session:
        time.sleep(first_s)
        with session.liveliness().declare_token(key):
            time.sleep(1000)


def watch(key="live/**"):
    with zenoh.open(CONF()) as session:
        subscriber = session.liveliness().declare_subscriber(key, history=True)
        for sample in subscriber:
            tell(str(sample.kind), sample.key_expr, round(time.monotonic(), 1))


def numbers(count=20, size=8, key="n", apart=False):
    with zenoh.open(CONF()) as session:
        if apart:
            time.sleep(0.05 * random.random())
        for number in range(count):
            time.sleep(0.05)
            session.put(key, number.to_bytes(4, "little") + bytes(size - 4))


def hear(key="**"):
    with zenoh.open(CONF()) as session:
        subscriber = session.declare_subscriber(key)
        for sample in subscriber:
            data = sample.payload.to_bytes()
            tell(sample.key_expr, int.from_bytes(data[:4], "little"), len(data), set(data[4:]) <= {0})


def outside_subset():
    with zenoh.open(CONF()) as session:
        source = zenoh.SourceInfo
        attempt("scout", zenoh.scout)
        attempt("token", zenoh.CancellationToken)
        attempt("advanced", lambda: zenoh.ext.declare_advanced_publisher(session, "a"))
        attempt("source", lambda: session.put("a", "b", source_info=source))
        attempt("cancel", lambda: session.get("a", cancellation_token=1))
        attempt("links", lambda: session.info.links())
        attempt("callback", lambda: zenoh.open(CONF(), timestamp_callback=lambda context: b""))


def system_resources():
    """Tell of the process what a session of the library would change: sockets, and threads that are not Python's."""
    def seen():
        sockets = sum(os.readlink(f"/proc/self/fd/{name}").startswith("socket:") for name in os.listdir("/proc/self/fd")
                      if os.path.exists(f"/proc/self/fd/{name}"))
        return sockets, len(os.listdir("/proc/self/task")) - len(threading.enumerate())

    before = seen()
    with zenoh.open(CONF()) as session:
        session.declare_subscriber("a/**", lambda sample: None)
        for _ in range(20):
            session.put("a/b", "x" * 100)
            time.sleep(0.1)
        tell(seen() == before, before)


def clocks():
    with zenoh.open(CONF()) as session:
        time.sleep(0.5)
        stamp = session.new_timestamp()
        tell(stamp.get_time_as_ntp64().as_nanos(), round(time.time() * 1e9), time.monotonic_ns())


def forever():
    with zenoh.open(CONF()) as session:
        while True:
            session.put("flood", "x")


def two_ways():
    with zenoh.open(CONF()) as session:
        time.sleep(0.5)
        session.put("fleet/pose", "f")
        session.put("other", "o")
        attempt("nowhere", lambda: session.put("nowhere/at/all", "n"))


def asks(target="BEST_MATCHING", timeout=1.0, count=1, pause=0.0):
    with zenoh.open(CONF()) as session:
        time.sleep(0.5)
        for _ in range(count):
            began = time.monotonic()
            replies = sorted(found.ok.payload.to_string() if found.ok else "ERR " + found.err.payload.to_string()
                             for found in session.get("q/a", target=getattr(zenoh.QueryTarget, target),
                                                      consolidation=zenoh.ConsolidationMode.NONE, timeout=timeout))
            tell(replies, round(time.monotonic() - began, 1))
            time.sleep(pause)


def answers(text="yes", complete=False, size=0):
    with zenoh.open(CONF()) as session:
        session.declare_queryable("q/**", lambda query: query.reply("q/a", text + "." * size), complete=complete)
        time.sleep(1000)


class Board:
    """A board's program, which no key `zenoh` is for."""

    def __init__(self, board: object) -> None:
        pass
