"""The equations of the tracking loop with held measurements: (4.3), (4.46) and the output y~ of (4.47).

R1 drives u = command(x + e, omega^_p), held; R2 drives omega_p = omega^_p - e_omega. Then x' = f and e' = -x' = g with

    |g(x, e)| <= A |e| + y~(x)   componentwise, for all e and all x in the reachable set                    (4.25)

`error_bound` has A. Differs from the dissertation: section 4.6 says ||x||^2 <= k (||y~||^2 + ||(e, e_omega)||^2) "for
any k >= 2". That fails for slow references: at x = (0, x2, 0) and omega_R2 = 0, y~ is k2 |v_R2| (x2^2, 0, |x2|), so k
must be at least 1 / (k2 v_R2)^2 as x2 goes to 0, and no k is valid for v_R2 = omega_R2 = 0 (R2 stands still).
"""

from __future__ import annotations

from math import cos, sin

from agents.tracking.controller import Command, Inputs, State, TrackingController

Error = tuple[float, float, float]          # e = x^ - x


def state_rate(x: State, command: Command, inputs: Inputs) -> State:
    """Return x' of (4.3); `command` and `inputs` are the velocities that R1 and R2 drive."""
    x1, x2, x3 = x
    v1, omega1 = command
    v2, omega2 = inputs
    return omega1 * x2 - v1 + v2 * cos(x3), -omega1 * x1 + v2 * sin(x3), omega2 - omega1


def error_rate(controller: TrackingController, x: State, e: Error, held: Inputs, input_error: Inputs) -> Error:
    """Return e' = g(x, e, omega^_p, e_omega) of (4.46); `held` is omega^_p, `input_error` is e_omega."""
    believed = (x[0] + e[0], x[1] + e[1], x[2] + e[2])
    real = Inputs(held.v_mps - input_error.v_mps, held.omega_rad_s - input_error.omega_rad_s)
    f1, f2, f3 = state_rate(x, controller.command(believed, held), real)
    return -f1, -f2, -f3


def y_tilde(controller: TrackingController, x: State, held: Inputs, input_error: Inputs) -> Error:
    """Return y~ of (4.47), the part of the bound that does not depend on e; it is the nominal system's output."""
    x1, x2, x3 = x
    k2v, k3 = controller.k2_per_m2 * abs(held.v_mps), controller.k3_per_s
    v2 = held.v_mps - input_error.v_mps
    forward = controller.k1_per_s * x1 + input_error.v_mps * cos(x3) - held.omega_rad_s * x2 - k3 * x2 * x3
    sideways = held.omega_rad_s * x1 + k3 * x1 * x3 - v2 * sin(x3)
    return (k2v * x2 * x2 + abs(forward), k2v * abs(x1 * x2) + abs(sideways),
            k2v * abs(x2) + abs(input_error.omega_rad_s + k3 * x3))
