//! Physical constants, each with its derivation. Everything else that is a number of the system (carrier, array
//! geometry, waveform) is configuration and lives with its owner.

/// Speed of light in vacuum, m/s. Exact by the definition of the metre (SI, 1983).
pub const SPEED_OF_LIGHT_M_PER_S: f64 = 299_792_458.0;

/// Boltzmann constant, J/K. Exact by the definition of the kelvin (SI, 2019).
pub const BOLTZMANN_J_PER_K: f64 = 1.380_649e-23;

/// Reference noise temperature of receiver noise figures, K (IEEE standard 161): `k T0` is -173.98 dBm/Hz.
pub const NOISE_TEMPERATURE_K: f64 = 290.0;

/// Electric constant, F/m (CODATA 2018). Turns a conductivity into the imaginary part of a relative permittivity.
pub const VACUUM_PERMITTIVITY_F_PER_M: f64 = 8.854_187_812_8e-12;

/// Standard gravity, m/s^2. Exact by definition (CGPM, 1901).
pub const STANDARD_GRAVITY_M_PER_S2: f64 = 9.806_65;
