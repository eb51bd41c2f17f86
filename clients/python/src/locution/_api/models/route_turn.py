from enum import Enum


class RouteTurn(str, Enum):
    BACK = "back"
    LEFT = "left"
    RIGHT = "right"
    STRAIGHT = "straight"

    def __str__(self) -> str:
        return str(self.value)
