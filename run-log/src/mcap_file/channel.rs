//! The channels of a file: topic, encoding, schema.

/// One channel.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Channel {
    /// Chunks of the exact recording.
    Replay,
    /// Measured joints.
    Measured,
    /// Commanded joints.
    Commanded,
    /// Figures of every control cycle.
    Cycles,
    /// Places of the arm's links, the pole's end and the camera.
    Frames,
    /// What stands in the room: arm, pole, target.
    Scene,
    /// The identified rope, simulated on the measured joints.
    Rope,
    /// The camera's left eye.
    Image,
    /// Its calibration.
    Calibration,
    /// The rope's keypoints in it.
    Keypoints,
    /// Changes of mode, faults, causes of stops.
    Log,
    /// The plan of the throw.
    Plan,
    /// The identified rope.
    Parameters,
    /// Every figure of the run.
    Summary,
}

impl Channel {
    /// All of them, in the order of their numbers.
    pub const ALL: [Self; 14] = [
        Self::Replay,
        Self::Measured,
        Self::Commanded,
        Self::Cycles,
        Self::Frames,
        Self::Scene,
        Self::Rope,
        Self::Image,
        Self::Calibration,
        Self::Keypoints,
        Self::Log,
        Self::Plan,
        Self::Parameters,
        Self::Summary,
    ];

    /// Topic.
    pub const fn topic(self) -> &'static str {
        match self {
            Self::Replay => "/wag/replay",
            Self::Measured => "/arm/measured",
            Self::Commanded => "/arm/commanded",
            Self::Cycles => "/controller/cycles",
            Self::Frames => "/tf",
            Self::Scene => "/scene",
            Self::Rope => "/rope/simulated",
            Self::Image => "/camera/left/image",
            Self::Calibration => "/camera/left/calibration",
            Self::Keypoints => "/camera/left/keypoints",
            Self::Log => "/log",
            Self::Plan => "/wag/plan",
            Self::Parameters => "/wag/parameters",
            Self::Summary => "/wag/summary",
        }
    }

    /// Name of the schema; none for bytes that only this program reads.
    pub const fn schema(self) -> Option<&'static str> {
        Some(match self {
            Self::Replay => return None,
            Self::Measured | Self::Commanded => "foxglove.JointStates",
            Self::Cycles => "wag.Cycle",
            Self::Frames => "foxglove.FrameTransforms",
            Self::Scene | Self::Rope => "foxglove.SceneUpdate",
            Self::Image => "foxglove.CompressedImage",
            Self::Calibration => "foxglove.CameraCalibration",
            Self::Keypoints => "foxglove.ImageAnnotations",
            Self::Log => "foxglove.Log",
            Self::Plan => "wag.Plan",
            Self::Parameters => "wag.Parameters",
            Self::Summary => "wag.Summary",
        })
    }

    /// Encoding of its messages.
    pub const fn encoding(self) -> &'static str {
        match self.schema() {
            Some(_) => "json",
            None => "wag-replay-chunk",
        }
    }
}
