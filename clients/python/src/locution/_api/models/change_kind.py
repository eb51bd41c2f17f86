from enum import Enum


class ChangeKind(str, Enum):
    APPEARED = "appeared"
    DISAPPEARED = "disappeared"

    def __str__(self) -> str:
        return str(self.value)
