from enum import Enum


class ListMatchesDirection(str, Enum):
    OPPOSITE = "opposite"
    SAME = "same"

    def __str__(self) -> str:
        return str(self.value)
