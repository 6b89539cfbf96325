"""The names at which the page of a view behind a door may be asked for, the first of which is printed."""

from __future__ import annotations

import pytest

from experiments.run.live.view_door import hosts_of


@pytest.mark.parametrize(("listen", "port", "named", "hosts"), [
    ("127.0.0.1", 8000, ["127.0.0.1", "::1", "localhost"], ["127.0.0.1:8000", "[::1]:8000", "localhost:8000"]),
    ("192.168.1.5", 8000, ["Base.local"], ["192.168.1.5:8000", "base.local:8000"]),
    ("0.0.0.0", 8000, ["192.168.1.5"], ["192.168.1.5:8000"]),
    ("::", 8000, [], ["[::]:8000"]),
    ("127.0.0.1", 443, [], ["127.0.0.1:443", "127.0.0.1"]),     # browsers leave the port of https out
])
def test_a_door_is_asked_for_where_it_listens_and_by_the_names_of_its_certificate(listen, port, named, hosts):
    assert hosts_of(listen, port, named) == hosts
