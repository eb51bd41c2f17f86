from enum import Enum


class CutReason(str, Enum):
    CARRIED = "carried"
    GAP = "gap"
    JUMP = "jump"
    NO_RETURNS = "no_returns"
    UNFOLLOWED = "unfollowed"

    def __str__(self) -> str:
        return str(self.value)
