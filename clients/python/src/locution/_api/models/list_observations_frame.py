from enum import Enum


class ListObservationsFrame(str, Enum):
    MAP = "map"
    ODOM = "odom"
    RUN = "run"

    def __str__(self) -> str:
        return str(self.value)
