"""Faults that are injected into a run from outside, and the schedule that repeats them in virtual time.

    marconet fault RUN KIND key=value ...  --run.faults, a Unix socket that only its owner may open--> Injection
                                           <--where and when, or why not--
    marconet fault tls://HOST:PORT ...     --the run's TLS door (own_doors.py)--> run.faults -----> Injection
    the page of a view                     --its server--> experiments/run/live --------------------> Injection

A run in real time takes faults while its pace waits; a run in virtual time takes them if it has a view, between two
windows. A fault begins at the instant of its arrival, or at the earliest instant that no window of the run has passed.
It joins the faults in `scenario.json` of the run folder, and is written to `injected.toml` there, as a table [[faults]]
with its instant. The scenario with the tables of `injected.toml` appended repeats the run. A fault that the scenario
could not have, because it overlaps another, is refused, and so is every fault after the last window.
"""

from __future__ import annotations

import os
import re
import socket
import tomllib
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import msgspec

from experiments.judge.run_files import FAULT_SOCKET, FAULTS_LATER, INJECTED, RUN, SCENARIO
from experiments.programs.firmware_programs import class_for
from experiments.run.run_folder import owner
from experiments.scenario.faults import has_execution_time, read_fault, refuse_overlaps, site_of
from experiments.scenario.model import FaultSpec, Scenario
from experiments.scenario.plant_parameters import plant_names
from experiments.scenario.problems import Problems, path_text
from experiments.scenario.sections import Reading
from experiments.scenario.toml_text import toml_text
from experiments.show.view.fault_form import keys_of
from netem.emulator.conductor import Conductor
from netem.emulator.world import RunWorld
from netem.faults.schedule import Occurrence
from netem.gateways import Attends

if TYPE_CHECKING:
    from netem.gateways.door_client import Caller

LONGEST: Final = 65536                      # bytes of a request or an answer
ANSWER_WITHIN_S: Final = 10.0
TIMES: Final = ("at", "during", "every", "times", "rate_per")
_ABOUT: Final = re.compile(r"(?:fault: )?(\w+)(?:\[\d+\]|\.\w+)*[=: ]")


class NotInjected(ValueError):
    """A fault cannot be injected; the text says why and what to do."""

    exit_code = 2


class Request(msgspec.Struct):
    kind: str
    keys: dict[str, Any]


class Answer(msgspec.Struct):
    error: str = ""
    name: str = ""
    at_ns: int = -1
    fields: dict[str, str] = {}         # what is wrong, by the key that it is about


class Injection:
    """Takes requests from the socket of the run folder, which `attends` watches, and from a view.

    `may_kill(node)` returns whether a kill may be injected into the node.
    """

    def __init__(self, scenario: Scenario, folder: Path, conductor: Conductor, attends: Attends, world: RunWorld,
                 may_kill: Callable[[str], bool]) -> None:
        self._scenario, self._conductor, self._attends, self._world = scenario, conductor, attends, world
        self._folder, self._may_kill = folder, may_kill
        plants = {name: plant_names(agent.plant.fmu, scenario.folder) for name, agent in scenario.agents.items()
                  if agent.plant is not None}
        self.site = site_of(scenario.agents, scenario.media, plants,
                             {name for name, agent in scenario.agents.items()
                              if has_execution_time(class_for(agent.program, scenario.folder))})
        self._names = {spec.name for spec in scenario.faults if spec.name}
        self._asking: set[socket.socket] = set()
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        with _address(folder) as address:
            mask = os.umask(0o177)
            try:
                self._socket.bind(f"{address}_")
            finally:
                os.umask(mask)
            self._socket.listen()
            os.rename(f"{address}_", address)       # now that it listens, others may find it
        end_announcement(folder)
        self._socket.setblocking(False)
        attends.attend(self._socket, self._accept)

    def close(self) -> None:
        for asking in [*self._asking]:
            self._end(asking)
        self._attends.leave(self._socket)
        self._socket.close()
        with suppress(OSError):
            (self._folder / FAULT_SOCKET).unlink()

    def _accept(self) -> None:
        with suppress(OSError):
            asking, _ = self._socket.accept()
            asking.setblocking(False)
            self._asking.add(asking)
            heard = bytearray()
            self._attends.attend(asking, partial(self._hear, asking, heard))

    def _hear(self, asking: socket.socket, heard: bytearray) -> None:
        try:
            data = asking.recv(LONGEST)
        except BlockingIOError:
            return
        except OSError:
            data = b""
        heard += data
        if b"\n" in heard:
            with suppress(OSError):
                asking.send(msgspec.json.encode(self._answer(bytes(heard).partition(b"\n")[0])) + b"\n")
        elif data and len(heard) < LONGEST:
            return                          # the rest of the request is on its way
        self._end(asking)

    def _end(self, asking: socket.socket) -> None:
        self._asking.discard(asking)
        self._attends.leave(asking)
        asking.close()

    def _answer(self, line: bytes) -> Answer:
        try:
            request = msgspec.json.decode(line, type=Request)
        except (msgspec.MsgspecError, UnicodeDecodeError):
            return Answer(error="expected a request with kind and keys as JSON")
        return self.inject(request.kind, request.keys)

    def inject(self, kind: str, keys: Mapping[str, Any]) -> Answer:
        """Let a fault begin now; the answer has its name and instant, or why it cannot be."""
        try:
            return self._inject(Request(kind, dict(keys)))
        except ValueError as error:
            return Answer(error=str(error), fields=_by_key(str(error), keys_of(kind)))

    def _inject(self, request: Request) -> Answer:
        keys, conductor = dict(request.keys), self._conductor
        if conductor.ended:
            raise NotInjected(f"the run is at its end, {conductor.end_ns / 1e9:.9g} s: nothing can be injected any "
                              "more")
        if given := next((key for key in keys if key.rpartition("_")[0] in TIMES or key == "times"), ""):
            raise NotInjected(f"{given}: an injected fault begins at once; lasts_s says how long it lasts")
        keys.setdefault("name", self._next_name())
        if keys["name"] in self._names:
            raise NotInjected(f"name={keys['name']!r}: another fault of this run has this name; give it one of its own")
        medium = conductor.media.get(str(keys.get("on", "")).partition(":")[0])
        outside_ns = 0 if conductor.pace is None else conductor.pace.now_ns()
        at_ns = max(outside_ns, conductor.passed_ns, conductor.agenda.now_ns)
        if medium is not None:
            at_ns = medium.next_fault_ns(at_ns)
        table = {"kind": request.kind, **keys, "at_ns": at_ns}
        spec = self._read(table)
        if spec.settings.cuts or spec.settings.flips:
            table["spares_under_way"] = True
            spec = self._read(table)
        for node, *_ in spec.targets if spec.settings.kills else ():
            if not self._may_kill(node):
                raise NotInjected(f"{node}: the FMU of its plant cannot save its state, so a kill has to be known "
                                  "before the run: write it into the scenario")
        occurrence, = spec.occurrences
        faults = self._scenario.faults
        spec = msgspec.structs.replace(spec, place=path_text(("faults", len(faults))))
        problems = Problems("fault")
        refuse_overlaps((*faults, spec), Reading(self._scenario.folder, problems))
        problems.stop_if_any()
        self._names.add(spec.name)
        self._scenario = msgspec.structs.replace(self._scenario, faults=(*faults, spec))
        self._world.occurs(spec.settings, spec.cause, spec.targets, Occurrence(*occurrence))
        with (self._folder / INJECTED).open("a", encoding="utf-8") as file:
            file.write("[[faults]]\n" + "".join(f"{key} = {toml_text(value)}\n" for key, value in table.items()) + "\n")
        SCENARIO.write(self._folder, SCENARIO.read(self._folder) | self._scenario.resolved())
        return Answer(name=spec.name, at_ns=at_ns)

    def _read(self, table: Mapping[str, Any]) -> FaultSpec:
        problems = Problems("fault")
        spec = read_fault(dict(table), (), self.site, self._scenario.media, self._scenario.seed,
                          self._scenario.length_ns, Reading(self._scenario.folder, problems))
        problems.stop_if_any()
        assert spec is not None
        return spec

    def _next_name(self) -> str:
        number = len(self._names)
        while f"injected-{number}" in self._names:
            number += 1
        return f"injected-{number}"


def inject(run: Path, kind: str, keys: Mapping[str, Any]) -> tuple[str, int]:
    """Inject a fault into the run in the folder `run`; return its name and instant [ns]. NotInjected says why not."""
    if not SCENARIO.is_in(run):
        raise NotInjected(f"{run}: there is no run in this folder")
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as asking:
        asking.settimeout(ANSWER_WITHIN_S)
        try:
            with _address(run) as address:
                asking.connect(address)
        except PermissionError:
            raise NotInjected(f"{run}: the run belongs to another user, who alone may inject faults") from None
        except OSError:
            raise NotInjected(f"{run}: {_why_closed(run)}") from None
        try:
            answer = _answer_on(asking, kind, keys)
        except TimeoutError:
            raise NotInjected(f"{run}: no answer within {ANSWER_WITHIN_S:g} s: is the run stopped?") from None
        except (OSError, msgspec.MsgspecError):
            raise NotInjected(f"{run}: the run ended before it answered") from None
    return _injected(answer)


def announce(folder: Path) -> None:
    """Say that the run in `folder` will take faults, though it does not yet."""
    (folder / FAULTS_LATER).touch()


def end_announcement(folder: Path) -> None:
    """Take back what `announce` said: the run takes faults now, or will never do so."""
    (folder / FAULTS_LATER).unlink(missing_ok=True)


def _why_closed(run: Path) -> str:
    if not owner(run):
        return "the run has ended"
    if RUN.is_in(run):
        return "the run is ending: its robots have stopped, and it takes no more faults"
    if (run / FAULTS_LATER).exists() or (run / FAULT_SOCKET).exists():
        return "the run is starting: its robots are not ready yet; try again"
    return "the run is not in real time: start it with --real-time, or with --view, to inject faults"


def inject_through_door(address: str, caller: Caller, kind: str, keys: Mapping[str, Any]) -> tuple[str, int]:
    """Inject a fault into the run with a TLS door at `address`; as `inject`, or NotAdmitted says why not."""
    from netem.gateways.door_client import ask_door, open_stream, told

    silent = f"lets {caller.name} in, but no answer came within {ANSWER_WITHIN_S:g} s: the run is stopped or overloaded"
    with open_stream(address, caller) as stream, told(address, caller, silent):
        stream.settimeout(ANSWER_WITHIN_S)
        try:
            answer = _answer_on(stream, kind, keys)
        except (ConnectionError, EOFError, msgspec.MsgspecError):      # the door says why to somebody who asks
            ask_door(address, caller)
            raise NotInjected(f"{address}: lets {caller.name} in, but no run answers behind it: it takes no faults yet "
                              "or has just ended, or it is the door of something else; see faults_port of its "
                              "scenario") from None
    return _injected(answer)


def _answer_on(asking: socket.socket, kind: str, keys: Mapping[str, Any]) -> Answer:
    asking.sendall(msgspec.json.encode(Request(kind, dict(keys)), enc_hook=str) + b"\n")
    return msgspec.json.decode(_line(asking), type=Answer)


def _injected(answer: Answer) -> tuple[str, int]:
    if answer.error:
        raise NotInjected(answer.error)
    return answer.name, answer.at_ns


def parse_keys(words: Iterable[str]) -> dict[str, Any]:
    """Return the keys of a fault from words `key=value`; a value that is no TOML is text."""
    keys: dict[str, Any] = {}
    for word in words:
        key, equals, text = word.partition("=")
        if not equals or not key.isidentifier():
            raise NotInjected(f"{word}: expected key=value, as in on=r3 or lasts_s=1.5")
        if key in keys:
            raise NotInjected(f"{word}: the key is given twice")
        keys[key] = parse_value(text)
    return keys


def parse_value(text: str) -> Any:
    """Return the value that `text` is in TOML; one that is no TOML is text."""
    try:
        return tomllib.loads(f"value = {text}")["value"]
    except (tomllib.TOMLDecodeError, RecursionError):
        return text


def _by_key(error: str, keys: Collection[str]) -> dict[str, str]:
    """Return the lines of `error` that begin with one of the keys, by key."""
    found: dict[str, str] = {}
    for line in error.splitlines():
        about = _ABOUT.match(line)
        if about is not None and about[1] in keys:
            found.setdefault(about[1], line.removeprefix("fault: "))
    return found


def _line(asking: socket.socket) -> bytes:
    heard = bytearray()
    while b"\n" not in heard and (data := asking.recv(LONGEST)):
        heard += data
    return bytes(heard)


@contextmanager
def _address(folder: Path) -> Iterator[str]:
    """Return an address of the socket in `folder` that is short enough for the operating system."""
    plain = str(folder / FAULT_SOCKET)
    if len(os.fsencode(plain)) < 100:
        yield plain
        return
    handle = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    try:
        yield f"/proc/self/fd/{handle}/{FAULT_SOCKET}"
    finally:
        os.close(handle)
