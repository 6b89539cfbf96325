"""Pursuit of targets with rare looks (Chapter 3).

A *look* is a request for one exposure of a sensor. Algorithms, which neither wait nor send:

    pursuer         turns events (a detection, an instant) into decisions: when to look next, where to drive
    sampling        decides when to look: periodically, or by the adaptive policy of Figure 3.3
    law             the pursuer's control law (3.6)
    target_estimators   where the target is expected from its detections: `circle`, `ukf`, `particle`
    zones           the parts of a field of view; `no_escape` has the conditions under which no target escapes
    fusion_center   merges the readings of several sensors and decides which sensor follows which target
    chase, team     runs of these algorithms against evaders without any network: the reference for emulated runs

Programs that run them on robots:

    pursuer_robot       a differential drive behind CAN that looks, decides and drives by itself (`steering`)
    sensor_robot        the same in a team: sends its readings over the radio and follows the target assigned to it
    free_pursuer        a pursuer that moves freely, as the no-escape theorem assumes
    fusion_center_node  runs `fusion_center` at the other end of the radio (`team_frames`)
    evader_robot        the target, driven by one of `evader_motions`

Places are (x, y) [m] in the plane, times integer nanoseconds of the caller's clock; looks are at multiples of T_s.
"""

from __future__ import annotations

Place = tuple[float, float]
