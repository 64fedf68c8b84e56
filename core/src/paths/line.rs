//! A path as a line of text, the same characters wherever it is printed.

use core::fmt;

use super::EstimatedPath;
use crate::geometry::Frame;

impl EstimatedPath {
    /// Names of the columns of [`EstimatedPath`]'s `Display`, a comma between them: length, arrival as a unit vector in body axes,
    /// departure as a unit vector in its own axes with its standard deviation (empty where the beams did not show it), SNR, beam, and the upper
    /// triangle of the covariance by rows, `r` for the length and `1`, `2` for the tangents of the arrival ([`Path::covariance`]).
    ///
    /// [`Path::covariance`]: crate::path::Path::covariance
    pub const COLUMNS: &'static str = "c_tau_m,aoa_x,aoa_y,aoa_z,aod_x,aod_y,aod_z,aod_sigma_rad,snr_db,beam,\
        cov_rr_m2,cov_r1_m_rad,cov_r2_m_rad,cov_11_rad2,cov_12_rad2,cov_22_rad2";
}

/// Values of [`EstimatedPath::COLUMNS`], a comma between them: digits after the point are fixed (6 of lengths, 8 of directions and
/// angles, 5 of dB, 12 of the covariance), so that `printf` of C prints the same of the same bits.
impl<D: Frame> fmt::Display for EstimatedPath<D> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let aoa = self.path.aoa.vector();
        write!(
            f,
            "{:.6},{:.8},{:.8},{:.8},",
            self.path.c_tau_m, aoa.x, aoa.y, aoa.z
        )?;
        match &self.path.aod {
            Some(aod) => {
                let v = aod.direction.vector();
                write!(f, "{:.8},{:.8},{:.8},{:.8},", v.x, v.y, v.z, aod.sigma_rad)?;
            }
            None => f.write_str(",,,,")?,
        }
        write!(f, "{:.5},{}", self.snr_db, self.beam)?;
        let c = &self.path.covariance;
        for x in [c.m11, c.m12, c.m13, c.m22, c.m23, c.m33] {
            write!(f, ",{x:.12}")?;
        }
        Ok(())
    }
}
