from enum import Enum


class EventType2Event(str, Enum):
    JOB = "job"

    def __str__(self) -> str:
        return str(self.value)
