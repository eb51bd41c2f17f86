from enum import Enum


class GetTrajectoryFrame(str, Enum):
    MAP = "map"
    ODOM = "odom"
    RUN = "run"

    def __str__(self) -> str:
        return str(self.value)
