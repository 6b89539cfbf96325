"""The errors of this package; their texts give place, value, rule and remedy."""


class PlantError(Exception):
    """A model, an FMU, a variable or a step is wrong or failed; the text names file, variable and time."""


class PlantEnded(PlantError):
    """The model asked to end the simulation, which is no failure: `ended_ns` is the last instant that it reached."""

    def __init__(self, text: str, ended_ns: int) -> None:
        super().__init__(text)
        self.ended_ns = ended_ns
