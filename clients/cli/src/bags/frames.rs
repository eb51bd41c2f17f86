//! Frames that do not move against each other: where the laser sits on the robot.

use std::collections::BTreeMap;

use anyhow::{Result, ensure};
use locution_engine::geometry::Pose2;

use super::messages::OdometryMessage;

/// A laser that is tilted by more than this does not scan level, radians.
const TILT_MAX_RAD: f64 = 15.0 * std::f64::consts::PI / 180.0;

/// A rotation in space, by its matrix.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rotation([[f64; 3]; 3]);

impl Rotation {
    const IDENTITY: Self = Self([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]);

    /// The rotation of a quaternion x, y, z, w.
    ///
    /// # Errors
    /// A quaternion of no length.
    pub fn of_quaternion(quaternion: [f64; 4]) -> Result<Self> {
        let length = quaternion.iter().map(|part| part * part).sum::<f64>().sqrt();
        ensure!(length > 1e-6 && length.is_finite(), "a rotation whose quaternion has no length");
        let [x, y, z, w] = quaternion.map(|part| part / length);
        Ok(Self([
            [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - z * w), 2.0 * (x * z + y * w)],
            [2.0 * (x * y + z * w), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - x * w)],
            [2.0 * (x * z - y * w), 2.0 * (y * z + x * w), 1.0 - 2.0 * (x * x + y * y)],
        ]))
    }

    /// The direction on the floor into which the x axis is turned.
    pub fn yaw(&self) -> f64 {
        self.0[1][0].atan2(self.0[0][0])
    }

    fn apply(&self, vector: [f64; 3]) -> [f64; 3] {
        self.0.map(|row| row[0] * vector[0] + row[1] * vector[1] + row[2] * vector[2])
    }

    fn times(&self, other: &Self) -> Self {
        let columns = other.transposed().0.map(|column| self.apply(column));
        Self(columns).transposed()
    }

    fn transposed(&self) -> Self {
        let m = &self.0;
        Self([0, 1, 2].map(|column| [m[0][column], m[1][column], m[2][column]]))
    }
}

/// What a `geometry_msgs/TransformStamped` says: parent from child.
#[derive(Clone, Debug, PartialEq)]
pub struct StampedTransform {
    /// When it held.
    pub timestamp_ns: i64,
    /// Target frame.
    pub parent: String,
    /// Source frame.
    pub child: String,
    /// Metres.
    pub translation_m: [f64; 3],
    /// Turn.
    pub rotation: Rotation,
}

impl StampedTransform {
    /// The transform as odometry that moves its child.
    pub fn as_odometry(&self) -> OdometryMessage {
        let [x, y, _] = self.translation_m;
        OdometryMessage {
            timestamp_ns: self.timestamp_ns,
            robot_frame: self.child.clone(),
            odom_from_robot: [x, y, self.rotation.yaw()],
        }
    }
}

/// Target from source.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Transform {
    rotation: Rotation,
    translation_m: [f64; 3],
}

impl Transform {
    const IDENTITY: Self = Self { rotation: Rotation::IDENTITY, translation_m: [0.0; 3] };

    fn compose(&self, other: &Self) -> Self {
        let moved = self.rotation.apply(other.translation_m);
        let translation_m = [0, 1, 2].map(|axis| self.translation_m[axis] + moved[axis]);
        Self { rotation: self.rotation.times(&other.rotation), translation_m }
    }

    fn inverse(&self) -> Self {
        let rotation = self.rotation.transposed();
        Self { rotation, translation_m: rotation.apply(self.translation_m).map(|part| -part) }
    }
}

/// The tree of frames; the first that is said of a frame stays.
#[derive(Default)]
pub struct Frames {
    parents: BTreeMap<String, (String, Transform)>,
}

impl Frames {
    /// Takes what a message says.
    pub fn add(&mut self, said: StampedTransform) {
        let StampedTransform { parent, child, translation_m, rotation, .. } = said;
        self.parents.entry(child).or_insert((parent, Transform { rotation, translation_m }));
    }

    /// Every frame above, with ancestor from frame, the nearest first.
    fn ancestors(&self, frame: &str) -> Vec<(String, Transform)> {
        let mut found = vec![(frame.to_owned(), Transform::IDENTITY)];
        let (mut frame, mut from_frame) = (frame, Transform::IDENTITY);
        while let Some((parent, transform)) = self.parents.get(frame) {
            if found.iter().any(|(known, _)| known == parent) {
                break;
            }
            from_frame = transform.compose(&from_frame);
            found.push((parent.clone(), from_frame));
            frame = parent;
        }
        found
    }

    /// Target from source, when both hang on one tree.
    pub fn between(&self, target: &str, source: &str) -> Option<Transform> {
        let above_target = self.ancestors(target);
        self.ancestors(source).iter().find_map(|(frame, from_source)| {
            let (_, from_target) = above_target.iter().find(|(known, _)| known == frame)?;
            Some(from_target.inverse().compose(from_source))
        })
    }
}

/// How a laser sits on its robot.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Mounting {
    /// On the floor.
    pub robot_from_laser: Pose2,
    /// Whether its beams turn the other way round, seen from above.
    pub is_upside_down: bool,
}

impl Mounting {
    /// The mounting that a transform says.
    ///
    /// # Errors
    /// A laser that does not scan level.
    pub fn new(robot_from_laser: &Transform) -> Result<Self> {
        let up = robot_from_laser.rotation.0[2][2];
        let tilt_rad = up.abs().min(1.0).acos();
        ensure!(
            tilt_rad <= TILT_MAX_RAD,
            "the laser is tilted by {:.0} degrees; only level lasers can be mapped",
            tilt_rad.to_degrees()
        );
        let [x, y, _] = robot_from_laser.translation_m;
        // The x axis keeps its direction on the floor when the laser is turned over about it.
        let pose = Pose2::new(x, y, robot_from_laser.rotation.yaw());
        Ok(Self { robot_from_laser: pose, is_upside_down: up < 0.0 })
    }
}
