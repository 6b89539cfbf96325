"""Pursuit with rare looks (Chapter 3): when to look, where to go, who follows whom. Pure; nothing here waits or sends.

    pursuer         event by event: a detection has come, an instant has come -> look when, drive where
    sampling        when to look: periodic, or the adaptive policy of Figure 3.3
    law             the pursuer's law (3.6)
    zones           the parts of a field of view, and what makes them sure (`no_escape`)
    fusion_center   what several sensors tell each other, and who is in charge of which target
    chase, team     all of it without any network, against evaders: the reference for emulated runs

Places are (x, y) [m] in the plane, times integer nanoseconds of the caller's clock; looks are at multiples of T_s.
"""

from __future__ import annotations

Place = tuple[float, float]
