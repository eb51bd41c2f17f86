from enum import Enum


class GetTrajectoryTumFrame(str, Enum):
    MAP = "map"
    ODOM = "odom"
    RUN = "run"

    def __str__(self) -> str:
        return str(self.value)
