from enum import Enum


class ListMatchesState(str, Enum):
    CANDIDATE = "candidate"
    REJECTED = "rejected"
    VERIFIED = "verified"

    def __str__(self) -> str:
        return str(self.value)
