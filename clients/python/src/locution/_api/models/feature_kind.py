from enum import Enum


class FeatureKind(str, Enum):
    ANNOTATION = "annotation"
    DOOR = "door"
    ROOM = "room"

    def __str__(self) -> str:
        return str(self.value)
