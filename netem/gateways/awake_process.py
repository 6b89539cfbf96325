"""The program of a process that spins on each processor of its arguments, with the lowest priority.

It prints "spins", or why it does not. It has a session of its own: Linux shares processors among sessions first
(autogroup) and by priority only within one, so a spinning thread in the session of the run would take half a processor
from the programs of another terminal. Control groups share in the same way, and are not ours to change.

Source: sched(7), sections "SCHED_IDLE" and "The autogroup feature".
"""

import ctypes
import os
import signal
import sys
import threading

LEAST_SHARE = "19"              # the nice value of a session
PARENT_ENDED = 1                # PR_SET_PDEATHSIG


def main() -> None:
    library = ctypes.CDLL(None)                     # its calls release the interpreter's lock
    library.prctl(PARENT_ENDED, signal.SIGKILL)
    try:
        with open("/proc/self/autogroup", "w") as group:
            group.write(LEAST_SHARE)
    except OSError:
        pass                                        # a kernel that does not share by session
    lock = ctypes.c_int()                           # a pthread_spinlock_t: a thread that waits for it spins
    library.pthread_spin_init(ctypes.byref(lock), 0)
    library.pthread_spin_lock(ctypes.byref(lock))
    refused: list[str] = []

    def spin(processor: int, begun: threading.Event) -> None:
        try:
            os.sched_setaffinity(0, {processor})
            os.sched_setscheduler(0, os.SCHED_IDLE, os.sched_param(0))
        except OSError as error:
            refused.append(f"{error.strerror}: processor {processor}")
            return
        finally:
            begun.set()
        library.pthread_spin_lock(ctypes.byref(lock))

    for argument in sys.argv[1:]:
        begun = threading.Event()
        threading.Thread(target=spin, args=(int(argument), begun), daemon=True).start()
        begun.wait()
    print(*refused or ["spins"], sep="; ", flush=True)
    sys.stdin.read()                                # ends with the parent
    os._exit(0)


if __name__ == "__main__":
    main()
