"""Benchmarks. They measure the compiled modules, if there are any, as importing `experiments` first selects them."""

import experiments

__all__ = ["experiments"]
