"""Firmware as a shared library in the process of its node."""
