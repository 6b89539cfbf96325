from math import sqrt

import numpy as np
import pytest

from agents.marco_polo.cells import Cells, square
from agents.marco_polo.connectivity import ConnectivityGraph
from agents.marco_polo.detection_probability import detection_probability, observation_cells
from agents.marco_polo.reward import (
    INVESTIGATION,
    PURSUIT,
    RewardWeights,
    Sensor,
    investigation_offer,
    pursuit_offer,
)
from agents.marco_polo.track_coverage import track_coverage
from agents.marco_polo.track_line import fit_track
from tests.agents.marco_polo.layouts import AREA, CENTRES, OBSTACLE, RADII, ZONE

CELLS = Cells(AREA, 0.5)
TRACK = fit_track([(1.0, 1.0), (2.0, 1.8)])
DIAGONAL = 10.0 * sqrt(2.0)


def sensor(number):
    return Sensor(tuple(CENTRES[number]), float(RADII[number]), np.delete(CENTRES, number, 0), np.delete(RADII, number))


def graph(number, *obstacles):
    others = [square(tuple(place), 0.5) for place in np.delete(CENTRES, number, 0)]
    return ConnectivityGraph(CELLS, CELLS.free([*obstacles, *others], 0.5))


@pytest.mark.parametrize("number", [0, 1, 4, 6])
def test_the_offer_is_the_greatest_reward_over_all_observation_cells(number):
    made = graph(number, ZONE)

    offer = investigation_offer(sensor(number), made, TRACK, 3, 0.3)

    start = made.nearest(tuple(CENTRES[number]))
    before = track_coverage(AREA, CENTRES, RADII)[2]
    rewards = {}
    for goal in observation_cells(CELLS, made.free, TRACK, RADII[number], 0.3).tolist():
        route = made.route(start, goal)
        if route is not None:
            moved = CENTRES.copy()
            moved[number] = CELLS.centroid(goal)
            detection = detection_probability(AREA, TRACK, [CELLS.centroid(goal)], RADII[number])[0]
            gain = track_coverage(AREA, moved, RADII)[2] - before
            rewards[goal] = (INVESTIGATION.detection * detection + INVESTIGATION.coverage * gain
                             - INVESTIGATION.distance * route.length_m / DIAGONAL)
    assert offer.reward == pytest.approx(max(rewards.values()), abs=1e-9)
    assert offer.reward == pytest.approx(rewards[offer.goal], abs=1e-9)
    assert offer.route.cells[-1] == offer.goal
    assert offer.reward == pytest.approx(offer.detection + offer.coverage_gain - 0.5 * offer.route.length_m / DIAGONAL)


def test_the_nearest_sensor_bids_most_for_a_pursuit():
    offers = [pursuit_offer(sensor(number), graph(number), TRACK, (1.2, 6.2), 3) for number in range(7)]

    assert max(range(7), key=lambda number: offers[number].reward) == 2         # its field of view has the target
    assert all(offer.goal == CELLS.cell_at((1.2, 6.2)) for offer in offers)


def test_a_detection_in_an_obstacle_is_pursued_to_the_nearest_cell():
    offer = pursuit_offer(sensor(0), graph(0, OBSTACLE), TRACK, (3.1, 5.1), 3)

    assert CELLS.centroid(offer.goal) == (2.75, 5.25)


def test_the_distance_weighs_more_in_a_pursuit():
    assert PURSUIT.distance / PURSUIT.detection > INVESTIGATION.distance / INVESTIGATION.detection
    assert PURSUIT.distance > INVESTIGATION.distance


def test_without_a_cell_that_would_do_there_is_no_offer():
    nowhere = ConnectivityGraph(CELLS, np.zeros(400, dtype=bool))

    assert investigation_offer(sensor(0), graph(0), TRACK, 3, 0.999999) is not None      # cells around the detection
    assert investigation_offer(sensor(0), nowhere, TRACK, 3, 0.3) is None
    assert pursuit_offer(sensor(0), nowhere, TRACK, (2.0, 1.8), 3) is None


@pytest.mark.parametrize(("weights", "why"), [((-1.0, 1.0, 1.0), "detection=-1.0"), ((1.0, 1.0, 0.0), "such as 0.01"),
                                              ((1.0, float("nan"), 1.0), "coverage")])
def test_weights_that_order_nothing_are_refused(weights, why):
    with pytest.raises(ValueError, match=why):
        RewardWeights(*weights)
