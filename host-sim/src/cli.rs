//! Command line: parsing, dispatch and exit codes.

use std::io::ErrorKind;
use std::process::ExitCode;

use clap::{CommandFactory, Parser, Subcommand};

use crate::commands;
use crate::input::InputError;
use crate::{output, progress};

/// A UAV that sees with radio: simulate its world, fly its receiver, look at its map.
///
/// Without a subcommand this flies (`cslam fly`).
#[derive(Parser, Debug)]
#[command(name = "cslam", version, max_term_width = 100)]
struct Cli {
    /// Say nothing but results, warnings and errors: no progress bars, no notes
    #[arg(short, long, global = true)]
    quiet: bool,
    #[command(subcommand)]
    command: Option<Command>,
}

#[derive(Subcommand, Debug)]
enum Command {
    /// Measure path estimation against its Cramer-Rao bound
    ///
    /// Seeded Monte Carlo through channel, 12-bit converter and exactly the estimator that flies.
    Accuracy(commands::accuracy::Args),
    /// Time the host side: a table of speed figures
    ///
    /// Times the work as a user gets it, everything included. Figures hold for this machine and its load only.
    Bench(commands::bench::Args),
    /// Many flights in one command, and what they say together
    ///
    /// Scenes, seeds, worlds and modes, on all processors; ended, it goes on where it was. Prints median, worst and pooled
    /// figures with their intervals, and the flights furthest from the others. Two campaigns are compared flight by flight.
    Campaign(commands::campaign::Args),
    /// Classify links and paths: line of sight, one reflection, or more
    ///
    /// The models that come with the program, exactly as they fly: integer networks over features of the measured paths.
    /// A path is accepted for the map when one reflection is probable and its point passes the gates. A link without a path
    /// is an outage, state 0. Prints a line a path, and a summary; where the file knows the orders, it compares with them.
    Classify(commands::classify::Args),
    /// Print what a shell needs to complete the command line
    ///
    /// bash: cslam completions bash > ~/.local/share/bash-completion/completions/cslam
    ///
    /// zsh: cslam completions zsh > DIR/_cslam, with DIR in $fpath
    ///
    /// fish: cslam completions fish > ~/.config/fish/completions/cslam.fish
    Completions(commands::completions::Args),
    /// Print every key of a configuration with its default, unit, range and meaning, or check a file
    ///
    /// One TOML file for the simulated world, the receiver and the board: `fly`, `record`, `synth`, `imu` and `key image` take it
    /// with --config. The output is a configuration itself, that of the defaults. docs/formats.md
    Config(commands::config::Args),
    /// Make a data set for the link-state classifier: ray-traced links as NumPy columns
    ///
    /// Every transmitter with every free point of a receiver grid, or a seeded sample of these links. The paper's
    /// protocol is --scene outdoor --rate 1, once with --set train and once with --set validation: 28.8 and 14.4 million
    /// links. Links hold the truth; measurement errors are drawn when a network is trained. docs/link-state.md
    Dataset(commands::dataset::Args),
    /// Estimate the paths in recordings, with exactly the estimator that flies
    ///
    /// Every recording leads to one link of the paths format with beam, SNR and covariance of each path. Where the recording
    /// has the UAV's attitude, angles of arrival are in the world frame and the output feeds `cslam solve`.
    Estimate(commands::estimate::Args),
    /// Fly: measure, solve, map and send (the default)
    ///
    /// The UAV hears the GMT on one link after the other, solves the reflection point of each path, judges it, and
    /// sends what it found to the ground. Every simulated measurement has errors of the stated size; the receiver never sees
    /// the truth. With --scene it gets nothing but raw samples and sensors, and finds its own pose. With --paths it flies over a
    /// list of paths; your own measured ones are taken as they are. Writes point clouds, trajectories, packets, an MCAP
    /// recording, report.json and report.html.
    Fly(commands::fly::Args),
    /// Ground station: hear UAVs, merge their maps, show them live in a browser
    ///
    /// Takes packets over UDP, from a radio on a serial port or from a file, of several UAVs at once; serves a page that needs
    /// no network; records, and passes on as MAVLink. Runs until Ctrl-C, or to the end of a file. docs/ground-station.md
    #[cfg(feature = "ground")]
    Ground(commands::ground::Args),
    /// Characterise the simulated IMU: Allan deviation of a run at rest
    ///
    /// Prints the Allan deviation of gyroscope and accelerometer over averaging time, and white noise, bias instability
    /// and bias walk read off it beside the figures that the simulation was given.
    Imu(commands::imu::Args),
    /// Draw and check the keys of the links between UAVs and ground
    ///
    /// Every packet between a UAV and the ground is signed with the key of that UAV. A key file holds the number of the UAV and
    /// its key; whoever reads it can speak for the UAV and to it. Nothing prints a key. docs/telemetry.md
    Key(commands::key::Args),
    /// Print the manual page, or write those of all subcommands
    ///
    /// After cslam man --out ~/.local/share/man/man1 there are `man cslam`, `man cslam-fly` and so on.
    Man(commands::manual::Args),
    /// Quantise a float network: the int8 model file that flies
    ///
    /// Reads a network that `cslam train` or PyTorch wrote, sets the scales of its integers by calibration samples, writes the
    /// model file, and says what the rounding costs, layer by layer and in accuracy.
    Quantize(commands::quantize::Args),
    /// Record a flight: raw samples, IMU, magnetometer, beacons, timing, and the truth beside them
    ///
    /// Plans a flight through a scene and writes everything the receiver is given, with every error at its budget. The
    /// truth lies in files of its own. About 8.5 MB a sweep, two sweeps per second.
    Record(commands::record::Args),
    /// Replay a recorded flight, checking every file
    Replay(commands::replay::Args),
    /// The paper's figures and tables, ours beside the printed values
    Reproduce(commands::reproduce::Args),
    /// Solve the reflection point of each path of a paths file
    ///
    /// Every path leads to a line: a point, or the reason why there is none. Where the file knows the truth (order and
    /// last vertex), the summary compares with it.
    Solve(commands::solve::Args),
    /// Record what the receiver's front end would hear: int16 IQ of every transmit beam
    ///
    /// Every link of the paths file becomes a SigMF recording: 72 blocks of 32 channels x 512 samples, with noise, gain
    /// control, converter and the errors of both ends. The same seed gives the same bytes.
    Synth(commands::synth::Args),
    /// Trace rays: the paths of every transmitter with every receiver in a scene
    ///
    /// Line of sight and specular reflections, one link a line in the paths format, strongest path first, an empty list
    /// where nothing arrives. With --check, compares with a reference list instead.
    Trace(commands::trace::Args),
    /// Train a link-state network on data sets
    ///
    /// Draws measurement errors, computes the flight code's features, trains, and scales the probabilities on the
    /// validation sets. Writes a float model as safetensors, ready for quantisation, and the training curves. The same
    /// seed gives the same weights, bit for bit, for any number of threads. docs/link-state.md
    Train(commands::train::Args),
}

/// The disk is full, or the file may not grow.
const DISK_FULL: u8 = 3;

/// Runs the command line. Exit code 0 on success, 1 on an internal failure, 2 on bad input, 3 when the disk is full.
pub fn main() -> ExitCode {
    let cli = Cli::parse();
    if cli.quiet {
        progress::be_quiet();
    }
    match output::catching(|| run(cli.command)) {
        Ok(()) => ExitCode::SUCCESS,
        // Whoever reads the output has seen enough, as `head` does.
        Err(error) if failed(&error, &[ErrorKind::BrokenPipe]) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("cslam: {error:#}");
            if failed(&error, &FULL) {
                ExitCode::from(DISK_FULL)
            } else if error.downcast_ref::<InputError>().is_some() {
                ExitCode::from(2)
            } else {
                ExitCode::FAILURE
            }
        }
    }
}

fn run(command: Option<Command>) -> anyhow::Result<()> {
    match command {
        Some(Command::Accuracy(args)) => commands::accuracy::run(&args),
        Some(Command::Bench(args)) => commands::bench::run(&args),
        Some(Command::Campaign(args)) => commands::campaign::run(&args),
        Some(Command::Classify(args)) => commands::classify::run(&args),
        Some(Command::Completions(args)) => commands::completions::run(&args, Cli::command()),
        Some(Command::Config(args)) => commands::config::run(&args),
        Some(Command::Dataset(args)) => commands::dataset::run(&args),
        Some(Command::Estimate(args)) => commands::estimate::run(&args),
        #[cfg(feature = "ground")]
        Some(Command::Ground(args)) => commands::ground::run(&args),
        Some(Command::Imu(args)) => commands::imu::run(&args),
        Some(Command::Key(args)) => commands::key::run(&args),
        Some(Command::Man(args)) => commands::manual::run(&args, Cli::command()),
        Some(Command::Quantize(args)) => commands::quantize::run(&args),
        Some(Command::Record(args)) => commands::record::run(&args),
        Some(Command::Replay(args)) => commands::replay::run(&args),
        Some(Command::Reproduce(args)) => commands::reproduce::run(&args),
        Some(Command::Solve(args)) => commands::solve::run(&args),
        Some(Command::Synth(args)) => commands::synth::run(&args),
        Some(Command::Trace(args)) => commands::trace::run(&args),
        Some(Command::Train(args)) => commands::train::run(&args),
        Some(Command::Fly(args)) => commands::fly::run(&args),
        None => commands::fly::run(&commands::fly::Args::default()),
    }
}

/// What the system calls a full disk, a used-up quota and a file that may not grow.
const FULL: [ErrorKind; 3] = [
    ErrorKind::StorageFull,
    ErrorKind::QuotaExceeded,
    ErrorKind::FileTooLarge,
];

/// Whether one of these kinds lies at the bottom of an error, whatever it was wrapped in.
fn failed(error: &anyhow::Error, kinds: &[ErrorKind]) -> bool {
    error.chain().any(|cause| {
        let io = cause.downcast_ref::<std::io::Error>().map(std::io::Error::kind);
        // These keep the kind, not the error itself.
        let json = cause
            .downcast_ref::<serde_json::Error>()
            .and_then(serde_json::Error::io_error_kind);
        let input = cause.downcast_ref::<InputError>().and_then(InputError::kind);
        io.or(json).or(input).is_some_and(|kind| kinds.contains(&kind))
    })
}
