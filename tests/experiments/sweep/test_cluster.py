"""Campaigns on a Dask cluster: a real scheduler and two real workers on the loopback."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from concurrent.futures import CancelledError
from contextlib import contextmanager
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from experiments.judge.campaign import load_campaign
from experiments.sweep.campaign import Wanted, sweep
from experiments.sweep.messages import Point, Source
from experiments.sweep.vary import parse
from experiments.sweep.workers import Workers
from tests.processes import alive

pytest.importorskip("distributed", reason="needs Dask: pip install 'marconet[cluster]'")
pytest.importorskip("trustme")

import trustme

from experiments.sweep import cluster as clusters
from experiments.sweep.cluster import Cluster, ClusterLost, NoCluster, checked_address

# Dask's own threads and loops warn of sockets and tasks that it leaves to the end of the process.
pytestmark = pytest.mark.filterwarnings("ignore::ResourceWarning", "ignore::DeprecationWarning",
                                        "ignore::pytest.PytestUnraisableExceptionWarning")
DASK = [sys.executable, "-m", "dask"]


def started(log: Path, *words: str, config: Path | None = None) -> subprocess.Popen[bytes]:
    environment = os.environ | ({} if config is None else {"DASK_CONFIG": str(config)})
    with log.open("wb") as file:
        return subprocess.Popen([*DASK, *words], stdout=file, stderr=file, start_new_session=True, env=environment)


def told(log: Path, pattern: str, process: subprocess.Popen[bytes]) -> str:
    end_s = time.monotonic() + 60
    while (found := re.search(pattern, log.read_text(errors="replace"))) is None:
        assert process.poll() is None, log.read_text()
        assert time.monotonic() < end_s, log.read_text()
        time.sleep(0.05)
    return found[1]


def of_all_threads(pid: int) -> list[int]:
    """Ids of the child processes of all threads of `pid`."""
    return [int(child) for file in Path(f"/proc/{pid}/task").glob("*/children") for child in file.read_text().split()]


@pytest.fixture
def cluster(tmp_path: Path) -> Iterator[Any]:
    with running(tmp_path, "tcp") as found:
        yield found


@pytest.fixture
def tls_cluster(tmp_path: Path) -> Iterator[Any]:
    """As `cluster`, over TLS; `config` is Dask's configuration of all, with the certificates of one authority."""
    config = certified(tmp_path / "certificates")
    with running(tmp_path, "tls", config) as found:
        found.config = config
        yield found


def certified(folder: Path) -> Path:
    """Make an authority and a certificate by it; return a configuration as in distributed's page on TLS."""
    folder.mkdir()
    authority = trustme.CA()
    certificate = authority.issue_cert("127.0.0.1", "localhost")
    authority.cert_pem.write_to_path(folder / "ca.pem")
    certificate.private_key_and_cert_chain_pem.write_to_path(folder / "own.pem")
    own = {"cert": str(folder / "own.pem"), "key": str(folder / "own.pem")}
    (folder / "dask.yaml").write_text(json.dumps({"distributed": {"comm": {
        "require-encryption": True, "tls": {"ca-file": str(folder / "ca.pem"), "scheduler": own, "worker": own,
                                            "client": own}}}}))            # JSON is YAML
    return folder / "dask.yaml"


@contextmanager
def running(folder: Path, scheme: str, config: Path | None = None) -> Iterator[Any]:
    """A scheduler, `address`, and two `workers` of one thread each, without nannies, so that a dead one stays dead."""
    processes = []
    try:
        scheduler = started(folder / "scheduler.log", "scheduler", "--host", "127.0.0.1", "--protocol", scheme,
                            "--port", "0", "--no-dashboard", config=config)
        processes.append(scheduler)
        address = told(folder / "scheduler.log", rf"Scheduler at: +({scheme}://\S+)", scheduler)
        for number in (1, 2):
            log = folder / f"worker{number}.log"
            processes.append(started(log, "worker", address, "--no-nanny", "--nthreads", "1", "--no-dashboard",
                                     "--local-directory", str(folder), "--name", f"w{number}", config=config))
            told(log, r"(Registered to)", processes[-1])
        yield SimpleNamespace(address=address, scheduler=scheduler, workers=processes[1:])
    finally:
        for process in processes:
            if process.poll() is None:
                process.kill()
            process.wait()


@pytest.mark.slow
def test_a_campaign_loses_no_run_when_a_worker_is_killed(cluster: Any, beacons: Path, tmp_path: Path) -> None:
    killed: list[int] = []

    def progress(ended: int, total: int, broken: int) -> None:
        if ended >= 5 and not killed:
            killed.extend(of_all_threads(cluster.workers[0].pid))
            os.kill(cluster.workers[0].pid, signal.SIGKILL)
            cluster.workers[0].wait()

    out = tmp_path / "out"
    sweep(Wanted(Source.of(beacons, overrides=("agents.b.parameters.wall_ms=2.0",)),
                 [parse("impairments[0].loss_ratio=0.1,0.3")], 20, cluster=cluster.address, out=out, folders=0),
          progress)

    found = {(row.setting, row.seed): row.figures.ledger_hash for row in load_campaign(out).rows}
    with Workers(Source.of(beacons), "inline", 1) as here:
        alone = {(point.number, point.seed): figures.ledger_hash for point, figures in here.evaluate(
            Point(setting, {"impairments[0].loss_ratio": loss}, seed) for setting, loss in ((0, 0.1), (1, 0.3))
            for seed in (7, 26))}
    assert killed
    assert len(found) == 40
    assert alone.items() <= found.items()
    end_s = time.monotonic() + 20
    while any(map(alive, killed)):                              # our process of the Dask worker ends with it
        assert time.monotonic() < end_s, "it outlives the Dask worker"
        time.sleep(0.05)


@pytest.mark.slow
def test_a_cluster_that_loses_all_workers_is_told_and_keeps_what_has_ended(
        cluster: Any, beacons: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(clusters, "PATIENCE_S", 2.0)

    def progress(ended: int, total: int, broken: int) -> None:
        if ended == 3:
            for worker in cluster.workers:
                worker.kill()

    told = r"(no worker has been there for 2 s|has forgotten a batch \(lost\)): what has ended is kept"   # who is first
    with pytest.raises(ClusterLost, match=told):
        sweep(Wanted(Source.of(beacons, overrides=("agents.b.parameters.wall_ms=5.0",)), seeds=200,
                     cluster=cluster.address, out=tmp_path / "out", folders=0), progress)

    assert 3 <= len(load_campaign(tmp_path / "out").rows) < 200


class Answer:
    """Stands for Dask's future, of which no test can kill the worker between the end of a batch and the answer."""

    status = "finished"

    def __init__(self, *what: BaseException | bytes) -> None:
        self._what = list(what)

    def result(self, timeout: float) -> bytes:
        found = self._what.pop(0)
        if isinstance(found, BaseException):
            raise found
        return found


def cluster_with(threads: int) -> clusters.Cluster:
    found = object.__new__(clusters.Cluster)
    found._address = "tcp://127.0.0.1:8786"
    found._client = SimpleNamespace(status="running", nthreads=lambda: {"worker": threads} if threads else {})
    return found


def test_an_answer_whose_worker_died_comes_from_another_or_the_cluster_is_lost(monkeypatch: pytest.MonkeyPatch
                                                                               ) -> None:
    monkeypatch.setattr(clusters, "PATIENCE_S", 0.0)

    assert cluster_with(1)._result(Answer(TimeoutError(), TimeoutError(), b"ended")) == b"ended"
    with pytest.raises(ClusterLost, match="no worker has been there for 0 s: what has ended is kept; start workers"):
        cluster_with(0)._result(Answer(TimeoutError(), b"ended"))
    with pytest.raises(ClusterLost, match="has forgotten a batch"):
        cluster_with(1)._result(Answer(CancelledError()))


def swept(beacons: Path, address: str, out: Path, config: Path | None) -> subprocess.CompletedProcess[str]:
    """`marconet sweep --cluster ADDRESS`, with what it knows of certificates from Dask's configuration."""
    environment = {key: value for key, value in os.environ.items() if key != "DASK_CONFIG"}
    return subprocess.run(
        [sys.executable, "-m", "marconet.command_line", "sweep", str(beacons), "--vary", "impairments[0].loss_ratio="
         "0.1,0.3", "--seeds", "6", "--cluster", address, "--out", str(out), "--folders", "0", "--quiet"],
        capture_output=True, text=True, check=False, timeout=300,
        env=environment | ({} if config is None else {"DASK_CONFIG": str(config)}))


@pytest.mark.slow
def test_a_campaign_over_tls_gives_what_this_machine_gives_alone(tls_cluster: Any, beacons: Path, tmp_path: Path
                                                                 ) -> None:
    done = swept(beacons, tls_cluster.address, tmp_path / "out", tls_cluster.config)

    assert (done.returncode, done.stderr) == (0, "")
    found = {(row.setting, row.seed): row.figures.ledger_hash for row in load_campaign(tmp_path / "out").rows}
    with Workers(Source.of(beacons), "inline", 1) as here:
        alone = {(point.number, point.seed): figures.ledger_hash for point, figures in here.evaluate(
            Point(setting, {"impairments[0].loss_ratio": loss}, seed) for setting, loss in ((0, 0.1), (1, 0.3))
            for seed in range(7, 13))}
    assert found == alone
    # Both workers took part, over TLS: the scheduler knows them by such addresses.
    logs = (tmp_path / "scheduler.log").read_text()
    assert len(set(re.findall(r"Register worker addr: (tls://\S+)", logs))) == 2
    assert "tcp://" not in logs


@pytest.mark.parametrize(("which", "told"), [
    pytest.param("none", "Dask's configuration names no certificate of this process: set distributed.comm.tls.ca-file",
                 marks=pytest.mark.slow),
    ("another", "one side does not accept the other's certificate"),
    pytest.param("missing", "cannot read the certificates that Dask's configuration names", marks=pytest.mark.slow)])
def test_without_a_certificate_of_the_clusters_authority_there_is_no_campaign(
        tls_cluster: Any, beacons: Path, tmp_path: Path, which: str, told: str) -> None:
    config = None if which == "none" else certified(tmp_path / "others")
    if which == "missing":
        (tmp_path / "others" / "own.pem").unlink()
    began_s = time.monotonic()

    done = swept(beacons, tls_cluster.address, tmp_path / "out", config)

    assert done.returncode == 2
    assert len(done.stderr.splitlines()) == 1
    assert done.stderr.startswith(f"--cluster {tls_cluster.address}: {told}")
    assert not (tmp_path / "out").exists()
    assert time.monotonic() - began_s < 60


def test_a_worker_with_another_scenario_is_refused(cluster: Any, beacons: Path) -> None:
    """The file that this process loaded has changed before the workers look."""
    source = Source(str(beacons), "0")

    with pytest.raises(NoCluster, match="share the scenario's folder, at the same path"):
        Cluster(source, "inline", cluster.address)


def test_a_cluster_that_is_not_there_is_told(beacons: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(clusters, "CONNECT_S", 0.5)

    with pytest.raises(NoCluster, match=r"no scheduler answers there .* start one with `dask scheduler`"):
        sweep(Wanted(Source.of(beacons), cluster="tcp://127.0.0.1:9", out=tmp_path / "out"))

    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("address", ["tcp://10.0.0.5:8786", "10.0.0.5:8786", "tcp://cluster.example:8786",
                                     "tcp://0.0.0.0:8786"])
def test_an_address_of_another_machine_needs_tls(address: str) -> None:
    with pytest.raises(NoCluster, match="a worker runs whatever it is told"):
        checked_address(address)


@pytest.mark.parametrize("address", ["ws://127.0.0.1:1", "127.0.0.1", "", "inproc://x:1"])
def test_an_address_that_is_none_is_refused(address: str) -> None:
    with pytest.raises(NoCluster, match="expected tcp://127"):
        checked_address(address)


def test_addresses_of_this_machine_and_of_tls_are_taken() -> None:
    assert checked_address("127.0.0.1:8786") == "tcp://127.0.0.1:8786"
    assert checked_address("tcp://[::1]:8786") == "tcp://[::1]:8786"
    assert checked_address("localhost:8786") == "tcp://localhost:8786"
    assert checked_address("tls://cluster.example:8786") == "tls://cluster.example:8786"
