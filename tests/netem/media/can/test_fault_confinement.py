"""Error counters by the rules of ISO 11898-1, 12.1, where a single node is enough to see them."""

import pytest

from netem.media.can.fault_confinement import FaultConfinement, State


def after(*events: tuple[str, int]) -> FaultConfinement:
    faults = FaultConfinement()
    for name, times in events:
        for _ in range(times):
            getattr(faults, name)()
    return faults


@pytest.mark.parametrize(("errors", "state"), [(15, State.ERROR_ACTIVE), (16, State.ERROR_PASSIVE),
                                               (31, State.ERROR_PASSIVE), (32, State.BUS_OFF)])
def test_a_sender_is_passive_from_128_and_bus_off_from_256_at_8_an_error(errors: int, state: State) -> None:
    assert after(("transmit_error", errors)).state is state


def test_a_receiver_is_passive_from_128_at_1_an_error_and_never_bus_off() -> None:
    assert after(("receive_error", 127)).state is State.ERROR_ACTIVE
    assert after(("receive_error", 128)).state is State.ERROR_PASSIVE
    assert after(("receive_error", 1000)).state is State.ERROR_PASSIVE


def test_an_error_takes_a_sender_eight_frames_to_make_up_for() -> None:
    faults = after(("transmit_error", 16), ("sent", 1))

    assert (faults.transmit_errors, faults.state) == (127, State.ERROR_ACTIVE)
    assert after(("transmit_error", 2), ("sent", 15)).transmit_errors == 1
    assert after(("transmit_error", 2), ("sent", 99)).calm


def test_a_passive_receiver_is_active_again_after_one_frame_with_a_counter_of_119_to_127() -> None:
    faults = after(("receive_error", 500), ("received", 1))

    assert 119 <= faults.receive_errors <= 127
    assert faults.state is State.ERROR_ACTIVE
    assert after(("receive_error", 3), ("received", 5)).calm


def test_recovery_starts_from_nothing() -> None:
    faults = after(("receive_error", 7), ("transmit_error", 32), ("recovered", 1))

    assert faults.calm
    assert faults.state is State.ERROR_ACTIVE
