"""Words that the tests of the interface share: a bus, frames that arrive, messages as python-can calls them valid."""

from __future__ import annotations

import can
from can.util import CAN_FD_DLC
from hypothesis import HealthCheck, settings
from hypothesis import strategies as st

from netem.media.can.frame import CanFrame, pack
from tests.examples import examples

MS = 1_000_000
per_test = settings(max_examples=examples(60), suppress_health_check=[HealthCheck.function_scoped_fixture])


def a_bus(**options):
    return can.Bus(interface="marconet", **{"channel": "can0", **options})


def arrival(can_id=0x123, data=b"", **flags):
    return pack(CanFrame(can_id, data, **flags))


def identifiers(most):
    return st.one_of(st.just(0), st.just(most), st.integers(0, most))


@st.composite
def messages(draw, fd=None):
    """What python-can calls a valid message."""
    extended = draw(st.booleans())
    is_fd = draw(st.booleans()) if fd is None else fd
    remote = not is_fd and draw(st.booleans())
    size = draw(st.sampled_from(CAN_FD_DLC if is_fd else range(9)))
    return can.Message(
        arbitration_id=draw(identifiers(0x1FFFFFFF if extended else 0x7FF)), is_extended_id=extended,
        is_remote_frame=remote, dlc=size, data=None if remote else draw(st.binary(min_size=size, max_size=size)),
        is_fd=is_fd, bitrate_switch=is_fd and draw(st.booleans()),
        error_state_indicator=is_fd and draw(st.booleans()), check=True)
