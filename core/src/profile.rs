//! Types with their capacities filled in, so that they can be named: one module for each geometry of arrays and beams.
//!
//! The stages are generic over how many arrays, elements, beams and paths there are. Who uses the geometry that a module here
//! describes writes `profile::FlightEstimator` and need not know ten numbers. Another geometry is another module like
//! [`quad_4x16_gmt_48`].

pub use quad_4x8_gmt_72::{
    Block, Config as FlightConfig, FlightEstimator, PaperFlightEstimator, Radio, Receiver, ReceiverMemory,
    Samples, SweepPaths,
};

/// The default: four tilted arrays of eight elements on the UAV (`quad-tilted-4x8` in recordings), three faces of 8 x 8 elements with
/// 72 beams at the GMT (`gmt-72`), nine paths a sweep.
pub mod quad_4x8_gmt_72 {
    use crate::paths::{EstimatedPath, Estimator, EstimatorConfig, PaperEstimator};
    use crate::receiver::{self, Antennas, Memory};
    use crate::signal::{BeamBlock, Iq, SAMPLES};

    /// Receive arrays on the UAV.
    pub const ARRAYS: usize = 4;
    /// Elements of an array.
    pub const ELEMENTS: usize = 8;
    /// Receive channels, array-major: channel = 8 j + i.
    pub const CHANNELS: usize = ARRAYS * ELEMENTS;
    /// Faces of the GMT.
    pub const FACES: usize = 3;
    /// Columns of elements of a face.
    pub const COLUMNS: usize = 8;
    /// Rows of elements of a face.
    pub const ROWS: usize = 8;
    /// Elevations of the codebook.
    pub const ELEVATIONS: usize = 3;
    /// Transmit beams of a sweep.
    pub const BEAMS: usize = 72;
    /// Azimuth sweeps and elevation sweeps of the squint symbols of a face.
    pub const SQUINT_SWEEPS: [usize; 2] = [3, 8];
    /// Squint symbols of a face.
    pub const SYMBOLS: usize = 11;
    /// Active subcarriers.
    pub const ACTIVE: usize = 416;
    /// Detections that are kept in a sweep.
    pub const DETECTIONS: usize = 360;
    /// Paths that are reported of a sweep.
    pub const PATHS: usize = receiver::PATHS;

    /// Configuration of [`FlightEstimator`] and [`PaperFlightEstimator`].
    pub type Config = EstimatorConfig<ARRAYS, ELEMENTS, FACES, COLUMNS, ROWS, ELEVATIONS>;
    /// The path estimator that flies. 77 KiB; [`FlightEstimator::checked`] builds it from a configuration that is checked.
    pub type FlightEstimator =
        Estimator<ARRAYS, ELEMENTS, CHANNELS, BEAMS, FACES, COLUMNS, ROWS, DETECTIONS, PATHS>;
    /// The published estimator, for comparison.
    pub type PaperFlightEstimator = PaperEstimator<ARRAYS, ELEMENTS, CHANNELS, BEAMS, PATHS>;
    /// Samples of a beam, by channel and sample: 64 KiB.
    pub type Samples = [[Iq; SAMPLES]; CHANNELS];
    /// What an estimator takes for one beam; its exponent is its own.
    pub type Block<'a> = BeamBlock<'a, CHANNELS>;
    /// Paths of a sweep, strongest first.
    pub type SweepPaths = heapless::Vec<EstimatedPath, PATHS>;
    /// The radio as a receiver takes it, its paths estimated by `E`.
    pub type Radio<E = FlightEstimator> = Antennas<
        E,
        ARRAYS,
        ELEMENTS,
        CHANNELS,
        FACES,
        COLUMNS,
        ROWS,
        ELEVATIONS,
        { SQUINT_SWEEPS[0] },
        { SQUINT_SWEEPS[1] },
        SYMBOLS,
        ACTIVE,
    >;
    /// The whole receiver, with a map of `VOXELS` voxels.
    pub type Receiver<'m, const VOXELS: usize> = receiver::Receiver<'m, Radio, VOXELS>;
    /// Its large parts.
    pub type ReceiverMemory<'m, const VOXELS: usize> = Memory<'m, Radio, VOXELS>;
}

/// Another radio: four tilted arrays of sixteen elements on the UAV, three faces of 8 x 8 elements with
/// 48 beams at the GMT, a carrier of 28 GHz and another Zadoff-Chu root.
pub mod quad_4x16_gmt_48 {
    use crate::array::CodebookConfig;
    use crate::paths::{Estimator, EstimatorConfig};
    use crate::radio::RadioConfig;
    use crate::receiver::{self, Antennas, Memory};
    use crate::signal::{BeamBlock, Iq, SAMPLES, Waveform};

    /// Receive arrays on the UAV.
    pub const ARRAYS: usize = 4;
    /// Elements of an array.
    pub const ELEMENTS: usize = 16;
    /// Receive channels, array-major: channel = 16 j + i.
    pub const CHANNELS: usize = ARRAYS * ELEMENTS;
    /// Faces of the GMT.
    pub const FACES: usize = 3;
    /// Columns of elements of a face.
    pub const COLUMNS: usize = 8;
    /// Rows of elements of a face.
    pub const ROWS: usize = 8;
    /// Elevations of the codebook.
    pub const ELEVATIONS: usize = 2;
    /// Transmit beams of a sweep.
    pub const BEAMS: usize = 48;
    /// Azimuth sweeps and elevation sweeps of the squint symbols of a face.
    pub const SQUINT_SWEEPS: [usize; 2] = [3, 8];
    /// Squint symbols of a face.
    pub const SYMBOLS: usize = 11;
    /// Active subcarriers.
    pub const ACTIVE: usize = 416;
    /// Detections that are kept in a sweep.
    pub const DETECTIONS: usize = 240;
    /// Paths that are reported of a sweep.
    pub const PATHS: usize = receiver::PATHS;

    /// Description of the radio.
    pub type Description = RadioConfig<ELEVATIONS>;
    /// Configuration of [`FlightEstimator`].
    pub type Config = EstimatorConfig<ARRAYS, ELEMENTS, FACES, COLUMNS, ROWS, ELEVATIONS>;
    /// The path estimator.
    pub type FlightEstimator =
        Estimator<ARRAYS, ELEMENTS, CHANNELS, BEAMS, FACES, COLUMNS, ROWS, DETECTIONS, PATHS>;
    /// Samples of a beam, by channel and sample: 128 KiB.
    pub type Samples = [[Iq; SAMPLES]; CHANNELS];
    /// What the estimator takes for one beam; its exponent is its own.
    pub type Block<'a> = BeamBlock<'a, CHANNELS>;
    /// The radio as a receiver takes it.
    pub type Radio = Antennas<
        FlightEstimator,
        ARRAYS,
        ELEMENTS,
        CHANNELS,
        FACES,
        COLUMNS,
        ROWS,
        ELEVATIONS,
        { SQUINT_SWEEPS[0] },
        { SQUINT_SWEEPS[1] },
        SYMBOLS,
        ACTIVE,
    >;
    /// The whole receiver, with a map of `VOXELS` voxels.
    pub type Receiver<'m, const VOXELS: usize> = receiver::Receiver<'m, Radio, VOXELS>;
    /// Its large parts.
    pub type ReceiverMemory<'m, const VOXELS: usize> = Memory<'m, Radio, VOXELS>;

    /// The radio: 28 GHz, root 136, two elevations at 0 and 14 degrees; all else as by default.
    #[must_use]
    pub fn radio() -> Description {
        let default = RadioConfig::default();
        RadioConfig {
            waveform: Waveform {
                carrier_hz: 28e9,
                root: 136,
                ..default.waveform
            },
            codebook: CodebookConfig {
                azimuths: default.codebook.azimuths,
                sector_rad: default.codebook.sector_rad,
                elevations_rad: [0.0, 14.0].map(f64::to_radians),
            },
            uav_arrays: default.uav_arrays,
            gmt_arrays: default.gmt_arrays,
            squint_scheme: default.squint_scheme,
            squint: default.squint,
        }
    }
}

/// A planar array on the UAV: 8 x 8 elements on its nose at 60 GHz, and the default's faces and 72 beams at the GMT. It hears what is before it.
pub mod planar_8x8_gmt_72 {
    use crate::array::{UavArrayConfig, UavElement, UavLayout};
    use crate::paths::{Estimator, EstimatorConfig};
    use crate::radio::RadioConfig;
    use crate::receiver::{self, Antennas, Memory};
    use crate::signal::{BeamBlock, Iq, SAMPLES, Waveform};

    /// Rows of the UAV's array.
    pub const ARRAYS: usize = 8;
    /// Elements of a row.
    pub const ELEMENTS: usize = 8;
    /// Receive channels, row after row: channel = 8 j + i.
    pub const CHANNELS: usize = ARRAYS * ELEMENTS;
    /// Faces of the GMT.
    pub const FACES: usize = 3;
    /// Columns of elements of a face.
    pub const COLUMNS: usize = 8;
    /// Rows of elements of a face.
    pub const ROWS: usize = 8;
    /// Elevations of the codebook.
    pub const ELEVATIONS: usize = 3;
    /// Transmit beams of a sweep.
    pub const BEAMS: usize = 72;
    /// Azimuth sweeps and elevation sweeps of the squint symbols of a face.
    pub const SQUINT_SWEEPS: [usize; 2] = [3, 8];
    /// Squint symbols of a face.
    pub const SYMBOLS: usize = 11;
    /// Active subcarriers.
    pub const ACTIVE: usize = 416;
    /// Detections that are kept in a sweep.
    pub const DETECTIONS: usize = 360;
    /// Paths that are reported of a sweep.
    pub const PATHS: usize = receiver::PATHS;

    /// Description of the radio.
    pub type Description = RadioConfig<ELEVATIONS>;
    /// Configuration of [`FlightEstimator`].
    pub type Config = EstimatorConfig<ARRAYS, ELEMENTS, FACES, COLUMNS, ROWS, ELEVATIONS>;
    /// The path estimator.
    pub type FlightEstimator =
        Estimator<ARRAYS, ELEMENTS, CHANNELS, BEAMS, FACES, COLUMNS, ROWS, DETECTIONS, PATHS>;
    /// Samples of a beam, by channel and sample: 128 KiB.
    pub type Samples = [[Iq; SAMPLES]; CHANNELS];
    /// What the estimator takes for one beam; its exponent is its own.
    pub type Block<'a> = BeamBlock<'a, CHANNELS>;
    /// The radio as a receiver takes it.
    pub type Radio = Antennas<
        FlightEstimator,
        ARRAYS,
        ELEMENTS,
        CHANNELS,
        FACES,
        COLUMNS,
        ROWS,
        ELEVATIONS,
        { SQUINT_SWEEPS[0] },
        { SQUINT_SWEEPS[1] },
        SYMBOLS,
        ACTIVE,
    >;
    /// The whole receiver, with a map of `VOXELS` voxels.
    pub type Receiver<'m, const VOXELS: usize> = receiver::Receiver<'m, Radio, VOXELS>;
    /// Its large parts.
    pub type ReceiverMemory<'m, const VOXELS: usize> = Memory<'m, Radio, VOXELS>;

    /// The radio: 60 GHz, an array that looks ahead and whose elements fall by 200 dB from the side to the rear; all else as by default.
    #[must_use]
    pub fn radio() -> Description {
        RadioConfig {
            waveform: Waveform {
                carrier_hz: 60e9,
                ..Waveform::default()
            },
            uav_arrays: UavArrayConfig {
                layout: UavLayout::Planar { azimuth_rad: 0.0 },
                tilt_rad: 0.0,
                element: UavElement {
                    rear_attenuation_db: 200.0,
                    ..UavElement::default()
                },
                ..UavArrayConfig::default()
            },
            ..RadioConfig::default()
        }
    }
}
