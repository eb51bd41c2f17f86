//! Three kinds of messages, read from their bytes: laser scans, odometry and transforms, of ROS 1 and ROS 2.

use anyhow::{Result, bail, ensure};

use super::frames::{Rotation, StampedTransform};

/// How the bytes of messages are laid out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Layout {
    /// ROS 1: packed, little endian, a counter in every header.
    Ros1,
    /// ROS 2: CDR, aligned, of either byte order.
    Cdr,
}

/// A message of a kind that a recording is made of.
#[derive(Clone, Debug, PartialEq)]
pub enum Message {
    /// `sensor_msgs/LaserScan`.
    Laser(LaserMessage),
    /// `nav_msgs/Odometry`.
    Odometry(OdometryMessage),
    /// `tf2_msgs/TFMessage`.
    Transforms(Vec<StampedTransform>),
}

/// What counts of a `sensor_msgs/LaserScan`.
#[derive(Clone, Debug, PartialEq)]
pub struct LaserMessage {
    /// Time of the first beam.
    pub timestamp_ns: i64,
    /// Frame of the laser.
    pub frame: String,
    /// Direction of the first beam in it.
    pub angle_min_rad: f64,
    /// From one beam to the next; negative where the laser turns clockwise.
    pub angle_increment_rad: f64,
    /// Readings below it say nothing.
    pub range_min_m: f32,
    /// Readings from it on met nothing.
    pub range_max_m: f32,
    /// As they were sent.
    pub ranges_m: Vec<f32>,
}

/// What counts of a `nav_msgs/Odometry`.
#[derive(Clone, Debug, PartialEq)]
pub struct OdometryMessage {
    /// Time of the pose.
    pub timestamp_ns: i64,
    /// The frame that it moves.
    pub robot_frame: String,
    /// x and y, metres, and theta.
    pub odom_from_robot: [f64; 3],
}

impl Message {
    /// Reads a message; `None` when it is of another kind.
    ///
    /// # Errors
    /// Bytes that end too early or cannot be such a message.
    pub fn read(kind: &str, bytes: &[u8], layout: Layout) -> Result<Option<Self>> {
        let open = || Reader::new(bytes, layout);
        Ok(match kind {
            "sensor_msgs/LaserScan" => Some(Self::Laser(open()?.laser()?)),
            "nav_msgs/Odometry" => Some(Self::Odometry(open()?.odometry()?)),
            "tf2_msgs/TFMessage" | "tf/tfMessage" => Some(Self::Transforms(open()?.transforms()?)),
            _ => None,
        })
    }
}

/// A place in the bytes of a message.
struct Reader<'a> {
    bytes: &'a [u8],
    at: usize,
    layout: Layout,
    is_big_endian: bool,
}

impl<'a> Reader<'a> {
    fn new(bytes: &'a [u8], layout: Layout) -> Result<Self> {
        if layout == Layout::Ros1 {
            return Ok(Self { bytes, at: 0, layout, is_big_endian: false });
        }
        // Two bytes name the encoding, two are options; alignment counts from behind them.
        ensure!(bytes.len() >= 4, "a message of {} bytes", bytes.len());
        ensure!(bytes[0] == 0 && bytes[1] <= 1, "encoding {}.{} is not plain CDR", bytes[0], bytes[1]);
        Ok(Self { bytes: &bytes[4..], at: 0, layout, is_big_endian: bytes[1] == 0 })
    }

    fn take(&mut self, num_bytes: usize) -> Result<&'a [u8]> {
        let rest = self.bytes.get(self.at..).unwrap_or_default();
        let Some(taken) = rest.get(..num_bytes) else {
            bail!("the message ends after {} bytes", self.bytes.len())
        };
        self.at += num_bytes;
        Ok(taken)
    }

    fn number<const N: usize>(&mut self) -> Result<[u8; N]> {
        if self.layout == Layout::Cdr {
            self.at = self.at.next_multiple_of(N);
        }
        let mut number = [0; N];
        number.copy_from_slice(self.take(N)?);
        if self.is_big_endian {
            number.reverse();
        }
        Ok(number)
    }

    fn u32(&mut self) -> Result<u32> {
        Ok(u32::from_le_bytes(self.number()?))
    }

    fn f32(&mut self) -> Result<f32> {
        Ok(f32::from_le_bytes(self.number()?))
    }

    fn f64(&mut self) -> Result<f64> {
        Ok(f64::from_le_bytes(self.number()?))
    }

    fn string(&mut self) -> Result<String> {
        let length = self.u32()? as usize;
        let text = self.take(length)?;
        let text = text.strip_suffix(&[0]).unwrap_or(text);
        Ok(String::from_utf8_lossy(text).into_owned())
    }

    /// A frame without the slash of old bags.
    fn frame(&mut self) -> Result<String> {
        Ok(self.string()?.trim_start_matches('/').to_owned())
    }

    /// Time and frame.
    fn header(&mut self) -> Result<(i64, String)> {
        if self.layout == Layout::Ros1 {
            self.u32()?;
        }
        let (seconds, nanoseconds) = (i64::from(self.u32()?), i64::from(self.u32()?));
        Ok((seconds * 1_000_000_000 + nanoseconds, self.frame()?))
    }

    fn laser(&mut self) -> Result<LaserMessage> {
        let (timestamp_ns, frame) = self.header()?;
        let angle_min_rad = f64::from(self.f32()?);
        self.f32()?;
        let angle_increment_rad = f64::from(self.f32()?);
        // Time between beams and between scans.
        self.f32()?;
        self.f32()?;
        let (range_min_m, range_max_m) = (self.f32()?, self.f32()?);
        let num_ranges = self.u32()? as usize;
        // The count is a claim until the bytes are there.
        ensure!(num_ranges <= self.bytes.len() / 4, "{num_ranges} readings in {} bytes", self.bytes.len());
        let ranges_m = (0..num_ranges).map(|_| self.f32()).collect::<Result<_>>()?;
        Ok(LaserMessage {
            timestamp_ns,
            frame,
            angle_min_rad,
            angle_increment_rad,
            range_min_m,
            range_max_m,
            ranges_m,
        })
    }

    fn odometry(&mut self) -> Result<OdometryMessage> {
        let (timestamp_ns, _) = self.header()?;
        let robot_frame = self.frame()?;
        let (x, y, _) = (self.f64()?, self.f64()?, self.f64()?);
        let theta = self.rotation()?.yaw();
        Ok(OdometryMessage { timestamp_ns, robot_frame, odom_from_robot: [x, y, theta] })
    }

    fn rotation(&mut self) -> Result<Rotation> {
        Rotation::of_quaternion([self.f64()?, self.f64()?, self.f64()?, self.f64()?])
    }

    fn transforms(&mut self) -> Result<Vec<StampedTransform>> {
        let num_transforms = self.u32()?;
        let mut transforms = Vec::new();
        for _ in 0..num_transforms {
            let (timestamp_ns, parent) = self.header()?;
            let child = self.frame()?;
            let translation_m = [self.f64()?, self.f64()?, self.f64()?];
            let rotation = self.rotation()?;
            transforms.push(StampedTransform { timestamp_ns, parent, child, translation_m, rotation });
        }
        Ok(transforms)
    }
}
