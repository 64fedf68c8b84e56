//! Foxglove's messages of what has a place: poses, clouds, the scene.

use foxglove::messages::line_primitive::Type as LineType;
use foxglove::messages::packed_element_field::NumericType;
use foxglove::messages::{
    Color, FrameTransform, FrameTransforms, LinePrimitive, PackedElementField, Point3, PointCloud, Pose,
    PoseInFrame, PosesInFrame, Quaternion, SceneEntity, SceneUpdate, Timestamp, TriangleListPrimitive,
    Vector3,
};

use crate::flight_log::{FlightLog, MapVoxel, PointRecord};
use crate::scene::{Face, Scene, triangles};

/// Position (m) and quaternion [w, x, y, z].
type Placed = ([f64; 3], [f64; 4]);

const WORLD: &str = "world";

/// Colour of the true walls.
const WALLS: Color = Color {
    r: 0.55,
    g: 0.6,
    b: 0.65,
    a: 0.8,
};

fn timestamp(time_ns: u64) -> Option<Timestamp> {
    Some(Timestamp::new(
        (time_ns / 1_000_000_000) as u32,
        (time_ns % 1_000_000_000) as u32,
    ))
}

fn vector([x, y, z]: [f64; 3]) -> Option<Vector3> {
    Some(Vector3 { x, y, z })
}

fn quaternion([w, x, y, z]: [f64; 4]) -> Option<Quaternion> {
    Some(Quaternion { x, y, z, w })
}

fn placed((position_m, attitude): Placed) -> Pose {
    Pose {
        position: vector(position_m),
        orientation: quaternion(attitude),
    }
}

/// Where a frame stands in the world.
pub(crate) fn transform(child: &str, (position_m, attitude): Placed, time_ns: u64) -> FrameTransforms {
    FrameTransforms {
        transforms: vec![FrameTransform {
            timestamp: timestamp(time_ns),
            parent_frame_id: WORLD.into(),
            child_frame_id: child.into(),
            translation: vector(position_m),
            rotation: quaternion(attitude),
        }],
    }
}

/// A pose of the UAV.
pub(crate) fn pose(at: Placed, time_ns: u64) -> PoseInFrame {
    PoseInFrame {
        timestamp: timestamp(time_ns),
        frame_id: WORLD.into(),
        pose: Some(placed(at)),
    }
}

/// The whole trajectory, estimated or true.
pub(crate) fn path(log: &FlightLog, truth: bool, time_ns: u64) -> PosesInFrame {
    let poses = log.trajectory();
    let poses = poses.iter().filter_map(|record| {
        if truth {
            return record.truth.map(|t| placed((t.position_m, t.quaternion_wb)));
        }
        record.estimate.map(|e| placed((e.position_m, e.quaternion_wb)))
    });
    PosesInFrame {
        timestamp: timestamp(time_ns),
        frame_id: WORLD.into(),
        poses: poses.collect(),
    }
}

/// Every face of the scene: its edges, and itself as triangles, thin as glass.
pub(crate) fn scene(scene: &Scene) -> SceneUpdate {
    let corner = |v: nalgebra::Vector3<f64>| Point3 {
        x: v.x,
        y: v.y,
        z: v.z,
    };
    let outline = |face: &Face| LinePrimitive {
        r#type: LineType::LineLoop as i32,
        pose: Some(placed(([0.0; 3], [1.0, 0.0, 0.0, 0.0]))),
        thickness: 1.0,
        scale_invariant: true,
        points: face.vertices().iter().copied().map(corner).collect(),
        color: Some(WALLS),
        colors: Vec::new(),
        indices: Vec::new(),
    };
    let corners = scene.faces().iter().flat_map(triangles).flatten();
    let glass = TriangleListPrimitive {
        pose: Some(placed(([0.0; 3], [1.0, 0.0, 0.0, 0.0]))),
        points: corners.map(corner).collect(),
        color: Some(Color { a: 0.12, ..WALLS }),
        colors: Vec::new(),
        indices: Vec::new(),
    };
    SceneUpdate {
        deletions: Vec::new(),
        entities: vec![SceneEntity {
            timestamp: timestamp(0),
            frame_id: WORLD.into(),
            id: "scene".into(),
            lines: scene.faces().iter().map(outline).collect(),
            triangles: vec![glass],
            ..SceneEntity::default()
        }],
    }
}

/// Accepted reflection points.
pub(crate) fn points(points: &[PointRecord], time_ns: u64) -> PointCloud {
    let mut cloud = Cloud::new(
        &[
            "x",
            "y",
            "z",
            "covariance_trace",
            "probability",
            "snr_db",
            "time_s",
        ],
        "gmt_index",
    );
    for p in points {
        let [x, y, z] = p.position_m;
        let (probability, snr_db) = (p.probability, p.snr_db);
        cloud.push(
            &[
                x,
                y,
                z,
                p.covariance_trace_m2,
                probability.unwrap_or(f64::NAN),
                snr_db.unwrap_or(f64::NAN),
                p.time_s,
            ],
            p.gmt_index,
        );
    }
    cloud.finish(time_ns)
}

/// The fused map.
pub(crate) fn map(map: &[MapVoxel], time_ns: u64) -> PointCloud {
    let mut cloud = Cloud::new(&["x", "y", "z", "covariance_trace"], "hits");
    for voxel in map {
        let [x, y, z] = voxel.position_m;
        cloud.push(&[x, y, z, voxel.covariance_trace_m2], voxel.hits);
    }
    cloud.finish(time_ns)
}

/// A cloud of 32-bit floats and one unsigned number a point.
struct Cloud {
    fields: Vec<PackedElementField>,
    data: Vec<u8>,
}

impl Cloud {
    fn new(floats: &[&str], count: &str) -> Self {
        let named = floats.iter().map(|name| (*name, NumericType::Float32));
        let all = named.chain([(count, NumericType::Uint32)]);
        let field = |(index, (name, kind)): (u32, (&str, NumericType))| PackedElementField {
            name: name.into(),
            offset: 4 * index,
            r#type: kind as i32,
        };
        Self {
            fields: (0..).zip(all).map(field).collect(),
            data: Vec::new(),
        }
    }

    fn push(&mut self, floats: &[f64], count: u32) {
        for value in floats {
            self.data.extend_from_slice(&(*value as f32).to_le_bytes());
        }
        self.data.extend_from_slice(&count.to_le_bytes());
    }

    fn finish(self, time_ns: u64) -> PointCloud {
        PointCloud {
            timestamp: timestamp(time_ns),
            frame_id: WORLD.into(),
            pose: Some(placed(([0.0; 3], [1.0, 0.0, 0.0, 0.0]))),
            point_stride: 4 * self.fields.len() as u32,
            fields: self.fields,
            data: self.data.into(),
        }
    }
}
