"""The Marco Polo game: geometry and decisions of robotic sensors that track targets in a bounded area (Chapter 2).

Pure functions and values: no network, no board, no clock. In the order of a game:

    game_parameters        the constants that the dissertation leaves open
    sight                  the headings under which a point sees each field of view
    track_coverage         P_S^k: the probability that a track crosses at least k fields of view; its gain by a move
    area_coverage          share of the area that fields of view cover
    placement              places of the sensors with the greatest P_S^k under a least area coverage
    track_line             total least-squares line through detections, and where it leaves the area
    c_target               the truncated cone in which the next detection of a target is expected (Proposition 1)
    legs                   how far a target that turns at random has come, and when it has left its C-target
    detection_probability  P_R of a sensor that stands, and the observation cells
    sweep                  the maneuver across a C-target, and its P_R
    cells                  the cell decomposition, and the cells that a platform can occupy
    connectivity           the connectivity graph of free cells, and A* on it
    reward                 (2.4): which cell a sensor would go to, and what that is worth
    missed_chords          share of tracks that a camera with exposures misses
    checks                 refusals of a game that cannot be played

The area is a rectangle, `agents.pursuit.law.Area`. Places are (x, y) [m] in it; several places are an array of shape
(n, 2). A field of view is a disc: a place and a radius [m]; the part outside the area sees nothing.
"""
