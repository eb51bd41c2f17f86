from enum import Enum


class PlaceLabel(str, Enum):
    BIFURCATION = "bifurcation"
    CORNER = "corner"
    CORRIDOR = "corridor"
    DEAD_END = "dead-end"
    HALL = "hall"

    def __str__(self) -> str:
        return str(self.value)
