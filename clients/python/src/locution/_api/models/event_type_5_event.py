from enum import Enum


class EventType5Event(str, Enum):
    LOCALIZATION = "localization"

    def __str__(self) -> str:
        return str(self.value)
