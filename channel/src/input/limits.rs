//! How large an input may be. Every reader of this crate takes its limits from here, and refuses what exceeds one by name
//! before it takes memory or time for it. docs/formats.md, "Limits", lists them.

/// Sizes of a kind of file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Limit {
    /// Greatest length, bytes; unpacked where the file is compressed.
    pub bytes: u64,
    /// Greatest length of a compressed file as it is stored, bytes.
    pub packed_bytes: u64,
    /// Greatest length of a line of text, bytes.
    pub line_bytes: usize,
}

impl Limit {
    /// Binary data, or text that may stand in one line.
    const fn whole(bytes: u64) -> Self {
        Self {
            bytes,
            packed_bytes: bytes,
            line_bytes: bytes as usize,
        }
    }

    /// Text of lines.
    const fn lines(bytes: u64, line_bytes: usize) -> Self {
        Self {
            line_bytes,
            ..Self::whole(bytes)
        }
    }

    /// The same, compressed to a size of its own.
    const fn packed(self, packed_bytes: u64) -> Self {
        Self { packed_bytes, ..self }
    }
}

const KIB: u64 = 1 << 10;
const MIB: u64 = 1 << 20;
const GIB: u64 = 1 << 30;

/// Path lists: an hour of a dense scene (7200 links of 20 KB) fits; the longest lines in use have 85 KB.
pub const PATH_LIST: Limit = Limit::lines(256 * MIB, MIB as usize).packed(64 * MIB);
/// Paths of one link: the densest list in use has 161.
pub const LINK_PATHS: usize = 1024;
/// SNR of a path, dB, either sign: beyond, a number is no measurement.
pub const SNR_DB: f64 = 200.0;

/// Scenes: JSON, OBJ and PLY. A face costs some 100 bytes.
pub const SCENE: Limit = Limit::whole(256 * MIB).packed(64 * MIB);
/// Faces of a scene, and triangles of a mesh.
pub const SCENE_FACES: usize = 1_000_000;
/// Vertices of all faces of a scene together.
pub const SCENE_VERTICES: usize = 4_000_000;
/// Vertices of one face: whether it crosses itself is looked up edge against edge, half a million pairs at most.
pub const FACE_VERTICES: usize = 1024;

/// Reports of flights: a hundred times the longest in use.
pub const REPORT: Limit = Limit::whole(4 * MIB);

/// Points, x,y,z a line.
pub const POINTS: Limit = Limit::lines(64 * MIB, KIB as usize);
/// Points of one file.
pub const POINT_COUNT: usize = 1_000_000;

/// Configuration files (TOML).
pub const CONFIGURATION: Limit = Limit::whole(MIB);

/// Metadata of a recording of samples. The samples themselves have the length that the metadata say, at most one block for each
/// beam of the codebook.
pub const SAMPLES_METADATA: Limit = Limit::whole(MIB);

/// Description of a recorded flight.
pub const FLIGHT_DESCRIPTION: Limit = Limit::whole(64 * KIB);
/// Length of a recorded flight, s: what a flight may be planned for.
pub const FLIGHT_S: f64 = 3600.0;
/// Files of a recorded flight: an hour of IMU samples at 4 kHz has 403 MB, of truth 140 MB.
pub const FLIGHT_EVENTS: Limit = Limit::lines(512 * MIB, 4 * KIB as usize);

/// Estimated paths of a recorded flight: an hour at two sweeps per second, of nine paths each, has 25 MB.
pub const ESTIMATED_PATHS: Limit = Limit::lines(128 * MIB, 64 * KIB as usize);

/// Packets of UAVs: at 57 600 baud, 51 hours of one.
pub const PACKETS: Limit = Limit::whole(GIB);

/// Key file of a link.
pub const KEY: Limit = Limit::whole(KIB);

/// Model files of the flight code; those that fly have some 30 KB.
pub const MODEL: Limit = Limit::whole(16 * MIB);
/// Float models.
pub const FLOAT_MODEL: Limit = Limit::whole(64 * MIB);

/// Description of a data set.
pub const DATASET_DESCRIPTION: Limit = Limit::whole(16 * MIB);
/// One column of one shard.
pub const DATASET_COLUMN: Limit = Limit::whole(2 * GIB);
/// Shards of a data set.
pub const DATASET_SHARDS: usize = 9999;
/// Links of a data set: three times those of the paper's.
pub const DATASET_LINKS: usize = 100_000_000;

/// Figures to compare with.
pub const FIGURES: Limit = Limit::whole(MIB);
