//! Line of sight, one reflection or more.

use cslam_core::link_state::{Classifier, LinkGeometry, Received, models};
use cslam_core::signal::Waveform;
use heapless::Vec;

use crate::pointer::{self, Sized32};
use crate::status::CslamStatus;
use crate::values::{CslamLink, CslamMeasuredPath};

/// Paths of a link at most.
const MOST_PATHS: usize = 32;

/// What a path is.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default)]
pub struct CslamProbabilities {
    /// `sizeof(cslam_probabilities)`.
    pub size: u32,
    /// The most probable: 1 line of sight, 2 one reflection, 3 more. 0: the path is no measurement, and all probabilities are 0.
    pub state: i32,
    /// Probability of line of sight.
    pub line_of_sight: f32,
    /// Probability of one reflection.
    pub first_order: f32,
    /// Probability of two reflections or more.
    pub higher_order: f32,
}

// SAFETY: `repr(C)`, `u32` first, numbers only.
unsafe impl Sized32 for CslamProbabilities {}

const _: () = assert!(size_of::<CslamProbabilities>() == 20);

/// Probabilities of the paths of a link, by the networks that fly. They are judged together: give all of them, strongest first, 1 to 32.
///
/// # Safety
/// Pointers as their types say: `link` filled in, `count` of `paths` filled in, `count` of `probabilities`, the first with its size.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cslam_classify(
    link: *const CslamLink,
    paths: *const CslamMeasuredPath,
    count: usize,
    probabilities: *mut CslamProbabilities,
) -> CslamStatus {
    let classified = || {
        if count == 0 || count > MOST_PATHS {
            return Err(CslamStatus::OutOfRange);
        }
        // SAFETY: the caller's promise.
        unsafe { pointer::check_size(probabilities.cast_const())? };
        // SAFETY: the caller's promise.
        let ends = unsafe { pointer::read(link)? }.ends()?;
        let mut received: Vec<Received, MOST_PATHS> = Vec::new();
        pointer::check(paths)?;
        for index in 0..count {
            // SAFETY: within the `count` paths that the caller says are there.
            let path = unsafe { pointer::read(paths.add(index))? };
            received
                .push(path.received()?)
                .map_err(|_| CslamStatus::OutOfRange)?;
        }
        let (Ok(with), Ok(without)) = (models::geometric(), models::geometric_without_departure()) else {
            return Err(CslamStatus::Damaged);
        };
        let classifier = Classifier::new(with, without).map_err(|_| CslamStatus::Damaged)?;
        let geometry = LinkGeometry::new(&ends, &received, &Waveform::default())?;
        for (index, path) in received.iter().enumerate() {
            let judged = classifier.path(&geometry, path);
            let size = size_of::<CslamProbabilities>() as u32;
            let said = judged.map_or_else(
                |_| CslamProbabilities {
                    size,
                    ..CslamProbabilities::default()
                },
                |p| CslamProbabilities {
                    size,
                    state: p.state() as i32,
                    line_of_sight: p.los,
                    first_order: p.first_order,
                    higher_order: p.higher_order,
                },
            );
            // SAFETY: within the `count` structs that the caller says are there.
            unsafe { probabilities.add(index).write(said) };
        }
        Ok(())
    };
    CslamStatus::of(classified())
}
