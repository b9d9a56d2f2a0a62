//! From the messages of `run.mcap` to those of ROS: the same values, times and frames.

use super::messages::{
    CameraInfo, Colour, CompressedImage, Header, ImageMarker, JointState, Log, Quaternion, Time,
    Transform, TransformStamped, Vector3,
};
use anyhow::{Context, Result, anyhow, ensure};
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use serde::{Deserialize, Deserializer};
use serde_json::Error;

/// `ImageMarker.POINTS`.
const POINTS: i32 = 4;
/// A pixel's centre is half a pixel there and a whole number here, as for `CameraInfo`.
const HALF_PIXEL: f64 = 0.5;
/// Levels of `rcl_interfaces/Log` are so much larger than Foxglove's.
const LEVEL: u8 = 10;

#[derive(Deserialize)]
struct Joint {
    name: String,
    position: Option<f64>,
    velocity: Option<f64>,
}

#[derive(Deserialize)]
struct Joints {
    joints: Vec<Joint>,
}

#[derive(Deserialize)]
struct Frames {
    transforms: Vec<Frame>,
}

#[derive(Deserialize)]
struct Frame {
    parent_frame_id: String,
    child_frame_id: String,
    translation: Vector3,
    rotation: Quaternion,
}

#[derive(Deserialize)]
struct Picture {
    frame_id: String,
    data: String,
    format: String,
}

/// Intrinsics and distortion of the left eye.
#[derive(Debug, Clone, Deserialize)]
pub(super) struct Calibration {
    width: u32,
    height: u32,
    distortion_model: String,
    #[serde(rename = "D")]
    d: Vec<f64>,
    #[serde(rename = "K")]
    k: [f64; 9],
    #[serde(rename = "R")]
    r: [f64; 9],
    #[serde(rename = "P")]
    p: [f64; 12],
}

#[derive(Deserialize)]
struct Drawn {
    points: Vec<Points>,
}

#[derive(Deserialize)]
struct Points {
    points: Vec<Vector3>,
    outline_color: Colour,
    thickness: f32,
}

#[derive(Deserialize)]
struct Line {
    level: u8,
    message: String,
    name: String,
}

/// A message: the text of a file, or a value.
pub(super) trait Json<'de>: Deserializer<'de, Error = Error> {}

impl<'de, D: Deserializer<'de, Error = Error>> Json<'de> for D {}

/// Joints; an angle or a speed that the arm did not tell is no number, and where it told no
/// speed at all there are none.
pub(super) fn joints<'de>(at_ns: u64, data: impl Json<'de>) -> Result<JointState> {
    let Joints { joints } = Joints::deserialize(data)?;
    let number = |value: Option<f64>| value.unwrap_or(f64::NAN);
    let has_speed = joints.iter().any(|joint| joint.velocity.is_some());
    let speeds = joints.iter().filter(|_| has_speed);
    Ok(JointState {
        header: header(at_ns, "")?,
        velocity: speeds.map(|joint| number(joint.velocity)).collect(),
        position: joints.iter().map(|joint| number(joint.position)).collect(),
        name: joints.into_iter().map(|joint| joint.name).collect(),
        effort: Vec::new(),
    })
}

/// Transforms between frames.
pub(super) fn transforms<'de>(at_ns: u64, data: impl Json<'de>) -> Result<Vec<TransformStamped>> {
    let Frames { transforms } = Frames::deserialize(data)?;
    let stamped = |frame: Frame| {
        Ok(TransformStamped {
            header: header(at_ns, &frame.parent_frame_id)?,
            child_frame_id: frame.child_frame_id,
            transform: Transform {
                translation: frame.translation,
                rotation: frame.rotation,
            },
        })
    };
    transforms.into_iter().map(stamped).collect()
}

/// A picture.
pub(super) fn picture<'de>(at_ns: u64, data: impl Json<'de>) -> Result<CompressedImage> {
    let picture = Picture::deserialize(data)?;
    let format = picture.format;
    ensure!(format == "jpeg", "a picture is `{format}`, not jpeg");
    Ok(CompressedImage {
        header: header(at_ns, &picture.frame_id)?,
        data: STANDARD
            .decode(picture.data)
            .map_err(|error| anyhow!("a picture is not base64: {error}"))?,
        format,
    })
}

/// How the camera sees.
pub(super) fn calibration<'de>(data: impl Json<'de>) -> Result<Calibration> {
    Ok(Calibration::deserialize(data)?)
}

impl Calibration {
    /// For the picture of this header.
    pub(super) fn of_picture(&self, header: Header) -> CameraInfo {
        let seen = self.clone();
        CameraInfo {
            header,
            height: seen.height,
            width: seen.width,
            distortion_model: seen.distortion_model,
            d: seen.d,
            k: seen.k,
            r: seen.r,
            p: seen.p,
            binning: [0; 2],
            roi: ([0; 4], false),
        }
    }
}

/// The rope's keypoints in the picture of this time, clamp first, lead last; none where it was
/// lost.
pub(super) fn keypoints<'de>(
    at_ns: u64,
    frame_id: &str,
    data: impl Json<'de>,
) -> Result<ImageMarker> {
    let Drawn { points } = Drawn::deserialize(data)?;
    // The same points are drawn a second time, as a line.
    let drawn = points.into_iter().next();
    let drawn = drawn.context("nothing is drawn in it")?;
    let pixel = |p: &Vector3| Vector3 {
        x: p.x - HALF_PIXEL,
        y: p.y - HALF_PIXEL,
        z: 0.0,
    };
    Ok(ImageMarker {
        header: header(at_ns, frame_id)?,
        ns: "rope".to_owned(),
        id: 0,
        kind: POINTS,
        action: 0,
        position: Vector3::default(),
        scale: drawn.thickness,
        outline_color: drawn.outline_color,
        filled: 1,
        fill_color: drawn.outline_color,
        lifetime: Time::default(),
        points: drawn.points.iter().map(pixel).collect(),
        outline_colors: Vec::new(),
    })
}

/// A line of the log.
pub(super) fn log<'de>(at_ns: u64, data: impl Json<'de>) -> Result<Log> {
    let line = Line::deserialize(data)?;
    Ok(Log {
        stamp: Time::of(at_ns)?,
        level: line.level.saturating_mul(LEVEL),
        name: line.name,
        msg: line.message,
        file: String::new(),
        function: String::new(),
        line: 0,
    })
}

fn header(at_ns: u64, frame_id: &str) -> Result<Header> {
    Ok(Header {
        stamp: Time::of(at_ns)?,
        frame_id: frame_id.to_owned(),
    })
}
