"""Which links a pursuing UGV has lost, as it can tell by itself: what has to come over them has not come.

    radio   a sensor that waits tells each sight of the target. It saw the target at y, a distance d from its place, so
            it sees it at each exposure up to  t + (R - d - margin) / v_max;  the latest of these exposures that was
            to be heard of by now has not been told
    view    a look has no answer, not even that nothing is in view
    grip    the target was within the capture distance at a look, and no answer to the grip has come

A link that works again is not lost any more. Names are those of the emulator, `medium: sender -> receiver`.
Not modelled: obstacles that hide the target from the other sensor; a blind camera, which says that it sees nothing.
"""

from __future__ import annotations

from collections.abc import Mapping
from math import dist

from agents.marco_polo_game.track import Seen
from agents.pursuit import Place


class LinkWatch:
    def __init__(self, own: str, target: str, media: tuple[str, str, str], radius_m: Mapping[str, float],
                 v_max_mps: float, margin_m: float, exposure_ns: int, told_within_ns: int, since_ns: int) -> None:
        """`media`: names of radio, view and grip. `told_within_ns`: from an exposure until all have heard of it.
        `since_ns`: exposures before are told of only if the target has come into view."""
        self._own, self._target = own, target
        self._radio, self._view, self._grip = media
        self._radius_m, self._v_max_mps, self._margin_m = radius_m, v_max_mps, margin_m
        self._exposure_ns, self._told_within_ns = exposure_ns, told_within_ns
        self._since_ns = since_ns
        self._unanswered = self._gripped = False

    def look(self, answered: bool, within_capture: bool) -> None:
        """Take the result of a look, after the time that an answer and a grip need."""
        self._unanswered, self._gripped = not answered, answered and within_capture

    def lost(self, seen: Mapping[str, Seen], standing: Mapping[str, Place], now_ns: int) -> list[str]:
        """Return the lost links; `seen`: newest detection by each sensor, `standing`: places of those that wait."""
        found = [f"{self._radio}: {name} -> {self._own}" for name, place in sorted(standing.items())
                 if name in seen and name != self._own and self._is_silent(name, seen[name], place, now_ns)]
        if self._unanswered:
            found.append(f"{self._view}: {self._target} -> {self._own}")
        if self._gripped:
            found.append(f"{self._grip}: {self._own} -> {self._target}")
        return found

    def _is_silent(self, name: str, seen: Seen, place: Place, now_ns: int) -> bool:
        inside_m = self._radius_m[name] - dist(seen.place, place) - self._margin_m
        in_view_until_ns = seen.at_ns + int(inside_m / self._v_max_mps * 1e9)
        newest_ns = min(in_view_until_ns, now_ns - self._told_within_ns) // self._exposure_ns * self._exposure_ns
        return newest_ns > max(seen.at_ns, self._since_ns)
