from enum import Enum


class EventType4Event(str, Enum):
    MATCHES = "matches"

    def __str__(self) -> str:
        return str(self.value)
