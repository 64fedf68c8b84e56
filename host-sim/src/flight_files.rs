//! What a flight leaves on disk: the map, the truth beside it, the packets and the report.

use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::Path;

use anyhow::Context;
use cslam_core::map::PointCloud;

use crate::paths::Link;
use crate::ply::{self, Column, Encoding};
use crate::report::Report;

/// Writes `map.ply`, `map_truth.ply`, `packets.bin` and `report.json` into `out`.
///
/// # Errors
/// When a file cannot be written, naming it.
pub fn write<const N: usize>(
    out: &Path,
    map: &PointCloud<N>,
    packets: &[u8],
    flown: &[Link],
    report: &Report<'_>,
) -> anyhow::Result<()> {
    let write = |name: &str, content: &dyn Fn(&mut BufWriter<File>) -> std::io::Result<()>| {
        let file = out.join(name);
        let result = File::create(&file).and_then(|f| {
            let mut writer = BufWriter::new(f);
            content(&mut writer)?;
            writer.flush()
        });
        result.with_context(|| format!("{} cannot be written", file.display()))
    };
    let cloud: Vec<_> = map.points().collect();
    let coordinate = |i: usize| Column::F32(cloud.iter().map(|p| p.position.to_array()[i]).collect());
    let columns = [
        ("x", coordinate(0)),
        ("y", coordinate(1)),
        ("z", coordinate(2)),
        (
            "covariance_trace",
            Column::F32(cloud.iter().map(|p| p.variance_m2).collect()),
        ),
        (
            "hits",
            Column::U32(cloud.iter().map(|p| u32::from(p.hits)).collect()),
        ),
    ];
    write("map.ply", &|f| {
        ply::write(f, Encoding::Ascii, "cslam map, world frame ENU, metres", &columns)
    })?;

    let truth: Vec<[f64; 3]> = flown
        .iter()
        .flat_map(|l| &l.paths)
        .filter(|p| p.order == Some(1))
        .filter_map(|p| p.last_vertex)
        .collect();
    let coordinate = |i: usize| Column::F32(truth.iter().map(|p| p[i] as f32).collect());
    let columns = [("x", coordinate(0)), ("y", coordinate(1)), ("z", coordinate(2))];
    let comment = "true first-order reflection points, world frame ENU, metres";
    write("map_truth.ply", &|f| {
        ply::write(f, Encoding::Ascii, comment, &columns)
    })?;
    write("packets.bin", &|f| f.write_all(packets))?;
    write("report.json", &|f| {
        serde_json::to_writer_pretty(&mut *f, report)?;
        writeln!(f)
    })
}
