from enum import Enum


class EventType1Event(str, Enum):
    WORDS = "words"

    def __str__(self) -> str:
        return str(self.value)
