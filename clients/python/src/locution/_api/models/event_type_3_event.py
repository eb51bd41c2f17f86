from enum import Enum


class EventType3Event(str, Enum):
    VERSION = "version"

    def __str__(self) -> str:
        return str(self.value)
