from enum import Enum


class MatchState(str, Enum):
    CANDIDATE = "candidate"
    REJECTED = "rejected"
    VERIFIED = "verified"

    def __str__(self) -> str:
        return str(self.value)
