"""What can go wrong between a robot and its server."""

from __future__ import annotations

import contextlib
from typing import Any

import httpx

from .models import Job, Problem


class LocutionError(Exception):
    """Base of every error of this package."""


class Refused(LocutionError):
    """The server said no; `problem` says why (RFC 9457)."""

    def __init__(self, problem: Problem) -> None:
        self.problem = problem
        where = f"{problem.field}: " if problem.field else ""
        super().__init__(f"{problem.status}: {where}{problem.detail or problem.title}")

    @property
    def status(self) -> int:
        """HTTP status."""
        return self.problem.status

    @property
    def expected_sequence(self) -> int | None:
        """On a sequence conflict: the number that the next scan must have."""
        return self.problem.expected_sequence or None

    @classmethod
    def of(cls, response: httpx.Response) -> Refused:
        """The refusal in an answer, also one that came from something between client and server."""
        members: dict[str, Any] = {}
        with contextlib.suppress(ValueError):
            body = response.json()
            members = body if isinstance(body, dict) else {}
        about = {
            "type": "about:blank",
            "title": f"HTTP {response.status_code}",
            "detail": response.text[:300],
        }
        return cls(Problem.from_dict({**about, **members, "status": response.status_code}))


class Unreachable(LocutionError):
    """No answer came within the retries allowed."""


class JobFailed(LocutionError):
    """A build or other long work ended in failure."""

    def __init__(self, job: Job) -> None:
        self.job = job
        super().__init__(f"job {job.id} failed: {job.error or job.detail}")


class RecordingError(LocutionError):
    """A recording that cannot be read; says what was found and what to state."""
