from enum import Enum


class Missing(str, Enum):
    ALTERNATIVES = "alternatives"
    ELSEWHERE = "elsewhere"
    PERSISTENCE = "persistence"
    POSITION = "position"
    RECENT_SCANS = "recent_scans"
    TRAVEL = "travel"

    def __str__(self) -> str:
        return str(self.value)
