"""How the tests run: on the sources, unless MARCONET_COMPILED=1 asks for the compiled modules; and a busy machine makes
no property fail."""

from __future__ import annotations

import os

from hypothesis import HealthCheck, settings

os.environ.setdefault("MARCONET_COMPILED", "0")

import experiments  # reads the variable

if os.environ["MARCONET_COMPILED"] == "1":
    assert experiments.CODE == "compiled", experiments.CODE

settings.register_profile("marconet", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("marconet")
