"""Two Zenoh gateways with a medium between them that a test can delay, cut and count; programs are real processes."""

from __future__ import annotations

import heapq
import queue
import re
import subprocess
import sys
import threading
import time
from contextlib import ExitStack, suppress
from itertools import count
from pathlib import Path
from typing import Any

from netem.gateways.tls_front import TlsFront
from netem.gateways.zenoh import ZenohGateway, ZenohSettings
from netem.media.answers import DatagramFormat

PATIENCE_S = 40.0
CLIENT = Path(__file__).with_name("zenoh_client.py")


class Client:
    """A program at a gateway."""

    def __init__(self, endpoint: str, *more: str) -> None:
        self.lines: list[str] = []
        self._coming: queue.Queue[str | None] = queue.Queue()
        self.process = subprocess.Popen([sys.executable, str(CLIENT), endpoint, *more], stdin=subprocess.PIPE,
                                        stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, bufsize=1)
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()
        self.until("^open")

    def _read(self) -> None:
        assert self.process.stdout is not None
        for line in self.process.stdout:
            self._coming.put(line.rstrip("\n"))
        self._coming.put(None)

    def until(self, pattern: str, patience_s: float = PATIENCE_S) -> str:
        """Return the first line from now on that matches."""
        end_s = time.monotonic() + patience_s
        while True:
            try:
                line = self._coming.get(timeout=max(0.0, end_s - time.monotonic()))
            except queue.Empty:
                raise AssertionError(f"no {pattern!r} within {patience_s} s: {self.lines}") from None
            assert line is not None, f"it ended before {pattern!r}: {self.lines}"
            self.lines.append(line)
            if re.search(pattern, line):
                return line

    def do(self, *words: object) -> None:
        """Let it do what a line says, and wait until it has."""
        self.say(*words)
        self.until(f"^done {words[0]}")

    def say(self, *words: object) -> None:
        assert self.process.stdin is not None
        self.process.stdin.write(" ".join(map(str, words)) + "\n")
        self.process.stdin.flush()

    def ask(self, *words: object) -> list[str]:
        """Return what `get` tells until it has ended."""
        self.say("get", *words)
        known = len(self.lines)
        self.until("^got")
        return [line for line in self.lines[known:] if not line.startswith("heard")]

    def close(self) -> None:
        if self.process.poll() is None:
            self.process.kill()
        self.process.wait()
        self._reader.join()
        for pipe in (self.process.stdin, self.process.stdout):
            assert pipe is not None
            with suppress(BrokenPipeError):
                pipe.close()


class Between:
    """A medium between the gateways r1, r2, ...: `delay_s`, `cut` (nothing arrives), `carried` (frames).

    With a folder of certificates each gateway has a TLS door.
    """

    def __init__(self, robots: int = 2, longest_bytes: int | None = None, tls: Path | None = None,
                 **settings: Any) -> None:
        self.delay_s = 0.0
        self.cut = False
        self.carried = 0
        self.told: list[tuple[str, str]] = []
        self._under_way: list[tuple[float, int, str, bytes]] = []
        self._order = count()
        self._ends = threading.Event()
        self.at_end = ExitStack()
        names = [f"r{k + 1}" for k in range(robots)]
        listen = f"{'tls' if tls else 'tcp'}/127.0.0.1:0"
        self.gateways = {name: ZenohGateway(name, "air", ZenohSettings(**{"listen": listen, **settings}),
                                            event=lambda kind, detail, level: self.told.append((kind, detail)))
                         for name in names}
        for gateway in self.gateways.values():
            gateway.join(names, DatagramFormat(longest_bytes, addressed=False))
        self._front = TlsFront(tls) if tls else None
        if self._front is not None:
            for name, gateway in self.gateways.items():
                door = gateway.settings.door(name)
                assert door is not None
                gateway.opened(self._front.open(name, door, gateway.onward(), gateway.tell))
        self._thread = threading.Thread(target=self._carry, daemon=True)
        self._thread.start()

    def _carry(self) -> None:
        while not self._ends.is_set():
            moved = False
            now_s = time.monotonic()
            if self._front is not None:
                self._front.attend()
            for name, gateway in self.gateways.items():
                for frame in gateway.receive(100):
                    moved = True
                    self.carried += 1
                    if not self.cut:
                        heapq.heappush(self._under_way, (now_s + self.delay_s, next(self._order), name, frame))
            while self._under_way and self._under_way[0][0] <= now_s:
                _, _, sender, frame = heapq.heappop(self._under_way)
                for name, gateway in self.gateways.items():
                    if name != sender:
                        gateway.send(frame)
            if not moved:
                time.sleep(0.0005)

    def client(self, robot: str, *more: str) -> Client:
        found = Client(self.gateways[robot].locators()[0], *more)
        self.at_end.callback(found.close)
        return found

    def events(self, kind: str) -> list[str]:
        return [detail for found, detail in self.told if found == kind]

    def close(self) -> None:
        self.at_end.close()
        self._ends.set()
        self._thread.join()
        if self._front is not None:
            self._front.close()
        for gateway in self.gateways.values():
            gateway.close()
