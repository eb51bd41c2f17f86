from enum import Enum


class ShapeType0Type(str, Enum):
    POINT = "Point"

    def __str__(self) -> str:
        return str(self.value)
