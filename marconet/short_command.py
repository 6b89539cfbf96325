"""Settings that save processor time in a command that ends within a second, such as `marconet check`.

OpenBLAS starts a thread for each core when NumPy is imported. The matrices of a check are too small to use them, but
the threads poll for work. Python's garbage collector visits all objects imported so far, many times during the imports.

Both settings apply to the whole process, so only a process that runs nothing else may call `expect_to_end_soon`.
"""

from __future__ import annotations

import gc
import os

COLLECT_AFTER_OBJECTS = 100_000      # the runner's threshold


def expect_to_end_soon() -> None:
    """Let NumPy, if it is imported after this call, use one thread, and let Python collect garbage less often.

    A value of OPENBLAS_NUM_THREADS that the user has set is kept.
    """
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    gc.set_threshold(COLLECT_AFTER_OBJECTS, *gc.get_threshold()[1:])
