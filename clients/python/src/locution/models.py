"""Bodies of the HTTP API as typed values: matches, places, hypotheses, jobs.

Generated from the API's document; metres, radians, integer nanoseconds.
"""

from ._api.models import *  # noqa: F403
from ._api.models import __all__ as __all__
