"""Benchmarks measure what users run: the compiled modules, where they are. Importing `experiments` first finds them."""

import experiments

__all__ = ["experiments"]
