"""Settings of the process of a command that runs for less than a second, `marconet check`: they save processor time
while it imports its libraries.

OpenBLAS starts a thread for every core when NumPy is imported; on matrices as small as a check's they are never used,
but wait actively. Python's garbage collector goes through everything imported so far again and again.

Only for a process that is the command's own: both settings hold for the whole process.
"""

from __future__ import annotations

import gc
import os

COLLECT_AFTER_OBJECTS = 100_000      # the runner's threshold


def expect_to_end_soon() -> None:
    """Let NumPy, where it is imported after this call, use one thread, and let Python collect garbage less often.

    A value of OPENBLAS_NUM_THREADS that the user has set stays.
    """
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    gc.set_threshold(COLLECT_AFTER_OBJECTS, *gc.get_threshold()[1:])
