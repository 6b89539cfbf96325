"""What c_batons.c and python_batons.py implement alike: batons between threads of which one runs at a time.

A thread that takes a baton waits until another thread has given it; a baton that was given is there for one `take`. No
baton is given a second time before it is taken: Python refuses that, C does not check it. A signal is handled while the
process's main thread waits, and its exception raised. In Python there is also an `EventBaton`, without a time-out.
"""

class Baton:
    def give(self) -> None:
        """Let the thread that takes the baton go on; the baton must not be there already."""
    def take(self, timeout_s: float = -1, /) -> bool:
        """Wait until the baton is there, and take it; False if it is not within `timeout_s` (below 0: for ever).

        Raises OverflowError for more than `threading.TIMEOUT_MAX`, 292 years.
        """

def pass_on(to: Baton, own: Baton, timeout_s: float = -1, /) -> bool:
    """Give `to`, then take `own` as `Baton.take` does; in C, without the interpreter's lock between the two."""
