from enum import Enum


class RoomLabel(str, Enum):
    CORRIDOR = "corridor"
    HALL = "hall"
    ROOM = "room"

    def __str__(self) -> str:
        return str(self.value)
