"""Tracking a reference robot (sections 4.1, 4.6): controller, error dynamics and their bounds, pure closed loop.

`controller` and `reference_inputs` are what a robot program needs to drive; `error_system` is what a trigger of
`agents.triggering` needs to know of this loop; `closed_loop` runs both without any network, the reference for
emulated runs. Units: metres, radians, seconds; headings are unwrapped. Nothing here knows time but `closed_loop`.
"""
