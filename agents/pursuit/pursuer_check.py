"""Problems of a pursuit scenario, found before a run: one sentence each, with the remedy."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TypeVar

from agents.pursuit.aerial_settings import AerialSettings
from agents.pursuit.pursuer_settings import ChaseSettings, PursuerSettings
from agents.tracking.check import wheel_problems
from firmware_sim.scenario_view import MediumView, Own, OwnAgent, ScenarioView
from netem.media.answers import Camera

Chasing = TypeVar("Chasing", bound=ChaseSettings)


def pursuer_problems(scenario: ScenarioView, own: Own[PursuerSettings]) -> Iterator[str]:
    """Yield a problem for each missing wheel parameter, then those of `chase_problems`."""
    for name in own:
        yield from wheel_problems(scenario, name)
    yield from chase_problems(scenario, own)


def chase_problems(scenario: ScenarioView, own: Mapping[str, OwnAgent[Chasing]]) -> Iterator[str]:
    """Yield a problem for each missing port, and each setting that contradicts the medium `view`."""
    for name, agent in own.items():
        named = agent.settings.ports
        if absent := [medium for medium in named.values() if medium not in agent.media]:
            yield (f"agents.{name}.media: lacks {', '.join(absent)}; it has {', '.join(agent.media) or 'none'}; name "
                   f"them in its media, or those that it has as parameters {', '.join(named)}")
        elif (view := scenario.media.get(named["view"])) is not None:
            yield from (f"agents.{name}.parameters: {line}"
                        for line in view_problems(agent.settings, name, named["view"], view))


def view_problems(settings: ChaseSettings | AerialSettings, observer: str, name: str,
                  view: MediumView) -> Iterator[str]:
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
