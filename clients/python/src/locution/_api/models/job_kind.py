from enum import Enum


class JobKind(str, Enum):
    BUILD = "build"

    def __str__(self) -> str:
        return str(self.value)
