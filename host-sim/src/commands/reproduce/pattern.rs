//! `cslam reproduce pattern`: the beam patterns of the arrays at both ends, and what squint makes of a beam.

use std::io::Write;
use std::path::PathBuf;

use cslam_core::array::{Codebook, GmtArrays, SquintConfig, SquintScheme, SquintSymbol, UavArrays};
use cslam_core::geometry::{Body, Direction, Gmt};
use cslam_core::signal::Waveform;
use serde::Serialize;

use super::lines::{Curve, Panel, svg, write};
use crate::table::Table;

/// Arguments of `cslam reproduce pattern`.
#[derive(clap::Args, Debug)]
pub(crate) struct Args {
    /// File for the plot (.svg)
    #[arg(long, value_name = "FILE", default_value = "out/pattern.svg")]
    out: PathBuf,
    /// Print one JSON object a row on standard output instead of the tables
    #[arg(long)]
    json: bool,
}

/// Steps of all cuts, deg: an eightieth of the narrowest beam.
const STEP_DEG: f64 = 0.1;
/// Elevations at which the best beam is looked up, deg.
const COVERED_DEG: [f64; 5] = [-10.0, 0.0, 12.0, 25.0, 40.0];
/// Least gain that is drawn, dBi.
const FLOOR_DBI: f64 = -20.0;

/// A transmit beam of the codebook.
#[derive(Serialize)]
struct BeamRow {
    table: &'static str,
    beam: usize,
    azimuth_deg: f64,
    elevation_deg: f64,
    /// Gain where it looks.
    gain_dbi: f64,
    /// Where it is half as strong as at its peak, from side to side.
    width_azimuth_deg: f64,
    width_elevation_deg: f64,
    /// Highest lobe beside the main one in the azimuth cut, under the peak.
    sidelobe_db: f64,
}

/// The best of several beams or arrays over all azimuths.
#[derive(Serialize)]
struct CoverRow {
    table: &'static str,
    what: String,
    elevation_deg: f64,
    least_dbi: f64,
    mean_dbi: f64,
    most_dbi: f64,
}

/// Where a subcarrier of a squint symbol looks.
#[derive(Serialize)]
struct SquintRow {
    table: &'static str,
    subcarrier: i64,
    offset_mhz: f64,
    aim_cosine: f64,
    azimuth_deg: f64,
    /// Half-power width along the row, direction cosine.
    width_cosine: f64,
}

fn db(power: f64) -> f64 {
    10.0 * libm::log10(power.max(1e-12))
}

fn gmt(azimuth_deg: f64, elevation_deg: f64) -> Direction<Gmt, f64> {
    let zenith = (90.0 - elevation_deg).to_radians();
    Direction::from_zenith_azimuth(zenith, azimuth_deg.to_radians()).expect("finite angles")
}

fn body(azimuth_deg: f64, elevation_deg: f64) -> Direction<Body, f64> {
    let zenith = (90.0 - elevation_deg).to_radians();
    Direction::from_zenith_azimuth(zenith, azimuth_deg.to_radians()).expect("finite angles")
}

/// Values of a cut from `first` to `last`, deg.
fn cut(first: f64, last: f64, value: impl Fn(f64) -> f64) -> Vec<(f64, f64)> {
    let steps = ((last - first) / STEP_DEG).round() as usize;
    let at = |i: usize| first + STEP_DEG * i as f64;
    (0..=steps).map(|i| (at(i), value(at(i)))).collect()
}

/// From side to side of the main lobe, where a cut in dB falls 3.01 dB under its peak, and the highest lobe beside the first
/// minima, dB under the peak.
fn lobe(cut: &[(f64, f64)]) -> (f64, f64) {
    let Some((top, peak)) = cut.iter().enumerate().max_by(|a, b| a.1.1.total_cmp(&b.1.1)) else {
        return (0.0, f64::INFINITY);
    };
    let (peak_db, half_db) = (peak.1, peak.1 - db(2.0));
    let strong = |point: &&(f64, f64)| point.1 >= half_db;
    let above = cut[top..].iter().take_while(strong).count();
    let below = cut[..=top].iter().rev().take_while(strong).count();
    let falls = |pair: &[(f64, f64)]| pair[1].1 <= pair[0].1;
    let right = top + cut[top..].windows(2).take_while(|pair| falls(pair)).count();
    let rises = |pair: &[(f64, f64)]| pair[1].1 >= pair[0].1;
    let left = top
        - cut[..=top]
            .windows(2)
            .rev()
            .take_while(|pair| rises(pair))
            .count();
    let beside = cut[..left].iter().chain(&cut[right + 1..]).map(|point| point.1);
    let step = if cut.len() > 1 { cut[1].0 - cut[0].0 } else { 0.0 };
    let width = (above + below - 1) as f64 * step;
    (width, peak_db - beside.fold(f64::NEG_INFINITY, f64::max))
}

/// Gain of a beam with the array's error-free elements, dBi.
fn gain_dbi(codebook: &Codebook<f64>, beam: usize, azimuth_deg: f64, elevation_deg: f64) -> f64 {
    db(codebook.field(beam, &gmt(azimuth_deg, elevation_deg)).norm_sqr())
}

/// The beams of the first face that look to one side of its normal; the others mirror them.
fn beams(codebook: &Codebook<f64>) -> Vec<BeamRow> {
    let of_face = (0..codebook.len()).filter_map(|index| Some((index, codebook.beam(index)?)));
    of_face
        .filter(|(_, beam)| beam.face == 0 && beam.azimuth_rad > 0.0)
        .map(|(index, beam)| {
            let [azimuth_deg, elevation_deg] = [beam.azimuth_rad, beam.elevation_rad].map(f64::to_degrees);
            let across = cut(-180.0, 180.0, |az| gain_dbi(codebook, index, az, elevation_deg));
            let up = cut(-89.0, 89.0, |el| gain_dbi(codebook, index, azimuth_deg, el));
            let (width_azimuth_deg, sidelobe_db) = lobe(&across);
            BeamRow {
                table: "transmit beam",
                beam: index,
                azimuth_deg,
                elevation_deg,
                gain_dbi: gain_dbi(codebook, index, azimuth_deg, elevation_deg),
                width_azimuth_deg,
                width_elevation_deg: lobe(&up).0,
                sidelobe_db,
            }
        })
        .collect()
}

/// Directivity of each UAV array towards a direction, as the paper's |v^(j)|^2: eight elements in phase.
fn array_gains(arrays: &UavArrays<f64>, u: &Direction<Body, f64>) -> [f64; 4] {
    arrays.amplitude(u).map(|amplitude| 8.0 * amplitude * amplitude)
}

fn cover(what: &str, elevation_deg: f64, gain_dbi: impl Fn(f64) -> f64) -> CoverRow {
    let gains: Vec<f64> = cut(-180.0, 180.0, gain_dbi).into_iter().map(|(_, g)| g).collect();
    CoverRow {
        table: "coverage",
        what: what.into(),
        elevation_deg,
        least_dbi: gains.iter().copied().fold(f64::INFINITY, f64::min),
        mean_dbi: gains.iter().sum::<f64>() / gains.len() as f64,
        most_dbi: gains.iter().copied().fold(f64::NEG_INFINITY, f64::max),
    }
}

fn best_beam_dbi(codebook: &Codebook<f64>, azimuth_deg: f64, elevation_deg: f64) -> f64 {
    (0..codebook.len())
        .map(|beam| gain_dbi(codebook, beam, azimuth_deg, elevation_deg))
        .fold(f64::NEG_INFINITY, f64::max)
}

fn coverage(codebook: &Codebook<f64>, arrays: &UavArrays<f64>) -> Vec<CoverRow> {
    let best = |gains: [f64; 4]| db(gains.into_iter().fold(0.0, f64::max));
    let of_gmt = COVERED_DEG.map(|el| {
        cover("best of 72 transmit beams", el, |az| {
            best_beam_dbi(codebook, az, el)
        })
    });
    let of_uav = COVERED_DEG.map(|el| {
        cover("best of 4 UAV arrays", el, |az| {
            best(array_gains(arrays, &body(az, el)))
        })
    });
    of_gmt.into_iter().chain(of_uav).collect()
}

/// The first azimuth sweep of the first face, and the offsets of some of its subcarriers from the carrier, GHz.
fn squint(waveform: &Waveform) -> (SquintSymbol<f64>, Vec<(i64, f64)>, f64) {
    let offset_hz = |index: usize| f64::from(waveform.offset(index)) * waveform.spacing_hz();
    let last = waveform.active - 1;
    let band_hz = [offset_hz(0), offset_hz(last)];
    let symbol = SquintConfig::default().symbol(SquintScheme::Sequential, 0, 3, band_hz, waveform.carrier_hz);
    let chosen = (0..=4).map(|quarter| quarter * last / 4);
    let offsets = chosen.map(|index| (i64::from(waveform.offset(index)), offset_hz(index) * 1e-9));
    (
        symbol.expect("the first symbol"),
        offsets.collect(),
        waveform.carrier_hz * 1e-9,
    )
}

/// Array gain of a squint symbol along the row, at the elevation cosine at which it looks, dB.
fn squint_cut(symbol: &SquintSymbol<f64>, offset_ghz: f64, carrier_ghz: f64) -> Vec<(f64, f64)> {
    let rise = symbol.aim(offset_ghz, carrier_ghz)[1];
    (-1000..=1000)
        .map(|i| {
            let cosine = f64::from(i) * 1e-3;
            let response = symbol.response::<8, 8>([cosine, rise], offset_ghz, carrier_ghz);
            (cosine, db(response.norm_sqr()))
        })
        .collect()
}

fn squints(waveform: &Waveform) -> Vec<SquintRow> {
    let (symbol, offsets, carrier_ghz) = squint(waveform);
    offsets
        .into_iter()
        .map(|(subcarrier, offset_ghz)| {
            let [aim_cosine, rise] = symbol.aim(offset_ghz, carrier_ghz);
            let level = (1.0 - rise * rise).sqrt();
            SquintRow {
                table: "squint",
                subcarrier,
                offset_mhz: 1e3 * offset_ghz,
                aim_cosine,
                azimuth_deg: libm::asin((aim_cosine / level).clamp(-1.0, 1.0)).to_degrees(),
                width_cosine: lobe(&squint_cut(&symbol, offset_ghz, carrier_ghz)).0,
            }
        })
        .collect()
}

fn panels(codebook: &Codebook<f64>, arrays: &UavArrays<f64>, waveform: &Waveform) -> Vec<Panel> {
    let curve = |name: String, points| Curve { name, points };
    let azimuths = (0..8).filter_map(|k| Some((3 * k, codebook.beam(3 * k)?)));
    let across = azimuths.map(|(index, beam)| {
        let name = format!("{:.1} deg", beam.azimuth_rad.to_degrees());
        curve(name, cut(-90.0, 90.0, |az| gain_dbi(codebook, index, az, 0.0)))
    });
    let up = (12..15)
        .filter_map(|index| Some((index, codebook.beam(index)?)))
        .map(|(index, beam)| {
            let name = format!("elevation {:.0} deg", beam.elevation_rad.to_degrees());
            let azimuth_deg = beam.azimuth_rad.to_degrees();
            curve(
                name,
                cut(-60.0, 80.0, |el| gain_dbi(codebook, index, azimuth_deg, el)),
            )
        });
    let heard = (0..4).map(|array: usize| {
        let gain = |az| db(array_gains(arrays, &body(az, 0.0))[array]);
        curve(format!("array {}", array + 1), cut(-180.0, 180.0, gain))
    });
    let (symbol, offsets, carrier_ghz) = squint(waveform);
    let squinted = offsets.iter().map(|(_, offset_ghz)| {
        let name = format!("{:+.0} MHz", 1e3 * offset_ghz);
        curve(name, squint_cut(&symbol, *offset_ghz, carrier_ghz))
    });
    let panel = |x: &str, y: &str, top, curves| Panel {
        axes: [x.into(), y.into()],
        range: [FLOOR_DBI, top],
        curves,
    };
    vec![
        panel(
            "GMT, face 1: azimuth at elevation 0, deg",
            "gain dBi",
            25.0,
            across.collect(),
        ),
        panel(
            "GMT, face 1: elevation at the beams' azimuth, deg",
            "gain dBi",
            25.0,
            up.collect(),
        ),
        panel(
            "UAV: azimuth at elevation 0, deg",
            "directivity dBi",
            20.0,
            heard.collect(),
        ),
        panel(
            "beam squint: direction cosine along the row",
            "array gain dB",
            20.0,
            squinted.collect(),
        ),
    ]
}

pub(crate) fn run(args: &Args) -> anyhow::Result<()> {
    let codebook = Codebook::<f64>::new(GmtArrays::default(), Default::default());
    let (arrays, waveform) = (UavArrays::<f64>::default(), Waveform::default());
    let drawing = svg("beam patterns", &panels(&codebook, &arrays, &waveform))?;
    write(&args.out, &drawing)?;
    let (beams, covers, squints) = (beams(&codebook), coverage(&codebook, &arrays), squints(&waveform));
    let mut out = std::io::stdout().lock();
    if args.json {
        for row in &beams {
            writeln!(out, "{}", serde_json::to_string(row)?)?;
        }
        for row in &covers {
            writeln!(out, "{}", serde_json::to_string(row)?)?;
        }
        for row in &squints {
            writeln!(out, "{}", serde_json::to_string(row)?)?;
        }
        return Ok(());
    }
    let mut table = Table::new([
        "transmit beam",
        "azimuth deg",
        "elevation deg",
        "gain dBi",
        "width az deg",
        "el deg",
        "sidelobe dB",
    ]);
    for row in &beams {
        table.row([
            row.beam.to_string(),
            format!("{:.1}", row.azimuth_deg),
            format!("{:.0}", row.elevation_deg),
            format!("{:.2}", row.gain_dbi),
            format!("{:.1}", row.width_azimuth_deg),
            format!("{:.1}", row.width_elevation_deg),
            format!("{:.1}", row.sidelobe_db),
        ]);
    }
    writeln!(out, "{table}")?;
    let mut table = Table::new(["over all azimuths, dBi", "elevation deg", "least", "mean", "most"]);
    for row in &covers {
        let gains = [row.least_dbi, row.mean_dbi, row.most_dbi].map(|gain| format!("{gain:.1}"));
        let mut cells = vec![row.what.clone(), format!("{:.0}", row.elevation_deg)];
        cells.extend(gains);
        table.row(cells);
    }
    writeln!(out, "{table}")?;
    let mut table = Table::new([
        "squint, subcarrier",
        "offset MHz",
        "direction cosine",
        "azimuth deg",
        "width",
    ]);
    for row in &squints {
        table.row([
            row.subcarrier.to_string(),
            format!("{:+.2}", row.offset_mhz),
            format!("{:+.3}", row.aim_cosine),
            format!("{:+.1}", row.azimuth_deg),
            format!("{:.3}", row.width_cosine),
        ]);
    }
    writeln!(out, "{table}plot: {}", args.out.display())?;
    Ok(())
}

#[cfg(test)]
mod tests;
