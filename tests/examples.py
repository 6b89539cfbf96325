"""How many examples a property test tries: in `make test` fewer than in `make test-all`."""

from __future__ import annotations

from typing import Final

from hypothesis import HealthCheck, settings

PROFILE: Final = "marconet"
SHARE: Final = 0.4                  # of the examples, in `make test`
FEWEST: Final = 10                  # unless the test itself asks for fewer

settings.register_profile(PROFILE, deadline=None, suppress_health_check=[HealthCheck.too_slow],
                          max_examples=int(100 * SHARE))
settings.register_profile("whole", parent=settings.get_profile(PROFILE), max_examples=100)


def examples(number: int) -> int:
    """Return how many of `number` examples the loaded profile tries; --hypothesis-profile loads another one."""
    loaded = settings.get_profile(settings.get_current_profile_name())
    return min(number, max(FEWEST, number * loaded.max_examples // 100))
