"""Frames of a team: what is packed is read back, and nothing that anybody sends raises."""

from math import inf, nan

import pytest
from hypothesis import given
from hypothesis import strategies as st

from agents.pursuit.team_frames import (
    MOST_NEWS,
    VERSIONS,
    Charges,
    News,
    Report,
    Team,
    newer,
    pack_charges,
    pack_news,
    pack_report,
    team_of,
    unpack,
)

TEAM = Team(("a", "b", "c"), ("t0", "t1"))
SIMPLE = st.integers(-64, 64).map(lambda n: n / 8)          # floats of 32 bits hold them exactly
PLACES = st.tuples(SIMPLE, SIMPLE)
REPORT = Report("b", "t1", True, 70_000_000, (1.5, -2.25), 0.125)


@given(st.sampled_from(TEAM.sensors), st.sampled_from(TEAM.targets), st.booleans(), st.integers(-(2**63), 2**63 - 1),
       PLACES)
def test_a_report_is_read_back(sensor, target, claims, seen_ns, place):
    report = Report(sensor, target, claims, seen_ns, place, 0.125)

    assert unpack(TEAM, pack_report(TEAM, report)) == report
    assert len(pack_report(TEAM, report)) == 32


@given(st.lists(st.tuples(st.integers(0, 2**62), PLACES), max_size=10))
def test_of_news_the_newest_that_fit_into_a_frame_are_read_back(detections):
    packed = pack_news(TEAM, News("c", "t0", tuple(detections)))

    assert len(packed) <= 100
    assert unpack(TEAM, packed) == News("c", "t0", tuple(detections[-MOST_NEWS:]))


@given(st.dictionaries(st.sampled_from(TEAM.sensors), st.sampled_from(TEAM.targets)), st.integers(0, 3 * VERSIONS))
def test_charges_are_read_back(target_of, version):
    assert unpack(TEAM, pack_charges(TEAM, Charges(version, target_of))) == Charges(version % VERSIONS, target_of)


@given(st.binary(max_size=120), st.sampled_from([b"", b"R", b"N", b"C"]))
def test_bytes_never_raise(data, first):
    unpack(TEAM, first + data)


@pytest.mark.parametrize("report", [
    REPORT._replace(place=(nan, 0.0)), REPORT._replace(place=(0.0, inf)), REPORT._replace(sigma_m=0.0),
    REPORT._replace(sigma_m=nan)])
def test_what_is_no_place_is_refused(report):
    assert unpack(TEAM, pack_report(TEAM, report)) is None


def test_numbers_of_nobody_and_frames_of_another_size_are_refused():
    packed = pack_report(TEAM, REPORT)
    small = Team(("a",), ("t0",))

    assert unpack(small, packed) is None
    assert unpack(small, pack_charges(TEAM, Charges(1, {}))) is None
    assert unpack(TEAM, packed[:-1]) is None
    assert unpack(TEAM, packed + b"\0") is None
    assert unpack(TEAM, b"C\0\0\2\xff\xff") is None                 # a third target, of two


def test_versions_go_round():
    assert newer(1, 0)
    assert newer(3, VERSIONS - 2)
    assert not newer(VERSIONS - 2, 3)
    assert not newer(7, 7)


@pytest.mark.parametrize("table", [{}, {"sensors": ["a"], "targets": []}, {"sensors": ["a", "a"], "targets": ["t"]}])
def test_a_team_that_is_none_is_refused(table):
    with pytest.raises(ValueError, match="names, each once"):
        team_of(table)
