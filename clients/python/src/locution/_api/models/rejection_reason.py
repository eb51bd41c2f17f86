from enum import Enum


class RejectionReason(str, Enum):
    AMBIGUOUS = "ambiguous"
    DENSITY = "density"
    INCONSISTENT = "inconsistent"
    REGISTRATION = "registration"
    SHAPE = "shape"
    VETOED = "vetoed"
    WEAK_TEXT = "weak_text"

    def __str__(self) -> str:
        return str(self.value)
