"""Contains all the data models used in inputs/outputs"""

from .batch import Batch
from .change import Change
from .change_kind import ChangeKind
from .change_page import ChangePage
from .channel import Channel
from .component import Component
from .connection import Connection
from .connection_kind import ConnectionKind
from .decision_body import Decision
from .decision_kind import DecisionKind
from .direction import Direction
from .evidence import Evidence
from .example_answer import ExampleAnswer
from .example_evidence import ExampleEvidence
from .example_place import ExamplePlace
from .example_query import ExampleQuery
from .geometry import Geometry
from .get_trajectory_frame import GetTrajectoryFrame
from .get_trajectory_tum_frame import GetTrajectoryTumFrame
from .grid import Grid
from .grid_info import GridInfo
from .hypothesis import Hypothesis
from .interval import Interval
from .job import Job
from .job_kind import JobKind
from .job_page import JobPage
from .job_state import JobState
from .keyframe_pose import KeyframePose
from .label_answer import LabelAnswer
from .label_page import LabelPage
from .label_pattern import LabelPattern
from .label_query import LabelQuery
from .labeled_stretch import Label
from .list_matches_channel import ListMatchesChannel
from .list_matches_direction import ListMatchesDirection
from .list_matches_state import ListMatchesState
from .localization import Localization
from .localization_state import LocalizationState
from .map_ import Map
from .map_run import MapRun
from .map_statistics import MapStatistics
from .match import Match
from .match_page import MatchPage
from .match_state import MatchState
from .new_localization import NewLocalization
from .new_run import NewRun
from .new_site import NewSite
from .new_site_config_type_0 import NewSiteConfigType0
from .observation import Observation
from .observation_page import ObservationPage
from .place import Place
from .place_label import PlaceLabel
from .place_page import PlacePage
from .point import Point
from .pose import Pose
from .problem import Problem
from .receipt import Receipt
from .region import Region
from .registration import Registration
from .rejection_reason import RejectionReason
from .route import Route
from .route_step import RouteStep
from .route_turn import RouteTurn
from .run import Run
from .run_page import RunPage
from .run_state import RunState
from .scan import Scan
from .site import Site
from .site_config import SiteConfig
from .site_state import SiteState
from .site_summary import SiteSummary
from .site_summary_page import SiteSummaryPage
from .stamped_pose import StampedPose
from .stored_scan import StoredScan
from .stored_scan_page import StoredScanPage
from .trajectory import Trajectory
from .turn import Turn
from .word import Word
from .word_answer import WordAnswer
from .word_id import WordId
from .word_page import WordPage
from .word_pattern import WordPattern
from .word_query import WordQuery

__all__ = (
    "Batch",
    "Change",
    "ChangeKind",
    "ChangePage",
    "Channel",
    "Component",
    "Connection",
    "ConnectionKind",
    "Decision",
    "DecisionKind",
    "Direction",
    "Evidence",
    "ExampleAnswer",
    "ExampleEvidence",
    "ExamplePlace",
    "ExampleQuery",
    "Geometry",
    "GetTrajectoryFrame",
    "GetTrajectoryTumFrame",
    "Grid",
    "GridInfo",
    "Hypothesis",
    "Interval",
    "Job",
    "JobKind",
    "JobPage",
    "JobState",
    "KeyframePose",
    "Label",
    "LabelAnswer",
    "LabelPage",
    "LabelPattern",
    "LabelQuery",
    "ListMatchesChannel",
    "ListMatchesDirection",
    "ListMatchesState",
    "Localization",
    "LocalizationState",
    "Map",
    "MapRun",
    "MapStatistics",
    "Match",
    "MatchPage",
    "MatchState",
    "NewLocalization",
    "NewRun",
    "NewSite",
    "NewSiteConfigType0",
    "Observation",
    "ObservationPage",
    "Place",
    "PlaceLabel",
    "PlacePage",
    "Point",
    "Pose",
    "Problem",
    "Receipt",
    "Region",
    "Registration",
    "RejectionReason",
    "Route",
    "RouteStep",
    "RouteTurn",
    "Run",
    "RunPage",
    "RunState",
    "Scan",
    "Site",
    "SiteConfig",
    "SiteState",
    "SiteSummary",
    "SiteSummaryPage",
    "StampedPose",
    "StoredScan",
    "StoredScanPage",
    "Trajectory",
    "Turn",
    "Word",
    "WordAnswer",
    "WordId",
    "WordPage",
    "WordPattern",
    "WordQuery",
)
