"""Programs after the description of the library's examples run as scripts, unmodified, over a radio."""

from __future__ import annotations

from pathlib import Path

from tests.firmware_sim.zenoh_programs.runs import RADIO, log_of, virtually


def script(name: str, arguments: str = "", after_s: float = 0.0) -> str:
    parameters = f'{{ name = "{name}.py", arguments = "{arguments}", after_s = {after_s} }}'
    return f'program = "script:main"\nparameters = {parameters}'


def test_put_pub_and_sub(tmp_path: Path) -> None:
    virtually(tmp_path, {"sub": script("z_sub"), "put": script("z_put"),
                         "pub": script("z_pub", "--iter 3 --add-matching-listener")}, RADIO, length_s=6.0)

    heard = log_of(tmp_path, "sub").splitlines()
    assert ">> [Subscriber] Received SampleKind.PUT ('demo/example/zenoh-python-put': 'Put from Python!')" in heard
    assert [line for line in heard if "python-pub" in line] == [
        f">> [Subscriber] Received SampleKind.PUT ('demo/example/zenoh-python-pub': '[{number:4d}] Pub from Python!')"
        for number in range(3)]
    assert "Publisher has matching subscribers." in log_of(tmp_path, "pub")


def test_get_querier_and_queryable(tmp_path: Path) -> None:
    virtually(tmp_path, {"answers": script("z_queryable"),
                         "get": script("z_get", "-s demo/example/**?x=1 -p hello", 1.0),
                         "querier": script("z_querier", "--iter 2 -p more", 1.5)}, RADIO, length_s=8.0)

    reply = ">> Received ('demo/example/zenoh-python-queryable': 'Queryable from Python!')"
    assert log_of(tmp_path, "get").splitlines() == ["Sending Query 'demo/example/**?x=1'...", reply]
    assert log_of(tmp_path, "querier").splitlines().count(reply) == 2
    assert log_of(tmp_path, "answers").splitlines() == [
        ">> [Queryable ] Received Query 'demo/example/**?x=1' with payload: hello",
        ">> [Queryable ] Received Query 'demo/example/**' with payload: [   0] more",
        ">> [Queryable ] Received Query 'demo/example/**' with payload: [   1] more"]


def test_liveliness(tmp_path: Path) -> None:
    virtually(tmp_path, {"alive": script("z_liveliness"), "sees": script("z_sub_liveliness", "--history"),
                         "asks": script("z_get_liveliness", "", 1.0)},
              RADIO + '[[faults]]\non = "alive"\nkind = "kill"\nat_s = 2.0\n', length_s=16.0)

    assert log_of(tmp_path, "asks").splitlines() == [">> Alive token ('group1/zenoh-py')"]
    assert log_of(tmp_path, "sees").splitlines() == [
        ">> [LivelinessSubscriber] New alive token ('group1/zenoh-py')",
        ">> [LivelinessSubscriber] Dropped token ('group1/zenoh-py')"]
