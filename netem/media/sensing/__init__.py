"""Sensing: bodies show where they are, observers look, and learn what their cameras see."""
