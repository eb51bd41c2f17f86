from enum import Enum


class RunChange(str, Enum):
    DELETED = "deleted"
    FINISHED = "finished"
    MADE = "made"

    def __str__(self) -> str:
        return str(self.value)
