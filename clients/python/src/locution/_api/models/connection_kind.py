from enum import Enum


class ConnectionKind(str, Enum):
    DRIVEN = "driven"
    SAME_PLACE = "same_place"

    def __str__(self) -> str:
        return str(self.value)
