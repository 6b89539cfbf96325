"""Tracking of a reference robot (sections 4.1, 4.6): controller, error dynamics and bounds, closed loop, programs.

A robot program drives by `controller` and `reference_inputs`; `error_system` gives the triggers of `agents.triggering`
the model of this loop; `closed_loop` runs both without any network, the reference for emulated runs. Units: metres,
radians, seconds; headings are unwrapped.
"""
