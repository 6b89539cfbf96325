"""How many threads Zenoh has in a process of this project: its variable ZENOH_RUNTIME, set before it is imported."""

from typing import Final

# On few cores each message between Zenoh's thread pools costs a wake-up (docs/decisions/0004).
ONE_THREAD: Final = ("(rx: (handover: app), tx: (handover: app), acc: (handover: app), net: (handover: app), "
                     "app: (worker_threads: 1))")
