"""Links of a pursuing UGV that have failed: the UGV infers this from messages that are due and do not arrive.

    radio   another sensor has told a sight of the target and, within the time in which the next exposure was to be told
            of, neither a sight nor that it has lost sight; sensors that pursue do not look at each exposure
    view    a look has no answer, not even that nothing is in view
    grip    the target was within the capture distance at a look, and no answer to the grip has come

Links that failed once in a pursuit are kept: the target may have got away meanwhile. Names are those of the emulator,
`medium: sender -> receiver`. A sensor that is dead counts as a link.
Not modelled: a blind camera, which says that it sees nothing.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping

from agents.marco_polo_game.track import Seen


class LinkWatch:
    def __init__(self, own: str, target: str, media: tuple[str, str, str], told_within_ns: int, since_ns: int) -> None:
        """`media`: names of radio, view and grip. `told_within_ns`: from a sight until its sensor has told of the next
        exposure. `since_ns`: sights from then on are followed by such news."""
        self._own, self._target = own, target
        self._radio, self._view, self._grip = media
        self._told_within_ns, self._since_ns = told_within_ns, since_ns
        self.failed: list[str] = []                 # links, in the order in which they failed

    def look_failed(self) -> None:
        """Note a look without an answer."""
        self._note(f"{self._view}: {self._target} -> {self._own}")

    def grip_failed(self) -> None:
        """Note a grip without an answer."""
        self._note(f"{self._grip}: {self._own} -> {self._target}")

    def listen(self, seen: Mapping[str, Seen], out_of_view_ns: Mapping[str, int], scanning: Collection[str],
               now_ns: int) -> None:
        """Judge the radio by the newest sight of each sensor, and when it told that it had lost sight.

        `scanning` are the other sensors that look at each exposure."""
        for name in scanning:
            if name in seen and (self._since_ns <= seen[name].at_ns < now_ns - self._told_within_ns
                                 and out_of_view_ns.get(name, -1) <= seen[name].at_ns):
                self._note(f"{self._radio}: {name} -> {self._own}")

    def _note(self, link: str) -> None:
        if link not in self.failed:
            self.failed.append(link)
