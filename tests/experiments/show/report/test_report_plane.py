import json
from dataclasses import replace
from pathlib import Path

import msgspec
import numpy as np
import pytest

from experiments.judge.run_data import RunData, load_run
from experiments.show.report import plane as plane_module
from experiments.show.report.plane import MOST_INSTANTS, MOST_ON_GROUND, plane
from netem.core.fate import Fate
from netem.core.frame import Frame
from netem.media.sensing.field_of_view import Obstacle
from netem.media.sensing.settings import SensingSettings
from netem.records.ledger import Ledger
from netem.records.signal_table import SignalTable
from netem.records.signals import SignalFile

MS = 1_000_000
SETTINGS = SensingSettings(10 * MS, MS, range_m=2.0, half_angle_deg=60.0, cameras={"companion": "drive"},
                           obstacles=(Obstacle((1.0, 2.0), 0.5),))
PLAN = msgspec.to_builtins(SETTINGS.floor_plan())


def a_run(folder: Path, signals: dict[str, list[tuple[str, str]]]) -> RunData:
    """Two bodies for a second; who sees body `evader` is asked at 0.3 s and 0.6 s, and sees it the first time."""
    folder.mkdir()
    ledger, recorder = Ledger(folder / "ledger.parquet", metadata={}), SignalFile(folder / "signals.mcap")
    for node, names in signals.items():
        recorder.declare(node, names)
        for k in range(101):
            recorder.append(node, k * 10 * MS, [k * 0.01 + column for column in range(len(names))])
    for number, fate in ((0, Fate.DELIVERED), (1, Fate.OUT_OF_VIEW)):
        at_ns = (number + 1) * 300 * MS
        ledger.expect(1, "view")
        ledger.close(Frame("view", "evader", number, at_ns, b"", at_ns, at_ns), "companion", fate,
                     delivered_ns=at_ns + MS if fate is Fate.DELIVERED else -1)
    ledger.finish()
    scenario = {"name": "plane", "length_ns": 1_000 * MS, "media": {"view": {"floor_plan": PLAN}}}
    recorder.finish({}, json.dumps(scenario).encode())
    (folder / "scenario.json").write_text(json.dumps(scenario))
    return load_run(folder)


POSE = [("x", "m"), ("y", "m"), ("theta", "rad")]


@pytest.fixture
def drawn(tmp_path):
    return plane(a_run(tmp_path / "run", {
        "evader": POSE, "drive": POSE,
        "companion": [("estimate_x", "m"), ("estimate_y", "m"), ("x_of_nothing", "m"), ("x", "1"), ("y", "1"),
                      ("detection_x", "m"), ("detection_y", "m")]}))


def test_bodies_are_at_each_instant_where_their_last_sample_was(drawn):
    assert [body["label"] for body in drawn["bodies"]] == ["drive", "evader"]
    assert len(drawn["instants_s"]) == MOST_INSTANTS
    assert (drawn["instants_s"][0], drawn["instants_s"][-1]) == (0.0, 1.0)
    for body in drawn["bodies"]:
        for t_s, x_m, y_m, heading_rad in zip(drawn["instants_s"], body["x"], body["y"], body["heading"], strict=True):
            sampled = int(round(t_s * 1e9) // (10 * MS)) * 0.01
            assert (x_m, y_m, heading_rad) == pytest.approx((sampled, sampled + 1, sampled + 2), abs=1e-6)


def test_the_instants_that_the_page_leads_to_are_among_those_of_the_animation(tmp_path):
    drawn = plane(a_run(tmp_path / "run", {"evader": POSE}), [123_456_789, 5_000_000_000])

    assert 0.123456789 in drawn["instants_s"]
    assert drawn["instants_s"] == sorted(set(drawn["instants_s"]))
    assert drawn["instants_s"][-1] == 1.0               # nothing is later than the run
    assert len(drawn["bodies"][0]["x"]) == len(drawn["instants_s"]) == MOST_INSTANTS + 1


def test_what_is_believed_is_apart_and_numbers_without_metres_or_partner_are_no_places(drawn):
    assert [body["label"] for body in drawn["believed"]] == ["companion: estimate"]
    assert drawn["believed"][0]["heading"] is None


def test_who_believes_has_the_colour_of_the_body_that_carries_its_camera(drawn):
    assert [believed["body"] for believed in drawn["believed"]] == ["drive"]
    assert [points["body"] for points in drawn["detections"]] == ["drive"]


def test_detections_are_points_at_the_instants_at_which_they_are_new(tmp_path):
    seen = [(k, float("nan"), 0.0) for k in range(2)] + [(2, 1.0, 2.0), (3, 1.0, 2.0), (4, 1.0, 3.0), (5, 1.5, 3.0)]
    data = a_run(tmp_path / "run", {"evader": POSE})
    table = SignalTable("eye", ("detection_x", "detection_y"), ("m", "m"), np.array([k * 10 * MS for k, _, _ in seen]),
                        np.array([[x, y] for _, x, y in seen]))

    points, = plane(replace(data, signals={**data.signals, "eye": table}))["detections"]

    assert points["t_s"] == pytest.approx([0.02, 0.04, 0.05])
    assert list(zip(points["x"], points["y"], strict=True)) == [(1.0, 2.0), (1.0, 3.0), (1.5, 3.0)]


def test_where_there_are_too_many_looks_those_out_of_view_go_first(tmp_path, monkeypatch):
    monkeypatch.setattr(plane_module, "MOST_LOOKS", 1)

    drawn = plane(a_run(tmp_path / "run", {"evader": POSE, "drive": POSE}))

    assert ([look["fate"] for look in drawn["looks"]], drawn["looks_total"]) == (["delivered"], 2)


def test_looks_are_where_the_body_was_at_the_exposure(drawn):
    assert [(look["observer"], look["body"], look["t_s"], look["seen"], look["fate"], look["x"])
            for look in drawn["looks"]] == [("companion", "evader", 0.3, True, "delivered", 0.3),
                                            ("companion", "evader", 0.6, False, "out of view", 0.6)]
    assert drawn["looks_total"] == 2


def test_motion_capture_is_no_look(tmp_path):
    data = a_run(tmp_path / "run", {"evader": POSE, "drive": POSE})
    data.scenario["media"]["view"]["floor_plan"] = {**PLAN, "unasked": ["companion"]}

    assert plane(data)["looks_total"] == 0


def test_fields_of_view_ride_on_what_carries_the_camera(drawn):
    assert drawn["views"] == [{"observer": "companion", "carrier": "drive", "range_m": 2.0, "half_angle_deg": 60.0}]
    assert drawn["obstacles"] == [{"x": 1.0, "y": 2.0, "radius_m": 0.5}]


def test_an_observer_among_the_bodies_carries_its_own_field_of_view():
    pose = ("x", "y", "theta")
    settings = SensingSettings(10 * MS, MS, range_m=1.5, bodies={"a": pose, "b": pose, "c": pose}, cameras={"eye": "b"},
                               every_exposure_to=("a", "c", "eye", "d"), fixed_cameras=("c",))

    assert settings.floor_plan().carriers == {"a": "a", "eye": "b"}


def test_on_declared_ground_bodies_out_of_the_picture_have_no_place_and_no_path(tmp_path):
    data = a_run(tmp_path / "run", {"evader": POSE})            # x = t, y = 1 + t
    data.scenario["ground"] = {"area_x_m": [0.2, 0.6], "area_y_m": [0.0, 4.0], "shapes": [
        {"what": "box", "corners_m": [[0.0, 0.0], [1.0, 0.0], [1.0, 2.0]], "solid": True}]}

    found = plane(data)

    assert found["ground"] == {"area": [[0.2, 0.6], [0.0, 4.0]], "picture": ((0.0, pytest.approx(0.8)), (-0.2, 4.2)),
                               "shapes": [{"what": "box", "solid": True, "x": [0.0, 1.0, 1.0], "y": [0.0, 0.0, 2.0]}]}
    (body,) = found["bodies"]
    for t_s, x_m, y_m in zip(found["instants_s"], body["x"], body["y"], strict=True):
        sampled = int(round(t_s * 1e9) // (10 * MS)) * 0.01
        assert (x_m, y_m) == ((None, None) if sampled > 0.8 + 1e-9 else pytest.approx((sampled, sampled + 1), abs=1e-6))
    assert max(body["path_x"]) == pytest.approx(0.8)
    assert len(found["instants_s"]) == MOST_ON_GROUND


def test_without_bodies_there_is_no_plane(tmp_path):
    assert plane(a_run(tmp_path / "run", {"r1": [("y", "m"), ("z", "m")]})) is None
