from enum import Enum


class LocalizationState(str, Enum):
    AMBIGUOUS = "ambiguous"
    CONVERGED = "converged"
    LOST = "lost"

    def __str__(self) -> str:
        return str(self.value)
