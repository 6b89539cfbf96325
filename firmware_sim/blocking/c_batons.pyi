"""What c_batons.c and python_batons.py implement alike: batons between threads of which one runs at a time.

Who holds no baton waits for it; who gives one lets the thread go on that waits for it, now or later. A baton that was
given is there for one `take`. A signal is handled while the process's main thread waits, and its exception raised.
"""

class Baton:
    def give(self) -> None:
        """Let the thread that takes the baton go on; the baton must not be there already."""
    def take(self, timeout_s: float = -1, /) -> bool:
        """Wait until the baton is there, and take it; False if it is not within `timeout_s` (below 0: for ever).

        Raises OverflowError for more than `threading.TIMEOUT_MAX`, 292 years.
        """

def pass_on(to: Baton, own: Baton, timeout_s: float = -1, /) -> bool:
    """Give `to`, then take `own` as `Baton.take` does, holding the interpreter's lock at no time between them."""
