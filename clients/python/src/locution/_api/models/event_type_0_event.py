from enum import Enum


class EventType0Event(str, Enum):
    RUN = "run"

    def __str__(self) -> str:
        return str(self.value)
