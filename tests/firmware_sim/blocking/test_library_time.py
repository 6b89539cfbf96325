"""Threads, locks and queues of the standard library in virtual time, and untouched for everybody else."""

from __future__ import annotations

import queue
import signal
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from firmware_sim.blocking.library_time import REPLACED, library_in_virtual_time
from netem.wire.messages import Grant
from tests.examples import examples

EVER_NS = 10**18


def trace_of(begin, main):
    """What `main(note)` noted, each with the time in ms."""
    noted = []

    def note(what):
        noted.append((round(time.monotonic_ns() / 1e6), what))

    run(begin(lambda: main(note)))
    return noted


def run(program, until_ns=EVER_NS):
    program.node.advance(Grant(1, until_ns, False, False, []))


# --- threads

@settings(max_examples=examples(25), deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.lists(st.lists(st.integers(0, 50), max_size=6), max_size=5))
def test_threads_that_sleep_wake_in_the_order_of_time(begin, sleeps_ms):
    def main(note):
        def sleeper(number):
            for duration_ms in sleeps_ms[number]:
                time.sleep(duration_ms / 1e3)
                note(number)

        for number in range(len(sleeps_ms)):
            threading.Thread(target=sleeper, args=(number,)).start()

    expected = [(sum(durations[:k + 1]), number)
                for number, durations in enumerate(sleeps_ms) for k in range(len(durations))]
    trace = trace_of(begin, main)

    assert [at for at, _ in trace] == sorted(at for at, _ in expected)
    assert sorted(trace) == sorted(expected)


def test_two_runs_of_many_threads_interleave_alike(begin):
    def main(note):
        jobs, done = queue.Queue(maxsize=2), queue.SimpleQueue()

        def worker(number):
            while (job := jobs.get()) is not None:
                time.sleep(job % 3 * 0.001)
                done.put((number, job))

        workers = [threading.Thread(target=worker, args=(number,)) for number in range(4)]
        for one in workers:
            one.start()
        for job in range(40):
            jobs.put(job)
        for _ in workers:
            jobs.put(None)
        for one in workers:
            one.join()
        while not done.empty():
            note(done.get())

    first, second = trace_of(begin, main), trace_of(begin, main)

    assert first == second
    assert sorted(job for _, (_, job) in first) == list(range(40))


def test_join_waits_for_the_end_or_for_the_time_out(begin):
    def main(note):
        thread = threading.Thread(target=time.sleep, args=(0.5,))
        note(thread.is_alive())
        thread.start()
        note(thread.is_alive())
        thread.join(0.2)
        note(thread.is_alive())
        thread.join()
        note(thread.is_alive())
        thread.join()

    assert trace_of(begin, main) == [(0, False), (0, True), (200, True), (500, False)]


def test_a_thread_cannot_wait_for_itself(begin):
    with pytest.raises(RuntimeError, match="cannot join current thread"):
        run(begin(lambda: threading.current_thread().join()))


def test_a_subclass_of_thread_and_thread_local_data_are_as_ever(begin):
    own = threading.local()

    def main(note):
        class Worker(threading.Thread):
            def run(self):
                own.value = self.name
                time.sleep(0.1)
                note(own.value)

        own.value = "main"
        workers = [Worker(name=f"worker {number}") for number in range(2)]
        for worker in workers:
            worker.start()
        time.sleep(0.2)
        note(own.value)

    assert trace_of(begin, main) == [(100, "worker 0"), (100, "worker 1"), (200, "main")]


def test_a_pool_of_threads_works_in_virtual_time(begin):
    def work(duration_s):
        time.sleep(duration_s)
        return duration_s

    def main(note):
        with ThreadPoolExecutor(2) as pool:
            for result in pool.map(work, [0.3, 0.1, 0.1, 0.4]):
                note(result)

    # two workers: 0.3 | 0.1 0.1 ->0.2, 0.4 from 0.2 on; results in the order of the calls
    assert trace_of(begin, main) == [(300, 0.3), (300, 0.1), (300, 0.1), (600, 0.4)]


# --- what waits

def test_an_event_is_a_sleep_that_can_be_ended(begin):
    def main(note):
        stop = threading.Event()
        threading.Timer(0.25, stop.set).start()
        while not stop.wait(0.1):
            note("tick")
        note("stop")

    assert trace_of(begin, main) == [(100, "tick"), (200, "tick"), (250, "stop")]


def test_a_lock_is_held_across_a_sleep(begin):
    def main(note):
        lock = threading.Lock()

        def holder(name):
            with lock:
                note(name)
                time.sleep(0.1)

        threads = [threading.Thread(target=holder, args=(name,)) for name in "abc"]
        for thread in threads:
            thread.start()
        time.sleep(0.05)
        note(lock.acquire(timeout=0.02))
        note(lock.acquire(blocking=False))
        note(lock.locked())

    assert trace_of(begin, main) == [(0, "a"), (50 + 20, False), (70, False), (70, True), (100, "b"), (200, "c")]


def test_misuse_of_a_lock_is_refused_as_ever(begin):
    refused = []

    def main():
        lock = threading.Lock()
        for misuse in (lock.release, lambda: lock.acquire(False, 1.0), lambda: lock.acquire(True, -2.0)):
            try:
                misuse()
            except (RuntimeError, ValueError) as error:
                refused.append(str(error))

    run(begin(main))

    assert refused == ["release unlocked lock", "can't specify a timeout for a non-blocking call",
                       "timeout value must be a non-negative number"]


def test_a_reentrant_lock_belongs_to_its_thread(begin):
    def main(note):
        lock = threading.RLock()

        def other():
            note(lock.acquire(timeout=0.1))
            with lock:
                note("mine")

        with lock, lock:
            threading.Thread(target=other).start()
            time.sleep(0.3)

    assert trace_of(begin, main) == [(100, False), (300, "mine")]


def test_condition_semaphore_and_barrier_wait_in_virtual_time(begin):
    def main(note):
        condition, semaphore, barrier = threading.Condition(), threading.Semaphore(1), threading.Barrier(2)
        ready = []

        def other():
            time.sleep(0.1)
            with condition:
                ready.append(True)
                condition.notify()
            with semaphore:
                time.sleep(0.2)
            time.sleep(0.3)
            barrier.wait()

        threading.Thread(target=other).start()
        with condition:
            note(condition.wait_for(lambda: bool(ready), timeout=0.05))
            note(condition.wait_for(lambda: bool(ready)))
        time.sleep(0.01)
        with semaphore:
            note("semaphore")
        barrier.wait()
        note("barrier")

    assert trace_of(begin, main) == [(50, False), (100, True), (300, "semaphore"), (600, "barrier")]


@pytest.mark.parametrize("kind", [queue.Queue, lambda: queue.SimpleQueue(), queue.LifoQueue])
def test_an_empty_queue_is_waited_for(begin, kind):
    def main(note):
        items = kind()
        threading.Timer(0.5, items.put, ["late"]).start()
        for timeout_s in (0.1, 0.1 + 0.2, 1.0):
            try:
                note(items.get(timeout=timeout_s))
            except queue.Empty:
                note("empty")

    assert trace_of(begin, main) == [(100, "empty"), (400, "empty"), (500, "late")]


@settings(max_examples=examples(50), deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.floats(1e-9, 5.0), st.floats(0.0, 5.0))
def test_a_wait_for_what_is_left_of_any_time_ends(begin, timeout_s, start_s):
    """`queue` computes with float seconds: what is left may round to nothing and still be more than zero."""
    waited = []

    def main():
        time.sleep(start_s)
        with suppress(queue.Empty):
            queue.Queue().get(timeout=timeout_s)
        waited.append(time.monotonic() - start_s)

    run(begin(main))

    assert waited == [pytest.approx(timeout_s, abs=3e-9)]       # two roundings to 1 ns, and at least 1 ns a wait


# --- who is left alone

def test_other_threads_find_what_they_always_did():
    with library_in_virtual_time():
        before_s = time.monotonic()
        time.sleep(0.002)
        took_s = time.monotonic() - before_s
        lock, items = threading.Lock(), queue.SimpleQueue()
        thread = threading.Thread(target=items.put, args=("done",))
        thread.start()
        thread.join()

        assert took_s >= 0.002
        assert abs(time.time() - time.time_ns() / 1e9) < 1.0
        assert "virtual" not in repr(lock)
        assert items.get(timeout=10.0) == "done"
        assert not thread.is_alive()


def test_everything_is_put_back():
    before = [getattr(place, name) for place, name, _ in REPLACED]

    with library_in_virtual_time():
        during = [getattr(place, name) for place, name, _ in REPLACED]

    assert all(now is not then for now, then in zip(during, before, strict=True))
    assert [getattr(place, name) for place, name, _ in REPLACED] == before
    assert signal.signal is before[[name for _, name, _ in REPLACED].index("signal")]
