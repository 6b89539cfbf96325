"""Signals files are checked with MCAP's own indexed reader and a JSON schema validator, not with our reader alone."""

from __future__ import annotations

import json
import math
from pathlib import Path

import jsonschema
import numpy as np
import pytest
from mcap.reader import make_reader

from netem.records import signals as signals_module
from netem.records.events import Event, hash_of_events, in_order
from netem.records.signals import SignalFile, read_recording, read_signals
from netem.wire.level import Level

SCENARIO = b'{"name": "two_robots", "seed": 7}'


def recorded(path: Path, samples: int = 20) -> SignalFile:
    recorder = SignalFile(path)
    recorder.declare("r1", [("y", "1"), ("u", "V")])
    recorder.declare("r2", [("gap", "m")])
    for k in range(samples):
        recorder.append("r2", k * 10_000_000, [k / 3])
        recorder.append("r1", k * 10_000_000, (math.sin(k), -k))
    recorder.event(Event(50, "r2", "adopted topology", "L2"))
    recorder.event(Event(10, "", "violation", "r1 handed out a frame before its promise", Level.ERROR))
    recorder.finish({"scenario": "two_robots", "seed": "7"}, SCENARIO)
    return recorder


def test_every_message_is_valid_under_its_schema_and_stands_at_its_simulated_time(tmp_path: Path) -> None:
    recorded(tmp_path / "signals.mcap")

    seen: dict[str, list[int]] = {}
    with (tmp_path / "signals.mcap").open("rb") as stream:
        for schema, channel, message in make_reader(stream, validate_crcs=True).iter_messages():
            assert schema is not None
            assert (schema.encoding, channel.message_encoding) == ("jsonschema", "json")
            body = json.loads(message.data)
            jsonschema.validate(body, json.loads(schema.data))
            assert message.log_time == message.publish_time
            assert message.sequence == 0
            seen.setdefault(channel.topic, []).append(message.log_time)
            if schema.name == "foxglove.Log":
                stamp = body["timestamp"]
                assert stamp["sec"] * 10**9 + stamp["nsec"] == message.log_time

    assert seen == {"/r1/signals": [k * 10_000_000 for k in range(20)],
                    "/r2/signals": [k * 10_000_000 for k in range(20)], "/events": [10, 50]}


def test_a_sample_of_the_wrong_type_would_be_refused_by_the_schema(tmp_path: Path) -> None:
    recorded(tmp_path / "signals.mcap")

    with (tmp_path / "signals.mcap").open("rb") as stream:
        schema, _, _ = next(iter(make_reader(stream).iter_messages(topics=["/r1/signals"])))

    assert schema is not None
    with pytest.raises(jsonschema.ValidationError):
        jsonschema.validate({"y": "high"}, json.loads(schema.data))


def test_units_scenario_and_metadata_are_in_the_file(tmp_path: Path) -> None:
    recorder = recorded(tmp_path / "signals.mcap")

    with (tmp_path / "signals.mcap").open("rb") as stream:
        reader = make_reader(stream)
        summary = reader.get_summary()
        attachment = next(iter(reader.iter_attachments()))
        metadata = next(iter(reader.iter_metadata()))

    assert summary is not None
    properties = {schema.name: json.loads(schema.data)["properties"] for schema in summary.schemas.values()}
    assert properties["r1.signals"]["u"]["description"] == "V"
    assert (attachment.name, attachment.media_type, attachment.data) == ("scenario.json", "application/json", SCENARIO)
    assert metadata.metadata == {"scenario": "two_robots", "seed": "7", "events_hash": recorder.events_hash}


def test_samples_and_events_read_back_as_they_were_given(tmp_path: Path) -> None:
    recorded(tmp_path / "signals.mcap")

    recording = read_recording(tmp_path / "signals.mcap")

    table = recording.signals["r1"]
    assert (table.names, table.units) == (("y", "u"), ("1", "V"))
    assert table.time_ns.tolist() == [k * 10_000_000 for k in range(20)]
    assert table.column("y").tolist() == [math.sin(k) for k in range(20)]
    assert recording.events == [Event(10, "", "violation", "r1 handed out a frame before its promise", Level.ERROR),
                                Event(50, "r2", "adopted topology", "L2")]
    assert recording.scenario == SCENARIO
    assert recording.whole


def test_values_without_a_json_number_read_back_as_nan_and_leave_their_neighbours_alone(tmp_path: Path) -> None:
    recorder = SignalFile(tmp_path / "signals.mcap")
    recorder.declare("r1", [("y", "1"), ("u", "V")])
    for value in (math.nan, math.inf, -math.inf, 1e308):
        recorder.append("r1", 0, (value, 2.5))
    recorder.finish({})

    table = read_signals(tmp_path / "signals.mcap")["r1"]

    np.testing.assert_array_equal(table.column("y"), [math.nan, math.nan, math.nan, 1e308])
    assert table.column("u").tolist() == [2.5] * 4


def test_samples_written_in_parts_keep_their_order(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(signals_module, "BUFFERED_SAMPLES", 7)

    recorded(tmp_path / "signals.mcap", samples=50)

    assert read_signals(tmp_path / "signals.mcap")["r2"].column("gap").tolist() == [k / 3 for k in range(50)]
    with (tmp_path / "signals.mcap").open("rb") as stream:
        times_ns = [message.log_time for _, _, message in make_reader(stream).iter_messages(topics=["/r1/signals"])]
    assert times_ns == [k * 10_000_000 for k in range(50)]


def test_a_file_cut_off_anywhere_reads_as_far_as_it_goes(tmp_path: Path) -> None:
    path = tmp_path / "signals.mcap"
    recorded(path)
    whole = path.read_bytes()
    found = set()

    for length in range(0, len(whole), 7):
        path.write_bytes(whole[:length])
        recording = read_recording(path)
        found.add(recording.signals["r1"].time_ns.size if "r1" in recording.signals else 0)

    assert found == {0, 20}


def test_a_recording_without_nodes_or_samples_reads_back_empty(tmp_path: Path) -> None:
    SignalFile(tmp_path / "none.mcap").finish({})
    silent = SignalFile(tmp_path / "silent.mcap")
    silent.declare("r1", [("y", "1")])
    silent.finish({})

    assert read_signals(tmp_path / "none.mcap") == {}
    assert read_recording(tmp_path / "silent.mcap").whole


def test_a_sample_of_the_wrong_length_is_refused_with_node_and_time(tmp_path: Path) -> None:
    recorder = SignalFile(tmp_path / "signals.mcap")
    recorder.declare("r1", [("y", "1"), ("u", "V")])

    with pytest.raises(ValueError, match=r"node 'r1' at 5 ns: 1 values for the 2 signals \['y', 'u'\]"):
        recorder.append("r1", 5, (1.0,))

    recorder.finish({})


@pytest.mark.parametrize("signals", [[("y", "1"), ("y", "V")]])
def test_a_signal_named_twice_is_refused(tmp_path: Path, signals: list[tuple[str, str]]) -> None:
    recorder = SignalFile(tmp_path / "signals.mcap")

    with pytest.raises(ValueError, match="each name once"):
        recorder.declare("r1", signals)

    recorder.finish({})


def test_the_order_in_which_nodes_report_does_not_change_the_order_of_events_or_their_hash() -> None:
    told_by_r1 = [Event(10, "r1", "heard", "a"), Event(10, "r1", "adopted topology", "b"), Event(20, "r1", "ended", "")]
    told_by_r2 = [Event(10, "r2", "heard", "c"), Event(15, "r2", "ended", "")]

    one, other = told_by_r1 + told_by_r2, told_by_r2 + told_by_r1

    assert in_order(one) == in_order(other)
    assert hash_of_events(one) == hash_of_events(other)


def test_the_events_hash_covers_what_happened_but_not_the_wall_clock() -> None:
    events = [Event(10, "r1", "heard", "a")]

    assert hash_of_events(events) != hash_of_events([Event(10, "r1", "heard", "b")])
    assert hash_of_events(events) != hash_of_events([])
    assert hash_of_events(events) == hash_of_events([*events, Event(11, "r1", "late", "3 ms", wall_clock=True)])
