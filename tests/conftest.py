"""How the properties are tested: a busy machine makes no test fail."""

from __future__ import annotations

from hypothesis import HealthCheck, settings

settings.register_profile("marconet", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("marconet")
