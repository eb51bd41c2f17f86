"""Contains all the data models used in inputs/outputs"""

from .annotation import Annotation
from .annotation_page import AnnotationPage
from .batch import Batch
from .change import Change
from .change_kind import ChangeKind
from .change_page import ChangePage
from .change_visit import ChangeVisit
from .changed_site import ChangedSite
from .channel import Channel
from .channel_move import ChannelMove
from .channel_robot import ChannelRobot
from .channel_robot_page import ChannelRobotPage
from .channel_target import ChannelTarget
from .collection_type import CollectionType
from .component import Component
from .connection import Connection
from .connection_kind import ConnectionKind
from .cut_reason import CutReason
from .decision_body import Decision
from .decision_kind import DecisionKind
from .direction import Direction
from .door import Door
from .event_type_0 import EventType0
from .event_type_0_event import EventType0Event
from .event_type_1 import EventType1
from .event_type_1_event import EventType1Event
from .event_type_2 import EventType2
from .event_type_2_event import EventType2Event
from .event_type_3 import EventType3
from .event_type_3_event import EventType3Event
from .event_type_4 import EventType4
from .event_type_4_event import EventType4Event
from .event_type_5 import EventType5
from .event_type_5_event import EventType5Event
from .event_type_6 import EventType6
from .event_type_6_event import EventType6Event
from .evidence import Evidence
from .example_answer import ExampleAnswer
from .example_evidence import ExampleEvidence
from .example_place import ExamplePlace
from .example_query import ExampleQuery
from .feature import Feature
from .feature_collection import FeatureCollection
from .feature_kind import FeatureKind
from .feature_properties import FeatureProperties
from .feature_type import FeatureType
from .geometry import Geometry
from .get_grid_yaml_response_200 import GetGridYamlResponse200
from .get_trajectory_frame import GetTrajectoryFrame
from .get_trajectory_tum_frame import GetTrajectoryTumFrame
from .grid import Grid
from .grid_header import GridHeader
from .grid_info import GridInfo
from .hypothesis import Hypothesis
from .interval import Interval
from .issued_key import IssuedKey
from .job import Job
from .job_kind import JobKind
from .job_page import JobPage
from .job_state import JobState
from .key import Key
from .keyframe_pose import KeyframePose
from .keys import Keys
from .label_answer import LabelAnswer
from .label_page import LabelPage
from .label_pattern import LabelPattern
from .label_query import LabelQuery
from .labeled_stretch import Label
from .list_labels_label import ListLabelsLabel
from .list_matches_channel import ListMatchesChannel
from .list_matches_decision import ListMatchesDecision
from .list_matches_direction import ListMatchesDirection
from .list_matches_sort import ListMatchesSort
from .list_matches_state import ListMatchesState
from .list_observations_frame import ListObservationsFrame
from .list_scans_frame import ListScansFrame
from .localization import Localization
from .localization_page import LocalizationPage
from .localization_state import LocalizationState
from .map_ import Map
from .map_channel import MapChannel
from .map_channel_page import MapChannelPage
from .map_run import MapRun
from .map_statistics import MapStatistics
from .match import Match
from .match_page import MatchPage
from .match_state import MatchState
from .missing import Missing
from .new_annotation import NewAnnotation
from .new_key import NewKey
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
from .pose_prior import PosePrior
from .problem import Problem
from .receipt import Receipt
from .region import Region
from .registration import Registration
from .rejection_reason import RejectionReason
from .retention import Retention
from .robot_report import RobotReport
from .room import Room
from .room_label import RoomLabel
from .room_page import RoomPage
from .ros_point import RosPoint
from .ros_pose import RosPose
from .ros_quaternion import RosQuaternion
from .ros_time import RosTime
from .route import Route
from .route_step import RouteStep
from .route_turn import RouteTurn
from .run import Run
from .run_change import RunChange
from .run_page import RunPage
from .run_piece import RunPiece
from .run_piece_page import RunPiecePage
from .run_state import RunState
from .scan import Scan
from .scope import Scope
from .shape_type_0 import ShapeType0
from .shape_type_0_type import ShapeType0Type
from .shape_type_1 import ShapeType1
from .shape_type_1_type import ShapeType1Type
from .shape_type_2 import ShapeType2
from .shape_type_2_type import ShapeType2Type
from .site import Site
from .site_change import SiteChange
from .site_change_config_type_0 import SiteChangeConfigType0
from .site_config import SiteConfig
from .site_state import SiteState
from .site_summary import SiteSummary
from .site_summary_page import SiteSummaryPage
from .stamped_pose import StampedPose
from .stored_scan import StoredScan
from .stored_scan_page import StoredScanPage
from .trajectory import Trajectory
from .turn import Turn
from .vda_map import VdaMap
from .word import Word
from .word_answer import WordAnswer
from .word_id import WordId
from .word_page import WordPage
from .word_pattern import WordPattern
from .word_query import WordQuery

__all__ = (
    "Annotation",
    "AnnotationPage",
    "Batch",
    "Change",
    "ChangedSite",
    "ChangeKind",
    "ChangePage",
    "ChangeVisit",
    "Channel",
    "ChannelMove",
    "ChannelRobot",
    "ChannelRobotPage",
    "ChannelTarget",
    "CollectionType",
    "Component",
    "Connection",
    "ConnectionKind",
    "CutReason",
    "Decision",
    "DecisionKind",
    "Direction",
    "Door",
    "EventType0",
    "EventType0Event",
    "EventType1",
    "EventType1Event",
    "EventType2",
    "EventType2Event",
    "EventType3",
    "EventType3Event",
    "EventType4",
    "EventType4Event",
    "EventType5",
    "EventType5Event",
    "EventType6",
    "EventType6Event",
    "Evidence",
    "ExampleAnswer",
    "ExampleEvidence",
    "ExamplePlace",
    "ExampleQuery",
    "Feature",
    "FeatureCollection",
    "FeatureKind",
    "FeatureProperties",
    "FeatureType",
    "Geometry",
    "GetGridYamlResponse200",
    "GetTrajectoryFrame",
    "GetTrajectoryTumFrame",
    "Grid",
    "GridHeader",
    "GridInfo",
    "Hypothesis",
    "Interval",
    "IssuedKey",
    "Job",
    "JobKind",
    "JobPage",
    "JobState",
    "Key",
    "KeyframePose",
    "Keys",
    "Label",
    "LabelAnswer",
    "LabelPage",
    "LabelPattern",
    "LabelQuery",
    "ListLabelsLabel",
    "ListMatchesChannel",
    "ListMatchesDecision",
    "ListMatchesDirection",
    "ListMatchesSort",
    "ListMatchesState",
    "ListObservationsFrame",
    "ListScansFrame",
    "Localization",
    "LocalizationPage",
    "LocalizationState",
    "Map",
    "MapChannel",
    "MapChannelPage",
    "MapRun",
    "MapStatistics",
    "Match",
    "MatchPage",
    "MatchState",
    "Missing",
    "NewAnnotation",
    "NewKey",
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
    "PosePrior",
    "Problem",
    "Receipt",
    "Region",
    "Registration",
    "RejectionReason",
    "Retention",
    "RobotReport",
    "Room",
    "RoomLabel",
    "RoomPage",
    "RosPoint",
    "RosPose",
    "RosQuaternion",
    "RosTime",
    "Route",
    "RouteStep",
    "RouteTurn",
    "Run",
    "RunChange",
    "RunPage",
    "RunPiece",
    "RunPiecePage",
    "RunState",
    "Scan",
    "Scope",
    "ShapeType0",
    "ShapeType0Type",
    "ShapeType1",
    "ShapeType1Type",
    "ShapeType2",
    "ShapeType2Type",
    "Site",
    "SiteChange",
    "SiteChangeConfigType0",
    "SiteConfig",
    "SiteState",
    "SiteSummary",
    "SiteSummaryPage",
    "StampedPose",
    "StoredScan",
    "StoredScanPage",
    "Trajectory",
    "Turn",
    "VdaMap",
    "Word",
    "WordAnswer",
    "WordId",
    "WordPage",
    "WordPattern",
    "WordQuery",
)
