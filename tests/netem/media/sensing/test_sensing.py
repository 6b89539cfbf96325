from functools import partial
from math import sqrt
from random import Random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from netem.core.agenda import OFFER, SHOW, Agenda
from netem.core.fate import Fate
from netem.media.links import Links
from netem.media.sensing.field_of_view import Obstacle
from netem.media.sensing.sensing import Sensing
from netem.media.sensing.settings import SensingSettings
from netem.media.sensing.sight import LOOK, Detection, NothingSeen, unpack_sight
from netem.records.ledger import COLUMNS, Ledger

MS = 1_000_000
PERIOD_NS, LATENCY_NS, END_NS = 70 * MS, 20 * MS, 150_000 * MS


class Bench:
    def __init__(self, nodes=("evader", "pursuer"), **settings):
        self.agenda, self.ledger, self.news = Agenda(), Ledger(), []
        settings.setdefault("bodies", dict.fromkeys(nodes, ("x", "y", "theta")))
        self.medium = Sensing("view", SensingSettings(**{"exposure_period_ns": PERIOD_NS, "latency_ns": LATENCY_NS,
                                                         **settings}), nodes, self.agenda, self.ledger,
                              Links(self.ledger, self._deliver, {}), lambda place: Random(f"7/{place}"))

    def _deliver(self, receiver, medium, arrival_ns, data):
        self.news.append((arrival_ns, receiver, unpack_sight(data)))
        return True

    def offer(self, at_ns, sender, data):
        self.agenda.at(at_ns, OFFER, sender, partial(self.medium.offer, sender, data, at_ns))

    def show(self, at_ns, node, *values):
        self.agenda.at(at_ns, SHOW, node, partial(self.medium.show, node, values, at_ns))

    def run(self):
        self.agenda.run_before(END_NS)
        self.medium.finish(END_NS)
        self.ledger.finish(end_ns=END_NS)
        return self

    def fates(self):
        return [Fate(dict(zip(COLUMNS, row, strict=True))["fate"]) for row in self.ledger.rows]


def nonzero(bench):
    """The counters that counted something."""
    return {node: dict(+found) for node, found in bench.medium.counters().items() if +found}


def test_who_asks_learns_what_was_at_the_next_exposure_a_latency_later():
    bench = Bench()
    bench.offer(1 * MS, "pursuer", LOOK)
    for k, x_m in ((0, 1.0), (1, 2.0), (2, 3.0)):
        bench.show(k * PERIOD_NS, "evader", x_m, 0.5, 0.0, 0.0)
        bench.show(k * PERIOD_NS, "pursuer", 0.0, 0.0, 0.0, 0.0)

    bench.run()

    assert bench.news == [(PERIOD_NS + LATENCY_NS, "pursuer", Detection(PERIOD_NS, 2.0, 0.5, 0.0, "evader"))]


@pytest.mark.parametrize("first", ["look", "body"])
def test_a_look_at_the_instant_of_an_exposure_is_in_time_whoever_speaks_first(first):
    looker, body = ("a", "b") if first == "look" else ("b", "a")
    bench = Bench((looker, body), bodies={body: ("x", "y", "theta")})
    bench.offer(PERIOD_NS, looker, LOOK)
    bench.show(PERIOD_NS, body, 1.0, 0.0, 0.0, 0.0)

    bench.run()

    assert [time_ns for time_ns, _, _ in bench.news] == [PERIOD_NS + LATENCY_NS]


def test_out_of_view_and_occluded_are_fates_and_the_observer_learns_that_it_saw_nothing():
    bench = Bench(range_m=5.0, obstacles=(Obstacle((2.0, 0.0), 0.5),), every_exposure_to=("pursuer",))
    for k, x_m in enumerate((1.0, 4.0, 6.0)):
        bench.show(k * PERIOD_NS, "evader", x_m, 0.0, 0.0, 0.0)
        bench.show(k * PERIOD_NS, "pursuer", 0.0, 0.0, 0.0, 0.0)

    bench.run()

    assert set(bench.fates()) == {Fate.DELIVERED, Fate.OCCLUDED, Fate.OUT_OF_VIEW}
    assert [type(news) for _, _, news in bench.news] == [Detection, NothingSeen, NothingSeen]


def test_motion_capture_shows_a_vehicle_where_it_is_itself():
    bench = Bench(("evader", "uav"), fixed_cameras=("uav",), every_exposure_to=("uav",))
    bench.show(0, "evader", 4.0, 3.0, 0.0, 0.0)
    bench.show(0, "uav", 1.0, 2.0, 3.0, 0.5)

    bench.run()

    assert bench.news == [(LATENCY_NS, "uav", Detection(0, 4.0, 3.0, 0.0, "evader")),
                          (LATENCY_NS, "uav", Detection(0, 1.0, 2.0, 3.0, "uav"))]


def test_a_camera_on_another_body_looks_from_there_and_does_not_see_what_carries_it():
    bench = Bench(("companion", "drive", "evader"), range_m=1.0, cameras={"companion": "drive"},
                  bodies={"drive": ("x", "y", "theta"), "evader": ("x", "y", "theta")})
    bench.offer(0, "companion", LOOK)
    bench.show(0, "drive", 10.0, 10.0, 0.0, 0.0)
    bench.show(0, "evader", 10.5, 10.0, 0.0, 0.0)

    bench.run()

    assert bench.news == [(LATENCY_NS, "companion", Detection(0, 10.5, 10.0, 0.0, "evader"))]


def test_without_its_cameras_pose_an_observer_is_blind_and_that_is_counted():
    bench = Bench(("companion", "drive", "evader"), cameras={"companion": "drive"})
    bench.offer(0, "companion", LOOK)
    bench.show(0, "evader", 0.0, 0.0, 0.0, 0.0)

    bench.run()

    assert bench.news == [(LATENCY_NS, "companion", NothingSeen(0))]
    assert nonzero(bench) == {"companion": {"exposures without the camera's pose": 1}}


def test_nothing_arrives_below_the_lookahead_whenever_it_is_asked():
    bench, rng, bounds = Bench(every_exposure_to=("evader",)), Random("lookahead"), []
    for k in range(40):
        bench.show(k * PERIOD_NS, "evader", 1.0, 0.0, 0.0, 0.0)
        bench.show(k * PERIOD_NS, "pursuer", 0.0, 0.0, 0.0, 0.0)
        bench.offer(k * PERIOD_NS + rng.randrange(PERIOD_NS), "pursuer", LOOK)

    while bench.agenda.next_ns() < END_NS:
        t0_ns = bench.agenda.next_ns()
        bounds.append((len(bench.news), bench.medium.lookahead_ns(t0_ns)))
        bench.agenda.run_before(t0_ns + 1)

    assert len(bench.news) > 40
    assert all(arrival_ns >= bound_ns for sent, bound_ns in bounds for arrival_ns, _, _ in bench.news[sent:])


def test_noise_has_its_standard_deviation_and_a_further_observer_changes_nobodys_draw():
    looks = 2_000
    few, many = (Bench(("evader", *others), noise_m=0.1, bodies={"evader": ("x", "y", "theta")},
                       every_exposure_to=others) for others in (("pursuer",), ("another", "pursuer")))
    for bench in (few, many):
        for k in range(looks):
            bench.show(k * PERIOD_NS, "evader", 0.0, 0.0, 0.0, 0.0)
        bench.run()

    errors = [news.x_m for _, name, news in few.news if name == "pursuer"]
    sigma_m = sqrt(sum(error * error for error in errors) / len(errors))
    assert abs(sigma_m - 0.1) < 4 * 0.1 / sqrt(2 * len(errors))     # standard error of a standard deviation
    assert [news for news in many.news if news[1] == "pursuer"] == few.news


def test_bytes_that_are_no_look_are_counted():
    bench = Bench()
    bench.offer(0, "evader", b"?")

    bench.run()

    assert nonzero(bench) == {"evader": {"unreadable frames": 1}}
    assert bench.ledger.expected == 0


@pytest.mark.parametrize(("wrong", "says"), [
    ({"exposure_period_ns": 0}, "exposure_period_ns"),
    ({"latency_ns": 1}, "latency_ns"),
    ({"noise_m": -1.0}, "noise_m"),
    ({"bodies": {"evader": ("x", "y")}}, "bodies"),
    ({"cameras": {"pursuer": "nobody"}}, "no such node"),
    ({"every_exposure_to": ("nobody",)}, "no such node"),
    ({"fixed_cameras": ("nobody",)}, "no such node"),
    ({"fixed_cameras": ("pursuer",), "cameras": {"pursuer": "evader"}}, "cameras puts its camera on evader"),
    ({"bodies": {"evader": ("x", "y", "t")}, "cameras": {"evader": "pursuer"}}, "not one of the bodies"),
])
def test_settings_that_make_no_sense_are_refused(wrong, says):
    with pytest.raises(ValueError, match=says):
        Bench(**wrong)


places_m = st.tuples(*[st.floats(-3, 3).map(lambda value: round(value, 1))] * 2)


@given(at_m=st.lists(places_m, min_size=1, max_size=9), range_m=st.sampled_from([None, 0.5, 1.0, 2.5]),
       half_angle_deg=st.sampled_from([30.0, 180.0]), fixed=st.booleans())
def test_without_records_of_what_is_out_of_view_the_others_and_the_news_stay_the_same(at_m, range_m, half_angle_deg,
                                                                                      fixed):
    def look(**settings):
        nodes = [f"body_{number}" for number in range(len(at_m))]
        bench = Bench(nodes, range_m=range_m, half_angle_deg=half_angle_deg, every_exposure_to=tuple(nodes),
                      obstacles=(Obstacle((1.0, 1.0), 0.3),), fixed_cameras=(nodes[0],) if fixed else (), **settings)
        for number, (node, (x_m, y_m)) in enumerate(zip(nodes, at_m, strict=True)):
            bench.show(0, node, x_m, y_m, 0.0, 0.5 * number)
        return bench.run()

    full, short = look(), look(record_out_of_view=False)

    fate = COLUMNS.index("fate")
    assert short.news == full.news
    assert short.ledger.rows == [row for row in full.ledger.rows if Fate(row[fate]) is not Fate.OUT_OF_VIEW]


def test_a_body_at_the_very_edge_is_in_view_whether_the_others_are_recorded_or_not():
    bench = Bench(range_m=0.1 + 0.2, every_exposure_to=("pursuer",), record_out_of_view=False)
    bench.show(0, "evader", 0.1 + 0.2, 0.0, 0.0, 0.0)
    bench.show(0, "pursuer", 0.0, 0.0, 0.0, 0.0)

    assert [fate for fate in bench.run().fates() if fate is not Fate.DELIVERED] == []
    assert len(bench.ledger.rows) == 1
