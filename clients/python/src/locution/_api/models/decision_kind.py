from enum import Enum


class DecisionKind(str, Enum):
    CONFIRM = "confirm"
    VETO = "veto"

    def __str__(self) -> str:
        return str(self.value)
