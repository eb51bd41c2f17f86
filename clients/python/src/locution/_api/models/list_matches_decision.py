from enum import Enum


class ListMatchesDecision(str, Enum):
    CONFIRM = "confirm"
    NONE = "none"
    VETO = "veto"

    def __str__(self) -> str:
        return str(self.value)
