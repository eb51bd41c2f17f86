from enum import Enum


class ListMatchesSort(str, Enum):
    ID = "id"
    PROBABILITY = "probability"
    TIME = "time"

    def __str__(self) -> str:
        return str(self.value)
