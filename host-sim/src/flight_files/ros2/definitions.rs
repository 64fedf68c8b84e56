//! Definitions of the messages, as a ROS 2 recording carries them: the type itself, then every type that is in it, apart by lines of
//! equal signs.
//!
//! Fields and their order are those of the packages `builtin_interfaces`, `std_msgs`, `geometry_msgs`, `nav_msgs`, `sensor_msgs` and
//! `tf2_msgs` of ROS 2 (REP 103, REP 105 and <https://docs.ros2.org> have units and frames).

/// Name and fields of a type.
type Definition = (&'static str, &'static str);

const TIME: Definition = ("builtin_interfaces/Time", "int32 sec\nuint32 nanosec\n");
const HEADER: Definition = (
    "std_msgs/Header",
    "builtin_interfaces/Time stamp\nstring frame_id\n",
);
const POINT: Definition = ("geometry_msgs/Point", "float64 x\nfloat64 y\nfloat64 z\n");
const VECTOR: Definition = ("geometry_msgs/Vector3", "float64 x\nfloat64 y\nfloat64 z\n");
const QUATERNION: Definition = (
    "geometry_msgs/Quaternion",
    "float64 x\nfloat64 y\nfloat64 z\nfloat64 w\n",
);
const POSE: Definition = (
    "geometry_msgs/Pose",
    "geometry_msgs/Point position\ngeometry_msgs/Quaternion orientation\n",
);
const POSE_WITH_COVARIANCE: Definition = (
    "geometry_msgs/PoseWithCovariance",
    "geometry_msgs/Pose pose\nfloat64[36] covariance\n",
);
const TWIST: Definition = (
    "geometry_msgs/Twist",
    "geometry_msgs/Vector3 linear\ngeometry_msgs/Vector3 angular\n",
);
const TWIST_WITH_COVARIANCE: Definition = (
    "geometry_msgs/TwistWithCovariance",
    "geometry_msgs/Twist twist\nfloat64[36] covariance\n",
);
const TRANSFORM: Definition = (
    "geometry_msgs/Transform",
    "geometry_msgs/Vector3 translation\ngeometry_msgs/Quaternion rotation\n",
);
const TRANSFORM_STAMPED: Definition = (
    "geometry_msgs/TransformStamped",
    "std_msgs/Header header\nstring child_frame_id\ngeometry_msgs/Transform transform\n",
);
const POINT_FIELD: Definition = (
    "sensor_msgs/PointField",
    "uint8 INT8=1\nuint8 UINT8=2\nuint8 INT16=3\nuint8 UINT16=4\nuint8 INT32=5\nuint8 UINT32=6\nuint8 FLOAT32=7\n\
     uint8 FLOAT64=8\nstring name\nuint32 offset\nuint8 datatype\nuint32 count\n",
);

/// A type of message.
#[derive(Clone, Copy, Debug)]
pub(super) struct Kind {
    /// Its full name.
    pub(super) name: &'static str,
    fields: &'static str,
    within: &'static [Definition],
}

impl Kind {
    /// The definition that a recording carries.
    pub(super) fn schema(&self) -> String {
        let mut schema = self.fields.to_owned();
        for (name, fields) in self.within {
            let line = "=".repeat(80);
            schema += &format!("{line}\nMSG: {name}\n{fields}");
        }
        schema
    }
}

pub(super) const ODOMETRY: Kind = Kind {
    name: "nav_msgs/msg/Odometry",
    fields: "std_msgs/Header header\nstring child_frame_id\ngeometry_msgs/PoseWithCovariance pose\n\
             geometry_msgs/TwistWithCovariance twist\n",
    within: &[
        HEADER,
        TIME,
        POSE_WITH_COVARIANCE,
        POSE,
        POINT,
        QUATERNION,
        TWIST_WITH_COVARIANCE,
        TWIST,
        VECTOR,
    ],
};

pub(super) const TRANSFORMS: Kind = Kind {
    name: "tf2_msgs/msg/TFMessage",
    fields: "geometry_msgs/TransformStamped[] transforms\n",
    within: &[TRANSFORM_STAMPED, HEADER, TIME, TRANSFORM, VECTOR, QUATERNION],
};

pub(super) const IMU: Kind = Kind {
    name: "sensor_msgs/msg/Imu",
    fields: "std_msgs/Header header\ngeometry_msgs/Quaternion orientation\nfloat64[9] orientation_covariance\n\
             geometry_msgs/Vector3 angular_velocity\nfloat64[9] angular_velocity_covariance\n\
             geometry_msgs/Vector3 linear_acceleration\nfloat64[9] linear_acceleration_covariance\n",
    within: &[HEADER, TIME, QUATERNION, VECTOR],
};

pub(super) const CLOUD: Kind = Kind {
    name: "sensor_msgs/msg/PointCloud2",
    fields: "std_msgs/Header header\nuint32 height\nuint32 width\nsensor_msgs/PointField[] fields\nbool is_bigendian\n\
             uint32 point_step\nuint32 row_step\nuint8[] data\nbool is_dense\n",
    within: &[HEADER, TIME, POINT_FIELD],
};
