"""The Marco Polo game as programs (Chapter 2, Figure 2.3): targets drive at random, and sensors bid to catch them.

    target_path     the way of a target through the area                                             pure
    target_robot    program: enters, turns, leaves or is captured
    track           what a sensor knows of one target, and where it expects the target               pure
    movers          drive a platform along places: omnidirectional, differential drive on CAN, quadrotor on MAVLink
    sensor_robot    program: detects, bids, captures; `sensor_automaton` declares its modes
    guidance        where a deployed sensor drives: `investigation`, `plain_pursuit`
    adaptive_robot  program: a sensor robot that looks on request and pursues by the Adaptive Filter (section 3.4);
                    `adaptive_pursuit` guides it, by `reachable_set` and `link_watch`
    game_table      the table [team] of a game
    grip_frames     the frames by which a UGV captures a target

Geometry and rewards are those of `agents.marco_polo`, the choice of who is deployed is `agents.bidding`.
"""
