from enum import Enum


class EventType6Event(str, Enum):
    MISSED = "missed"

    def __str__(self) -> str:
        return str(self.value)
