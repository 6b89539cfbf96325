"""The one error of this package: place, value, rule, remedy."""


class PlantError(Exception):
    """Something is wrong with a model, an FMU, a variable or a step; the text names file, variable and time."""
