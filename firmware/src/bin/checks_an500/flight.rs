//! Localization: a recorded flight in, every bit of the state after every sweep out, and the instructions it took. The recording's format:
//! [`cslam_firmware::flight_check`].

use cslam_core::localization::Localizer;
use cslam_firmware::flight_check;

use crate::counts::Counts;
use crate::exit::Exit;
use crate::lines::Lines;
use crate::recording::Recording;
use crate::words::Word;

/// Takes a recording through a filter of `46` or `58` states.
pub(crate) fn run(states: &Word, recording: &Word, lines: &Word) -> Result<(), Exit> {
    let (recording, lines) = (Recording::open(recording), Lines::create(lines));
    let (recording, lines) = recording.zip(lines).ok_or(Exit::Usage)?;
    let config = flight_check::config();
    match states.path().to_bytes() {
        b"46" => {
            let place = cortex_m::singleton!(: Option<Localizer<f32, 46>> = None).ok_or(Exit::Panic)?;
            fly(place.insert(Localizer::new(&config, 0)), recording, lines)
        }
        b"58" => {
            let place = cortex_m::singleton!(: Option<Localizer<f32, 58>> = None).ok_or(Exit::Panic)?;
            fly(place.insert(Localizer::new(&config, 0)), recording, lines)
        }
        _ => Err(Exit::Usage),
    }
}

fn fly<const N: usize>(
    localizer: &mut Localizer<f32, N>,
    mut recording: Recording,
    mut lines: Lines,
) -> Result<(), Exit> {
    let mut counts = Counts::default();
    match flight_check::run(&mut recording, localizer, &mut counts, &mut lines) {
        Ok(sweeps) if lines.flush().is_ok() => {
            counts.print(N);
            defmt::println!("sweeps flown {=u32}", sweeps);
            Ok(())
        }
        _ => {
            defmt::error!("the recording is damaged, or a file cannot be used");
            Err(Exit::Failed)
        }
    }
}
