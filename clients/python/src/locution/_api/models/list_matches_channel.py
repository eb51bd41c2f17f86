from enum import Enum


class ListMatchesChannel(str, Enum):
    PROFILE = "profile"
    SPATIAL = "spatial"
    WORDS = "words"

    def __str__(self) -> str:
        return str(self.value)
