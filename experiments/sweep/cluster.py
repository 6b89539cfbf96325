"""A Dask cluster runs the points of a campaign: the scheduler gives batches of seeds to its workers.

    scheduler <-tcp on the loopback, or tls-- this process          each thread of a Dask worker: one `Workers` process

The cluster is started as Dask's documentation says (https://docs.dask.org/en/stable/deploying-cli.html). A Dask worker
runs whatever it is told, so an address that is not of this machine has to be `tls://`; certificates are those of Dask's
own configuration (`distributed.comm.tls`). Every worker needs marconet, and the scenario's folder at the same path.

A Dask worker that is lost has its batches run by the others. Tasks are batches, as single runs would keep the scheduler
busier than the workers.
"""

from __future__ import annotations

import ipaddress
import ssl
import threading
import time
from collections import deque
from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import CancelledError
from contextlib import suppress
from importlib.metadata import version
from pathlib import Path
from queue import Empty, SimpleQueue
from types import TracebackType
from typing import Any, Final
from uuid import uuid4

import msgspec
from distributed import Client, Security, WorkerPlugin, get_worker
from distributed.comm.core import FatalCommClosedError
from distributed.scheduler import KilledWorker

from experiments.judge.figures import Figures
from experiments.scenario.problems import ScenarioError
from experiments.sweep.messages import Host, Point, Source, digest_of, encode
from experiments.sweep.workers import SETTINGS_AT_ONCE, Workers

CONNECT_S: Final = 10.0
PATIENCE_S: Final = 20.0        # without a scheduler, or without any worker, before the campaign ends
LOOK_S: Final = 1.0
BATCH_S: Final = 2.0            # wall time that a batch should take
MOST_IN_BATCH: Final = 64
BATCHES_PER_THREAD: Final = 3   # that the scheduler has at a time

SCHEMES: Final = ("tcp", "tls")
CERTIFICATES: Final = ("set distributed.comm.tls.ca-file, and key and cert of scheduler, worker and client, by one "
                       "authority (https://distributed.dask.org/en/stable/tls.html)")


class NoCluster(ValueError):
    """There is no cluster at the address, or it cannot run the campaign."""

    exit_code = 2


class ClusterLost(OSError):
    """The cluster has gone during the campaign."""

    exit_code = 2


class _Told(msgspec.Struct, frozen=True):
    points: list[Point]


class _Ended(msgspec.Struct, frozen=True):
    runs: list[tuple[int, Figures]] = []
    problems: list[str] = []


class Runner(WorkerPlugin):  # type: ignore[misc]
    """In a Dask worker: one process of ours for each of its threads, as long as the campaign lasts."""

    def __init__(self, name: str, source: bytes, host: Host) -> None:
        self.name = name
        self._source = source
        self._host: Host = host
        self._workers: dict[int, Workers] = {}

    def setup(self, worker: Any) -> None:
        self._workers = {}

    def teardown(self, worker: Any) -> None:
        for workers in self._workers.values():
            workers.close()

    def workers(self) -> Workers:
        thread = threading.get_ident()
        if thread not in self._workers:
            self._workers[thread] = Workers(msgspec.msgpack.decode(self._source, type=Source), self._host, 1)
        return self._workers[thread]


def run_batch(plugin: str, told: bytes) -> bytes:
    """In a Dask worker: run the points; return their figures, or why they cannot be run."""
    workers = get_worker().plugins[plugin].workers()
    try:
        found = workers.evaluate(msgspec.msgpack.decode(told, type=_Told).points)
        return msgspec.msgpack.encode(_Ended([(point.number, figures) for point, figures in found]))
    except ScenarioError as error:
        return msgspec.msgpack.encode(_Ended(problems=error.problems))


def check_batch(plugin: str, settings: list[dict[str, Any]]) -> list[str]:
    problems: list[str] = get_worker().plugins[plugin].workers().check(settings)
    return problems


def who(path: str) -> tuple[str, str]:
    """In a Dask worker: return its version of marconet, and the digest of the file at `path`, "" without it."""
    try:
        return version("marconet"), digest_of(Path(path))
    except OSError:
        return version("marconet"), ""


class Cluster:
    """The cluster at `address`, "tcp://127.0.0.1:8786" or "tls://host:8786"; as `Workers`, it evaluates points."""

    def __init__(self, source: Source, host: Host, address: str) -> None:
        self._address = checked_address(address)
        if self._address.startswith("tls://"):
            _check_certificates(address)
        self._source = source
        self._plugin = f"marconet-{uuid4().hex}"
        try:
            self._client = Client(self._address, timeout=CONNECT_S, set_as_default=False)
        except (ssl.SSLError, FatalCommClosedError) as error:
            raise NoCluster(f"--cluster {address}: one side does not accept the other's certificate "
                            f"({type(error).__name__}): {CERTIFICATES}") from None
        except (OSError, TimeoutError, ValueError) as error:
            raise NoCluster(f"--cluster {address}: no scheduler answers there within {CONNECT_S:g} s "
                            f"({type(error).__name__}): start one with `dask scheduler`, and workers with `dask worker "
                            f"{self._address}`") from None
        try:
            self._check_workers(address)
            self._client.register_plugin(Runner(self._plugin, encode(source), host), name=self._plugin)
        except BaseException:
            self._client.close(timeout=1)
            raise

    def __enter__(self) -> Cluster:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self.close()

    def close(self) -> None:
        """Have the workers end our processes, and part from the cluster."""
        if self._client.status == "running":
            with suppress(Exception):
                self._client.unregister_worker_plugin(self._plugin)
        self._client.close(timeout=2)

    def check(self, settings: Sequence[dict[str, Any]]) -> list[str]:
        """Load the scenario with each setting; return the problems found, one line each."""
        parts = [list(settings[start:start + SETTINGS_AT_ONCE])
                 for start in range(0, len(settings), SETTINGS_AT_ONCE)]
        found: dict[str, None] = {}
        for problems in self._results((check_batch, part) for part in parts):
            found |= dict.fromkeys(problems[1])
        return list(found)

    def evaluate(self, points: Iterable[Point]) -> Iterator[tuple[Point, Figures]]:
        """Run the points and yield the figures of each. ClusterLost if the scheduler or all workers are gone."""
        waiting = deque(points)
        run_s = 0.0

        def batches() -> Iterator[tuple[Any, Any]]:
            while waiting:
                most = min(MOST_IN_BATCH, max(1, int(BATCH_S / run_s))) if run_s else 1
                batch = [waiting.popleft()]
                while waiting and len(batch) < most and waiting[0].values == batch[0].values:
                    batch.append(waiting.popleft())
                sent[batch[0].number] = {point.number: point for point in batch}
                yield run_batch, encode(_Told(batch))

        sent: dict[int, dict[int, Point]] = {}
        for _, answer in self._results(batches()):
            ended = msgspec.msgpack.decode(answer, type=_Ended)
            if ended.problems:
                raise ScenarioError(ended.problems)
            numbers = {number for number, _ in ended.runs}
            of = sent.pop(next(first for first, batch in sent.items() if numbers & batch.keys()))
            mean_s = sum(figures.whole_s for _, figures in ended.runs) / len(ended.runs)
            run_s = mean_s if not run_s else 0.8 * run_s + 0.2 * mean_s
            for number, figures in ended.runs:
                yield of[number], figures

    def _results(self, tasks: Iterator[tuple[Any, Any]]) -> Iterator[tuple[int, Any]]:
        """Have the cluster call each (function, argument), some at a time; yield (place, result) as they come."""
        answers: SimpleQueue[Any] = SimpleQueue()
        flying: dict[str, tuple[int, Any]] = {}
        place, more, quiet_s = 0, True, time.monotonic()
        try:
            while more or flying:
                while more and len(flying) < BATCHES_PER_THREAD * max(1, self._threads()):
                    task = next(tasks, None)
                    more = task is not None
                    if task is not None:
                        future = self._client.submit(task[0], self._plugin, task[1], pure=False)
                        flying[future.key] = place, future
                        place += 1
                        future.add_done_callback(answers.put)
                if not flying:
                    break
                try:
                    future = answers.get(timeout=LOOK_S)
                except Empty:
                    if self._client.status == "running" and self._threads():
                        quiet_s = time.monotonic()
                    elif time.monotonic() - quiet_s > PATIENCE_S:
                        raise self._nobody_works() from None
                    continue
                quiet_s = time.monotonic()
                at, _ = flying.pop(future.key)
                yield at, self._result(future)
        finally:
            with suppress(Exception):
                self._client.cancel([future for _, future in flying.values()])

    def _result(self, future: Any) -> Any:
        if future.status == "finished":
            return self._fetched(future)
        error = future.exception(timeout=CONNECT_S) if future.status == "error" else None
        if isinstance(error, KilledWorker):
            raise ClusterLost(f"--cluster {self._address}: its workers were lost again and again while they ran the "
                              f"same batch, {error.last_worker.address} last: what has ended is kept; look into their "
                              "logs, then go on with --resume")
        if error is not None:
            raise error
        raise self._forgotten(future)

    def _fetched(self, future: Any) -> Any:
        """Return the answer of a batch that has ended. A worker holds it; if it dies first, another runs the batch."""
        there_s = time.monotonic()
        while True:
            try:
                return future.result(timeout=CONNECT_S)
            except CancelledError:
                raise self._forgotten(future) from None
            except TimeoutError:
                if self._threads():
                    there_s = time.monotonic()
                elif time.monotonic() - there_s > PATIENCE_S:
                    raise self._nobody_works() from None

    def _nobody_works(self) -> ClusterLost:
        return ClusterLost(f"--cluster {self._address}: no worker has been there for {PATIENCE_S:g} s: what has ended "
                           "is kept; start workers again and go on with --resume")

    def _forgotten(self, future: Any) -> ClusterLost:
        return ClusterLost(f"--cluster {self._address}: the scheduler has forgotten a batch ({future.status}): what "
                           "has ended is kept; go on with --resume")

    def _threads(self) -> int:
        """Return the threads of all workers, 0 if the scheduler does not answer."""
        if self._client.status != "running":
            return 0
        try:
            return sum(self._client.nthreads().values())
        except (OSError, TimeoutError):
            return 0

    def _check_workers(self, address: str) -> None:
        deadline_s = time.monotonic() + CONNECT_S
        while not self._client.nthreads():
            if time.monotonic() > deadline_s:
                raise NoCluster(f"--cluster {address}: its scheduler has no worker: start some with `dask worker "
                                f"{self._address}`")
            time.sleep(0.1)
        here = version("marconet"), self._source.digest
        for worker, there in self._client.run(who, self._source.path, on_error="return").items():
            if not isinstance(there, tuple):
                raise NoCluster(f"--cluster {address}: worker {worker} cannot run a campaign: {there!r}: install "
                                "marconet there")
            if there[0] != here[0]:
                raise NoCluster(f"--cluster {address}: worker {worker} has marconet {there[0]}, this process "
                                f"{here[0]}: install the same")
            if there[1] != here[1]:
                raise NoCluster(f"--cluster {address}: worker {worker} has {'another' if there[1] else 'no'} "
                                f"{self._source.path}: share the scenario's folder, at the same path")


def checked_address(address: str) -> str:
    """Return the address with its scheme; NoCluster for one that is neither on the loopback nor over TLS."""
    scheme, _, place = address.rpartition("://")
    scheme = scheme or "tcp"
    name = place.rpartition(":")[0].strip("[]")
    if scheme not in SCHEMES or not name:
        raise NoCluster(f"--cluster {address}: expected tcp://127.0.0.1:PORT, or tls://HOST:PORT")
    if scheme == "tcp" and not _is_loopback(name):
        raise NoCluster(f"--cluster {address}: a worker runs whatever it is told, and tcp:// says it in the open: use "
                        "tls:// with certificates in Dask's configuration (distributed.comm.tls), or a tunnel to "
                        "127.0.0.1")
    return f"{scheme}://{place}"


def _check_certificates(address: str) -> None:
    """Raise NoCluster if Dask's configuration has no certificate for this process, or none that can be read."""
    try:
        known = Security().get_connection_args("client").get("ssl_context") is not None
    except (OSError, ValueError) as error:
        raise NoCluster(f"--cluster {address}: cannot read the certificates that Dask's configuration names: {error}: "
                        f"{CERTIFICATES}") from None
    if not known:
        raise NoCluster(f"--cluster {address}: Dask's configuration names no certificate of this process: "
                        f"{CERTIFICATES}")


def _is_loopback(name: str) -> bool:
    try:
        return ipaddress.ip_address(name).is_loopback
    except ValueError:
        return name == "localhost"
