"""Problems of a pursuit scenario, found before a run: one sentence each, with the remedy."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Protocol

from agents.pursuit.pursuer_settings import PursuerSettings
from firmware_sim.scenario_view import MediumView, Own, ScenarioView
from netem.media.answers import Camera

ROBOT = ("wheel_radius_m", "track_m", "counts_per_turn")


class LooksLike(Protocol):
    """The assumptions of a pursuer about its sensor, which `view_problems` compares with the sensing medium."""

    @property
    def step_ns(self) -> int: ...
    @property
    def radius_m(self) -> float: ...
    @property
    def sigma_m(self) -> float: ...
    @property
    def latency_ns(self) -> int: ...


def pursuer_problems(scenario: ScenarioView, own: Own[PursuerSettings]) -> Iterator[str]:
    """Yield a problem for each missing wheel parameter or port, and each setting that contradicts the medium."""
    for name, agent in own.items():
        if lacking := [key for key in ROBOT if key not in scenario.team.get("robot", {})]:
            yield f"team.robot: is missing {', '.join(lacking)}, which {name} needs to know of its wheels"
        named = agent.settings.ports
        if absent := [medium for medium in named.values() if medium not in agent.media]:
            yield (f"agents.{name}.media: lacks {', '.join(absent)}; it has {', '.join(agent.media) or 'none'}; name "
                   f"them in its media, or those that it has as parameters {', '.join(named)}")
        elif (view := scenario.media.get(named["view"])) is not None:
            yield from (f"agents.{name}.parameters: {line}"
                        for line in view_problems(agent.settings, name, named["view"], view))


def view_problems(settings: LooksLike, observer: str, name: str, view: MediumView) -> Iterator[str]:
    """Yield a problem for each of `settings` that contradicts the camera of `observer` on the medium `name`."""
    known: Camera | None = view.settings and view.settings.camera(observer)
    if known is None:
        yield f"view={name!r}: expected a medium of kind sensing"
        return
    if known.period_ns != settings.step_ns:
        yield f"step_ns={settings.step_ns}: media.{name} has exposures every {known.period_ns} ns; take the same"
    if known.view.range_m != settings.radius_m:
        yield f"radius_m={settings.radius_m}: media.{name} has range_m={known.view.range_m}; take the same"
    if known.noise_m > settings.sigma_m:
        yield f"sigma_m={settings.sigma_m}: media.{name} has noise_m={known.noise_m}; take that much or more"
    if known.latency_ns > settings.latency_ns:
        yield (f"latency_ns={settings.latency_ns}: the news of media.{name} take {known.latency_ns} ns from an "
               "exposure; take that plus the program's computing time")
