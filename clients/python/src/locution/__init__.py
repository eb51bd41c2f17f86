"""Python client of Locution: where is this robot, and what is the map of all of them?

>>> from locution import Client
>>> site = Client("http://127.0.0.1:7070").site("office")
>>> site.replay("monday.mcap")                                  # doctest: +SKIP
>>> site.build().to_nav2("maps/office")                         # doctest: +SKIP
>>> site.localize("this-morning.mcap").state                    # doctest: +SKIP
"""

from .client import Client
from .errors import JobFailed, LocutionError, RecordingError, Refused, Unreachable
from .localization import LocalizationSession
from .maps import OccupancyGrid, SiteMap, Trajectory
from .readers import RosOptions, open_recording
from .recording import Recording, Scan
from .site import Site
from .tables import to_frame
from .transport import RetryPolicy

__all__ = [
    "Client",
    "JobFailed",
    "LocalizationSession",
    "LocutionError",
    "OccupancyGrid",
    "Recording",
    "RecordingError",
    "Refused",
    "RetryPolicy",
    "RosOptions",
    "Scan",
    "Site",
    "SiteMap",
    "Trajectory",
    "Unreachable",
    "open_recording",
    "to_frame",
]
