from enum import Enum


class ShapeType2Type(str, Enum):
    POLYGON = "Polygon"

    def __str__(self) -> str:
        return str(self.value)
