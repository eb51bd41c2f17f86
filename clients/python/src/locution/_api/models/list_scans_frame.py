from enum import Enum


class ListScansFrame(str, Enum):
    MAP = "map"
    ODOM = "odom"
    RUN = "run"

    def __str__(self) -> str:
        return str(self.value)
