"""Three servos on a bus against a simulation of each loop by itself, and against the largest delay of a stable loop."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from pyarrow import parquet
from scipy.linalg import expm
from scipy.optimize import brentq
from scipy.signal import dlsim, dlti

from agents.servo.controller import ControllerSettings
from agents.servo.messages import number_in, pack_number
from agents.servo.motor import MotorSettings
from agents.servo.pd import Pd
from agents.servo.sensor import SensorSettings
from experiments.judge.run_data import RunData, load_run
from experiments.run.runner import run
from experiments.scenario import find, load
from netem.media.can.frame import CanFrame, pack

Matrix = NDArray[np.float64]
A, B = np.array([[-1.0, 0.0], [1.0, 0.0]]), np.array([[1000.0], [0.0]])
H_NS, K, TD, N = 10_000_000, 1.0, 0.04, 100.0
a = TD / (N * H_NS * 1e-9 + TD)
b = N * K * a
QUIET = "team.servo.G=[[0.0]]"


@cache
def hold(h_ns: float) -> tuple[Matrix, Matrix]:
    """exp(A h) and the effect of an input that is held over h."""
    block = np.zeros((3, 3))
    block[:2, :2], block[:2, 2:] = A, B
    step = expm(block * h_ns * 1e-9)
    return step[:2, :2], step[:2, 2:]


def emulated(out: Path, *overrides: str, host: Any = "inline") -> RunData:
    run(load(find("three_servos_slow_bus"), overrides=["expect={}", *overrides]), host=host, out=out, report=False)
    return load_run(out)


def arrivals_ns(folder: Path, sender: str, receiver: str) -> list[int]:
    rows = parquet.read_table(folder / "ledger.parquet").to_pylist()
    return [row["delivered_ns"] for row in sorted(rows, key=lambda row: row["number"])
            if (row["medium"], row["sender"], row["receiver"]) == ("can", sender, receiver)]


def single(number: float) -> float:
    return float(np.float32(number))


@pytest.mark.parametrize("bit_rate_bps", [80_000, pytest.param(1_000_000, marks=pytest.mark.slow)])
def test_each_servo_moves_as_a_simulation_of_its_loop_with_the_delays_of_the_bus(
        bit_rate_bps: int, tmp_path: Path) -> None:
    """Oracle: matrix exponentials between the instants at which inputs change, found in the ledger."""
    data = emulated(tmp_path, QUIET, f"media.can.bit_rate_bps={bit_rate_bps}")

    for servo in (1, 2, 3):
        measured = arrivals_ns(tmp_path, f"sensor{servo}", f"controller{servo}")
        commanded = arrivals_ns(tmp_path, f"controller{servo}", f"motor{servo}")
        table = data.signals[f"motor{servo}"]
        x, u, now_ns, y_before, d, steps = np.zeros((2, 1)), 0.0, 0, 0.0, 0.0, 0
        to_set: list[tuple[int, float]] = []
        instants = sorted({*range(0, 4_000_000_000, H_NS), *commanded, *table.time_ns.tolist()})
        seen = []
        for at_ns in instants:
            f, g = hold(at_ns - now_ns)
            x, now_ns = f @ x + g * u, at_ns
            if to_set and to_set[0][0] == at_ns:
                u = to_set.pop(0)[1]
            if at_ns % H_NS == 0:
                y = single(x[1, 0])
                reference = 1.0 if measured[steps] % 10**9 < 5 * 10**8 else -1.0
                d = a * d + b * (y_before - y)
                y_before = y
                if steps < len(commanded):
                    to_set.append((commanded[steps], single(max(-10.0, min(10.0, K * (reference - y) + d)))))
                steps += 1
            if at_ns in table.time_ns:
                seen.append(x[1, 0])

        # a rounding to single precision that falls to the other side would show as 6e-8 K of the amplitude
        np.testing.assert_allclose(table.column("y[1]"), seen, rtol=0, atol=1e-9)


def test_without_a_network_the_controller_and_the_servo_are_scipys_loop() -> None:
    f, g = hold(H_NS)
    law = Pd(K, TD, N, H_NS * 1e-9)
    # states: x, D(k-1), y(k-1); the loop is one linear system from r to y
    u_row, d_row = np.array([[0.0, -K - b, a, b]]), np.array([[0.0, -b, a, b]])
    closed = np.vstack([np.hstack([f, np.zeros((2, 2))]) + g @ u_row, d_row, [[0.0, 1.0, 0.0, 0.0]]])
    position = np.array([[0.0, 1.0, 0.0, 0.0]])
    system = dlti(closed, np.vstack([g * K, [[0.0], [0.0]]]), position, np.zeros((1, 1)), dt=0.01)
    reference = np.where(np.arange(200) % 100 < 50, 1.0, -1.0)

    x, positions = np.zeros((2, 1)), []
    for r in reference:
        positions.append(x[1, 0])
        x = f @ x + g * law.command(r, x[1, 0])

    np.testing.assert_allclose(positions, dlsim(system, reference)[1][:, 0], rtol=0, atol=1e-11)


def radius(delay_ns: float) -> float:
    """Spectral radius of the sampled loop with a constant delay (Astrom and Wittenmark 1997, section 2.3)."""
    periods = int(delay_ns // H_NS)
    rest_ns = delay_ns - periods * H_NS
    size = 4 + periods + 1                      # x, D, y(k-1), u(k-1), u(k-2), ...
    d_row = np.zeros(size)
    d_row[1:4] = -b, a, b
    u_row = d_row.copy()
    u_row[1] -= K
    inputs = [u_row, *np.eye(size)[4:]]
    late, (rest, early) = hold(rest_ns)[1], hold(H_NS - rest_ns)
    loop = np.zeros((size, size))
    loop[:2, :2] = hold(H_NS)[0]
    loop[:2] += early * inputs[periods] + rest @ late * inputs[periods + 1]
    loop[2], loop[3, 1], loop[4] = d_row, 1.0, u_row
    for k in range(1, periods + 1):
        loop[4 + k, 3 + k] = 1.0
    return float(np.abs(np.linalg.eigvals(loop)).max())


def test_the_bus_keeps_the_delays_below_the_limit_of_stability_until_it_is_too_slow(tmp_path: Path) -> None:
    limit_ns = brentq(lambda delay_ns: radius(delay_ns) - 1, 0, 2 * H_NS)
    assert 13.7e6 < limit_ns < 13.9e6           # as the scenario says

    delays_ns = {}
    for bit_rate_bps in (80_000, 45_000):
        data = emulated(tmp_path / str(bit_rate_bps), f"media.can.bit_rate_bps={bit_rate_bps}")
        commanded = arrivals_ns(tmp_path / str(bit_rate_bps), "controller3", "motor3")
        delays_ns[bit_rate_bps] = max(at_ns - k * H_NS for k, at_ns in enumerate(commanded) if at_ns >= 0)
        largest = np.abs(data.signals["motor3"].column("y[1]")).max()
        assert (largest > 100) == (delays_ns[bit_rate_bps] > limit_ns)

    assert delays_ns[80_000] < limit_ns < delays_ns[45_000]


def test_both_hosts_leave_the_same_ledger(tmp_path: Path) -> None:
    scenario = load(find("three_servos_slow_bus"), duration_s=0.5, overrides=["expect={}"])

    hashes = {host: run(scenario, host=host, out=tmp_path / host, report=False).summary.ledger_hash
              for host in ("inline", "process")}

    assert hashes["inline"] == hashes["process"]


def test_a_frame_that_is_no_number_of_this_identifier_is_passed_over() -> None:
    assert number_in(pack_number(0x110, 0.5), 0x110) == 0.5
    assert number_in(pack_number(0x110, 0.5), 0x111) is None
    assert number_in(pack(CanFrame(0x110, b"\0" * 8)), 0x110) is None
    assert number_in(pack(CanFrame(0x110, b"\0" * 4, extended=True)), 0x110) is None


@pytest.mark.parametrize(("settings", "keys", "message"), [
    (MotorSettings, {"command_id": 0x800}, "command_id=0x800: expected 11 bits"),
    (SensorSettings, {"encoder": "e", "measured_id": -1}, "measured_id=-0x1: expected 11 bits"),
    (ControllerSettings, {"measured_id": 1, "command_id": 2, "period_ns": 0}, "period_ns=0"),
    (ControllerSettings, {"measured_id": 1, "command_id": 2, "period_ns": 1, "limit": 0.0}, "limit=0.0")])
def test_settings_that_do_not_fit_are_refused(settings: Any, keys: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        settings(**keys)
