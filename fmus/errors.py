"""The errors of this package: place, value, rule, remedy."""


class PlantError(Exception):
    """Something is wrong with a model, an FMU, a variable or a step; the text names file, variable and time."""


class PlantEnded(PlantError):
    """The model ended the simulation by itself, which is no fault: `ended_ns` is the last instant that it reached."""

    def __init__(self, text: str, ended_ns: int) -> None:
        super().__init__(text)
        self.ended_ns = ended_ns
