from enum import Enum


class SiteState(str, Enum):
    SERVING = "serving"
    UNREADABLE = "unreadable"

    def __str__(self) -> str:
        return str(self.value)
