//! The messages of the topics: fields in the order of their definitions, which is all that CDR
//! knows of them.

use anyhow::{Context, Result};
use serde::{Deserialize, Serialize, Serializer};

/// Encapsulation header: plain CDR, little-endian, no options.
const ENCAPSULATION: [u8; 4] = [0, 1, 0, 0];

/// A message in CDR. Alignment counts from behind the four bytes at its begin.
pub(super) fn cdr(message: &impl Serialize) -> Result<Vec<u8>> {
    let mut bytes = ENCAPSULATION.to_vec();
    cdr_encoding::to_writer::<_, byteorder::LittleEndian, _>(&mut bytes, message)?;
    Ok(bytes)
}

/// `builtin_interfaces/Time`, and `Duration`.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub(super) struct Time {
    sec: i32,
    nanosec: u32,
}

impl Time {
    /// The wall clock's (ns since 1970).
    pub(super) fn of(at_ns: u64) -> Result<Self> {
        let sec = i32::try_from(at_ns / 1_000_000_000);
        Ok(Self {
            sec: sec.with_context(|| format!("ROS has no time {at_ns} ns after 1970"))?,
            nanosec: u32::try_from(at_ns % 1_000_000_000)?,
        })
    }
}

/// `std_msgs/Header`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct Header {
    pub(super) stamp: Time,
    pub(super) frame_id: String,
}

/// `geometry_msgs/Vector3` (m) or `Point`.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub(super) struct Vector3 {
    pub(super) x: f64,
    pub(super) y: f64,
    #[serde(default)]
    pub(super) z: f64,
}

/// `geometry_msgs/Quaternion`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(super) struct Quaternion {
    x: f64,
    y: f64,
    z: f64,
    w: f64,
}

/// `std_msgs/ColorRGBA`, 0 to 1.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(super) struct Colour {
    r: f32,
    g: f32,
    b: f32,
    a: f32,
}

/// `sensor_msgs/JointState` (rad, rad/s).
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct JointState {
    pub(super) header: Header,
    pub(super) name: Vec<String>,
    pub(super) position: Vec<f64>,
    pub(super) velocity: Vec<f64>,
    pub(super) effort: Vec<f64>,
}

/// `geometry_msgs/Transform`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub(super) struct Transform {
    pub(super) translation: Vector3,
    pub(super) rotation: Quaternion,
}

/// `geometry_msgs/TransformStamped`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct TransformStamped {
    pub(super) header: Header,
    pub(super) child_frame_id: String,
    pub(super) transform: Transform,
}

/// `tf2_msgs/TFMessage`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct TfMessage {
    pub(super) transforms: Vec<TransformStamped>,
}

/// `sensor_msgs/CompressedImage`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct CompressedImage {
    pub(super) header: Header,
    pub(super) format: String,
    #[serde(serialize_with = "bytes")]
    pub(super) data: Vec<u8>,
}

/// All at once: a sequence would be written byte by byte.
fn bytes<S: Serializer>(data: &[u8], serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_bytes(data)
}

/// `sensor_msgs/CameraInfo`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct CameraInfo {
    pub(super) header: Header,
    pub(super) height: u32,
    pub(super) width: u32,
    pub(super) distortion_model: String,
    pub(super) d: Vec<f64>,
    pub(super) k: [f64; 9],
    pub(super) r: [f64; 9],
    pub(super) p: [f64; 12],
    /// 0: every pixel.
    pub(super) binning: [u32; 2],
    /// `sensor_msgs/RegionOfInterest`: the whole picture, not to be rectified.
    pub(super) roi: ([u32; 4], bool),
}

/// `visualization_msgs/ImageMarker` (px).
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct ImageMarker {
    pub(super) header: Header,
    pub(super) ns: String,
    pub(super) id: i32,
    pub(super) kind: i32,
    pub(super) action: i32,
    pub(super) position: Vector3,
    pub(super) scale: f32,
    pub(super) outline_color: Colour,
    pub(super) filled: u8,
    pub(super) fill_color: Colour,
    pub(super) lifetime: Time,
    pub(super) points: Vec<Vector3>,
    pub(super) outline_colors: Vec<Colour>,
}

/// `rcl_interfaces/Log`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct Log {
    pub(super) stamp: Time,
    pub(super) level: u8,
    pub(super) name: String,
    pub(super) msg: String,
    pub(super) file: String,
    pub(super) function: String,
    pub(super) line: u32,
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Numbers lie at multiples of their length, counted from behind the first four bytes; texts
    /// end with a zero, which counts.
    #[test]
    fn a_message_has_the_bytes_of_the_specification() {
        let message = JointState {
            header: Header {
                stamp: Time::of(1_000_000_002).unwrap(),
                frame_id: String::new(),
            },
            name: vec!["j".to_owned()],
            position: vec![1.0],
            velocity: Vec::new(),
            effort: Vec::new(),
        };
        let parts: [&[u8]; 9] = [
            &[0, 1, 0, 0],
            &[1, 0, 0, 0, 2, 0, 0, 0],
            &[1, 0, 0, 0, 0, 0, 0, 0],
            &[1, 0, 0, 0],
            &[2, 0, 0, 0, b'j', 0, 0, 0],
            &[1, 0, 0, 0],
            &1.0_f64.to_le_bytes(),
            &[0, 0, 0, 0],
            &[0, 0, 0, 0],
        ];
        assert_eq!(cdr(&message).unwrap(), parts.concat());
        let late = Time::of(1 << 62).unwrap_err().to_string();
        assert!(late.contains("ROS has no time"), "{late}");
    }
}
