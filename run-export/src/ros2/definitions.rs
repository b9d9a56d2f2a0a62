//! The message types of the topics, in the words of ROS 2: what a reader needs to understand the
//! bag without having the packages.
//!
//! Fields and constants of `common_interfaces`, `rcl_interfaces` and `geometry2`, the same from
//! Humble on; the test with the library `rosbags` compares their hashes with those of ROS.

/// A type: its name, what is in it, and the types named there, theirs included.
#[derive(Debug)]
pub struct Definition {
    package: &'static str,
    name: &'static str,
    fields: &'static str,
    uses: &'static [&'static Definition],
}

/// Line between the types of a definition.
const BETWEEN: &str =
    "================================================================================";

impl Definition {
    /// Full name: `sensor_msgs/msg/JointState`.
    #[must_use]
    pub fn full_name(&self) -> String {
        format!("{}/msg/{}", self.package, self.name)
    }

    /// The whole definition, each type once.
    pub(super) fn text(&self) -> String {
        let mut text = self.fields.to_owned();
        for used in self.uses {
            let Self {
                package,
                name,
                fields,
                ..
            } = used;
            text.push_str(&format!("{BETWEEN}\nMSG: {package}/{name}\n{fields}"));
        }
        text
    }
}

/// A type that is made of numbers and texts.
const fn plain(package: &'static str, name: &'static str, fields: &'static str) -> Definition {
    made_of(package, name, fields, &[])
}

const fn made_of(
    package: &'static str,
    name: &'static str,
    fields: &'static str,
    uses: &'static [&'static Definition],
) -> Definition {
    Definition {
        package,
        name,
        fields,
        uses,
    }
}

static TIME: Definition = plain("builtin_interfaces", "Time", "int32 sec\nuint32 nanosec\n");
static DURATION: Definition = plain(
    "builtin_interfaces",
    "Duration",
    "int32 sec\nuint32 nanosec\n",
);
static HEADER: Definition = made_of(
    "std_msgs",
    "Header",
    "builtin_interfaces/Time stamp\nstring frame_id\n",
    &[&TIME],
);
static COLOUR: Definition = plain(
    "std_msgs",
    "ColorRGBA",
    "float32 r\nfloat32 g\nfloat32 b\nfloat32 a\n",
);
static POINT: Definition = plain(
    "geometry_msgs",
    "Point",
    "float64 x\nfloat64 y\nfloat64 z\n",
);
static VECTOR: Definition = plain(
    "geometry_msgs",
    "Vector3",
    "float64 x\nfloat64 y\nfloat64 z\n",
);
static QUATERNION: Definition = plain(
    "geometry_msgs",
    "Quaternion",
    "float64 x\nfloat64 y\nfloat64 z\nfloat64 w\n",
);
static TRANSFORM: Definition = made_of(
    "geometry_msgs",
    "Transform",
    "geometry_msgs/Vector3 translation\ngeometry_msgs/Quaternion rotation\n",
    &[&VECTOR, &QUATERNION],
);
static TRANSFORM_STAMPED: Definition = made_of(
    "geometry_msgs",
    "TransformStamped",
    "std_msgs/Header header\nstring child_frame_id\ngeometry_msgs/Transform transform\n",
    &[&HEADER, &TIME, &TRANSFORM, &VECTOR, &QUATERNION],
);
static REGION: Definition = plain(
    "sensor_msgs",
    "RegionOfInterest",
    "uint32 x_offset\nuint32 y_offset\nuint32 height\nuint32 width\nbool do_rectify\n",
);

/// Joints by name.
pub(super) static JOINT_STATE: Definition = made_of(
    "sensor_msgs",
    "JointState",
    "std_msgs/Header header\nstring[] name\nfloat64[] position\nfloat64[] velocity\n\
     float64[] effort\n",
    &[&HEADER, &TIME],
);
/// Transforms between frames.
pub(super) static TF: Definition = made_of(
    "tf2_msgs",
    "TFMessage",
    "geometry_msgs/TransformStamped[] transforms\n",
    &[
        &TRANSFORM_STAMPED,
        &HEADER,
        &TIME,
        &TRANSFORM,
        &VECTOR,
        &QUATERNION,
    ],
);
/// A picture.
pub(super) static COMPRESSED_IMAGE: Definition = made_of(
    "sensor_msgs",
    "CompressedImage",
    "std_msgs/Header header\nstring format\nuint8[] data\n",
    &[&HEADER, &TIME],
);
/// How a camera sees.
pub(super) static CAMERA_INFO: Definition = made_of(
    "sensor_msgs",
    "CameraInfo",
    "std_msgs/Header header\nuint32 height\nuint32 width\nstring distortion_model\nfloat64[] d\n\
     float64[9] k\nfloat64[9] r\nfloat64[12] p\nuint32 binning_x\nuint32 binning_y\n\
     sensor_msgs/RegionOfInterest roi\n",
    &[&HEADER, &TIME, &REGION],
);
/// What is drawn in a picture, in its pixels.
pub(super) static IMAGE_MARKER: Definition = made_of(
    "visualization_msgs",
    "ImageMarker",
    "int32 CIRCLE=0\nint32 LINE_STRIP=1\nint32 LINE_LIST=2\nint32 POLYGON=3\nint32 POINTS=4\n\
     int32 ADD=0\nint32 REMOVE=1\nstd_msgs/Header header\nstring ns\nint32 id\nint32 type\n\
     int32 action\ngeometry_msgs/Point position\nfloat32 scale\nstd_msgs/ColorRGBA outline_color\n\
     uint8 filled\nstd_msgs/ColorRGBA fill_color\nbuiltin_interfaces/Duration lifetime\n\
     geometry_msgs/Point[] points\nstd_msgs/ColorRGBA[] outline_colors\n",
    &[&HEADER, &TIME, &POINT, &COLOUR, &DURATION],
);
/// A line of the log.
pub(super) static LOG: Definition = made_of(
    "rcl_interfaces",
    "Log",
    "byte DEBUG=10\nbyte INFO=20\nbyte WARN=30\nbyte ERROR=40\nbyte FATAL=50\n\
     builtin_interfaces/Time stamp\nuint8 level\nstring name\nstring msg\nstring file\n\
     string function\nuint32 line\n",
    &[&TIME],
);
