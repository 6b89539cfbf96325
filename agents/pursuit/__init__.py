"""Pursuit with rare looks (Chapter 3): when to look, where to go, who follows whom.

Pure; nothing here waits or sends:

    pursuer         event by event: a detection has come, an instant has come -> look when, drive where
    sampling        when to look: periodic, or the adaptive policy of Figure 3.3
    law             the pursuer's law (3.6)
    zones           the parts of a field of view, and what makes them sure (`no_escape`)
    fusion_center   what several sensors tell each other, and who is in charge of which target
    chase, team     all of it without any network, against evaders: the reference for emulated runs

Programs that run it on robots:

    pursuer_robot       a differential drive behind CAN that looks, decides and drives by itself (`steering`)
    sensor_robot        the same in a team: reports over the radio what it sees, and is told whom to follow
    fusion_center_node  `fusion_center` at the other end of the radio (`team_frames`)
    evader_robot        whom they chase, driven by one of `evader_motions`

Places are (x, y) [m] in the plane, times integer nanoseconds of the caller's clock; looks are at multiples of T_s.
"""

from __future__ import annotations

Place = tuple[float, float]
