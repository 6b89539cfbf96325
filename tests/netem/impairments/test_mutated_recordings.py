"""Recordings with random damage: each is read, or refused in lines that name the file; nothing else happens."""

from __future__ import annotations

from random import Random

import pytest

from netem.core.transit import Transit
from netem.impairments.csv_columns import RecordingError
from netem.impairments.delay import Delay
from netem.impairments.trace import Trace

FILES = 4000
WHOLE = [
    "time_s,delay_ms,lost\n0.0,12.1,0\n0.1,,1\n0.2,11.9,0\n0.35,1e1,false\n",
    "seq\ttime_ms\tdelay_us\treceived\trssi\n1\t1712345678250\t10\t1\t-60\n2\t1712345678350\t\t0\t-61\n",
    "# run 3\r\ntime_s;delay_ms;note\r\n0,0;10,5;a\r\n0,1;11,5;b\r\n",
    "probability,delay_ms\n0,1\n0.5,2\n1,9\n",
    '\ufeff"delay_s","lost"\n"0.001","0"\n"0.002","1"\n',
]
SCRAPS = [b",", b";", b"\t", b"\n", b"\r\n", b"\r", b'"', b"\0", b"\xff\xfe", b"\xef\xbb\xbf", b"-", b"1e999",
          b"1e-999", b"nan", b"inf", b"9" * 40, b"0." + b"1" * 40, b"#", b" ", b"delay_ms", b"time_s", b"lost", b"true",
          b"2", "\u0663".encode(), b"_", b"0x1F", b"," * 60, b"x" * 3000, b"1_000", b"+-1", b"1e", b"."]
MAPPINGS = [{}, {}, {}, {}, {}, {}, {"delay_ms": "delay_us"}, {"lost": "rssi"}, {"time_s": "seq", "delay_ns": "rssi"},
            {"delay": "x"}]


def mutated(rng: Random) -> bytes:
    content = bytearray(rng.choice(WHOLE).encode(rng.choice(["utf-8"] * 9 + ["utf-16"])))
    for _ in range(rng.randint(1, 3)):
        at = rng.randint(0, len(content))
        match rng.randint(0, 4):
            case 0:
                content[at:at] = rng.choice(SCRAPS)
            case 1:
                del content[at:at + rng.randint(1, 12)]
            case 2:
                content[at:at + 1] = bytes([rng.randrange(256)])
            case 3:
                content[at:at] = content[rng.randint(0, at):at]
            case 4:
                content[at:at + rng.randint(0, 6)] = rng.choice(SCRAPS)
    return bytes(content)


@pytest.mark.slow
def test_a_damaged_recording_is_read_or_refused_in_lines_that_name_it(tmp_path):
    rng, path = Random(9), tmp_path / "damaged.csv"
    read, refused = 0, set()

    for number in range(FILES):
        path.write_bytes(mutated(rng))
        columns = rng.choice(MAPPINGS)
        try:
            if number % 4 == 0:
                impairment = Delay(0, "empirical", file=str(path), columns=columns, rng=rng)
            else:
                impairment = Trace(str(path), rng.choice(["frame", "time"]), columns=columns)
        except RecordingError as error:
            lines = str(error).splitlines()
            refused.add(lines[0])
            assert lines
            assert len(lines) < 60
            assert all(line.startswith((str(path), "columns=")) and line.isprintable() and len(line) < 600
                       for line in lines), lines
            continue
        read += 1
        assert all(copy.arrival_ns >= 5 for n in range(6) for copy in impairment.carry(Transit(n, 5, 5, b"")))

    assert read > FILES / 20
    assert len(refused) > 100
