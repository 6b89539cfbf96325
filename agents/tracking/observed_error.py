"""The tracking error that a companion estimates from its looks: x^ of section 5.2.5, for one robot.

Between two looks the estimate moves with the held command and the inputs known; a look corrects it. `particle` draws
its particles anew around a look that none of them can explain. NumPy is imported when a robot has an observer.

Not modelled: lag of the wheels, delay of the command; where they matter particles die more often.
"""

from __future__ import annotations

from random import Random
from typing import TYPE_CHECKING

from agents.tracking.controller import Command, Inputs, State

if TYPE_CHECKING:
    from agents.optimal_triggering.observers import ParticleObserver, UnscentedObserver


class ObservedError:
    def __init__(self, kind: str, rng: Random, measured: float, disturbance: float) -> None:
        """Take a `kind` of "particle" or "unscented" and the amplitudes of nu and e_omega."""
        import numpy as np

        from agents.optimal_triggering.held_loop import HeldLoop
        from agents.optimal_triggering.observers import ParticleObserver, UnscentedObserver

        loop = HeldLoop(Inputs(0.0, 0.0))
        self._observer: ParticleObserver | UnscentedObserver
        if kind == "particle":
            self._observer = ParticleObserver(loop, 1, np.random.default_rng(rng.getrandbits(64)),
                                              measured=measured, inputs=disturbance)
        else:
            self._observer = UnscentedObserver(loop, 1, measured=measured, inputs=disturbance)
        self._seen_ns: int | None = None
        self._held = Inputs(0.0, 0.0)
        self.drawn_anew = False                 # the last look killed all particles

    def look(self, seen_ns: int, y: State, command: Command | None, inputs: Inputs) -> State:
        """Return x^ for a measurement y at seen_ns; `command` was held until then, `inputs` are those from then on."""
        import numpy as np

        from agents.optimal_triggering.held_loop import HeldLoop

        observer = self._observer
        held_s = 0.0 if self._seen_ns is None else max(seen_ns - self._seen_ns, 0) * 1e-9
        observer.loop = HeldLoop(self._held)
        before = observer.reinitialized
        u = np.array(command or (0.0, 0.0))[:, None]
        x1, x2, x3 = observer.look(np.array([0]), np.array(y)[:, None], u, np.array([held_s]))[:, 0].tolist()
        self.drawn_anew = observer.reinitialized > before
        self._seen_ns, self._held = seen_ns, inputs
        return x1, x2, x3
