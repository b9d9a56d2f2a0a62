# What ROS's own nodes would read of a run: `reader.py DOMAIN once|until-killed`.
# Eclipse Cyclone DDS subscribes to every topic under the names and with the types that ROS has in
# DDS, and prints, when each has told something, one line of JSON: the first message of each topic,
# how many there were of each by then, and what the publisher offers and takes.
import dataclasses
import hashlib
import json
import sys
import time
from dataclasses import dataclass

from cyclonedds.builtin import (
    BuiltinDataReader,
    BuiltinTopicDcpsPublication,
    BuiltinTopicDcpsSubscription,
)
from cyclonedds.core import Policy, Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.idl import IdlStruct
from cyclonedds.idl.types import array, float32, float64, int32, sequence, uint8, uint32
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration


@dataclass
class Time(IdlStruct, typename="builtin_interfaces::msg::dds_::Time_"):
    sec: int32
    nanosec: uint32


@dataclass
class Header(IdlStruct, typename="std_msgs::msg::dds_::Header_"):
    stamp: Time
    frame_id: str


@dataclass
class Vector3(IdlStruct, typename="geometry_msgs::msg::dds_::Vector3_"):
    x: float64
    y: float64
    z: float64


@dataclass
class Quaternion(IdlStruct, typename="geometry_msgs::msg::dds_::Quaternion_"):
    x: float64
    y: float64
    z: float64
    w: float64


@dataclass
class Transform(IdlStruct, typename="geometry_msgs::msg::dds_::Transform_"):
    translation: Vector3
    rotation: Quaternion


@dataclass
class TransformStamped(IdlStruct, typename="geometry_msgs::msg::dds_::TransformStamped_"):
    header: Header
    child_frame_id: str
    transform: Transform


@dataclass
class TFMessage(IdlStruct, typename="tf2_msgs::msg::dds_::TFMessage_"):
    transforms: sequence[TransformStamped]


@dataclass
class JointState(IdlStruct, typename="sensor_msgs::msg::dds_::JointState_"):
    header: Header
    name: sequence[str]
    position: sequence[float64]
    velocity: sequence[float64]
    effort: sequence[float64]


@dataclass
class CompressedImage(IdlStruct, typename="sensor_msgs::msg::dds_::CompressedImage_"):
    header: Header
    format: str
    data: sequence[uint8]


@dataclass
class RegionOfInterest(IdlStruct, typename="sensor_msgs::msg::dds_::RegionOfInterest_"):
    x_offset: uint32
    y_offset: uint32
    height: uint32
    width: uint32
    do_rectify: bool


@dataclass
class CameraInfo(IdlStruct, typename="sensor_msgs::msg::dds_::CameraInfo_"):
    header: Header
    height: uint32
    width: uint32
    distortion_model: str
    d: sequence[float64]
    k: array[float64, 9]
    r: array[float64, 9]
    p: array[float64, 12]
    binning_x: uint32
    binning_y: uint32
    roi: RegionOfInterest


@dataclass
class ColorRGBA(IdlStruct, typename="std_msgs::msg::dds_::ColorRGBA_"):
    r: float32
    g: float32
    b: float32
    a: float32


@dataclass
class ImageMarker(IdlStruct, typename="visualization_msgs::msg::dds_::ImageMarker_"):
    header: Header
    ns: str
    id: int32
    type: int32
    action: int32
    position: Vector3
    scale: float32
    outline_color: ColorRGBA
    filled: uint8
    fill_color: ColorRGBA
    lifetime: Time
    points: sequence[Vector3]
    outline_colors: sequence[ColorRGBA]


@dataclass
class Log(IdlStruct, typename="rcl_interfaces::msg::dds_::Log_"):
    stamp: Time
    level: uint8
    name: str
    msg: str
    file: str
    function: str
    line: uint32


# As nodes of ROS ask for: its default, its sensor data, and what is sent once.
KEPT = Policy.History.KeepLast(1000)
DEFAULT = Qos(Policy.Reliability.Reliable(duration(seconds=1)), Policy.Durability.Volatile, KEPT)
SENSOR = Qos(Policy.Reliability.BestEffort, Policy.Durability.Volatile, KEPT)
LATCHED = Qos(
    Policy.Reliability.Reliable(duration(seconds=1)), Policy.Durability.TransientLocal, KEPT
)
TOPICS = {
    "rt/joint_states": (JointState, DEFAULT),
    "rt/joint_setpoints": (JointState, DEFAULT),
    "rt/tf": (TFMessage, DEFAULT),
    "rt/tf_static": (TFMessage, LATCHED),
    "rt/camera/left/image/compressed": (CompressedImage, SENSOR),
    "rt/camera/left/camera_info": (CameraInfo, SENSOR),
    "rt/camera/left/keypoints": (ImageMarker, DEFAULT),
    "rt/rosout": (Log, LATCHED),
}


def told(message):
    """A message as JSON has it, without NaN; of a picture's data length and hash."""
    told = dataclasses.asdict(message)
    if "format" in told:
        data = bytes(told["data"])
        told["data"] = [len(data), hashlib.sha256(data).hexdigest()]
    return json.loads(json.dumps(told), parse_constant=str)


def endpoints(reader, own):
    """Topic, type, whether reliable, whether latched, of all endpoints but this program's."""
    found = [s for s in reader.take(N=1000) if s.participant_key != own and s.topic_name]
    return sorted(
        [
            s.topic_name,
            s.type_name,
            Policy.Reliability.BestEffort not in s.qos,
            Policy.Durability.TransientLocal in s.qos,
        ]
        for s in found
    )


def main():
    domain, mode = sys.argv[1:]
    participant = DomainParticipant(int(domain))
    offered = BuiltinDataReader(participant, BuiltinTopicDcpsPublication)
    taken = BuiltinDataReader(participant, BuiltinTopicDcpsSubscription)
    readers = {
        name: DataReader(participant, Topic(participant, name, kind), quality)
        for name, (kind, quality) in TOPICS.items()
    }
    first, counts = {}, dict.fromkeys(TOPICS, 0)
    end = time.monotonic() + 60
    while len(first) < len(TOPICS):
        if time.monotonic() > end:
            sys.exit(f"nothing came on {sorted(set(TOPICS) - set(first))}")
        for name, reader in readers.items():
            for sample in reader.take(N=100):
                counts[name] += 1
                first.setdefault(name, told(sample))
        time.sleep(0.005)
    own = participant.guid
    ends = {"offers": endpoints(offered, own), "takes": endpoints(taken, own)}
    print(json.dumps({"first": first, "counts": counts, **ends}), flush=True)
    while mode == "until-killed":
        for reader in readers.values():
            reader.take(N=100)
        time.sleep(0.005)


main()
