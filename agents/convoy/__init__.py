"""Vehicles that drive in a row and keep their distances by what they say to each other over the radio."""
