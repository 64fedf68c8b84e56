//! Links along a flight, one for each sweep: what `cslam fly --channel` flies, and the places for another ray tracer.

use std::io::Write;

use rayon::prelude::*;

use super::{Args, output};
use crate::flight::{FlightConfig, FlightPlan};
use crate::paths::Link;
use crate::progress;
use crate::tracer::Tracer;

/// Traces the flight of `seed`, which is planned as the default one of `cslam fly`.
pub(super) fn trace(tracer: &Tracer<'_>, args: &Args, seed: u64) -> anyhow::Result<()> {
    let mut config = FlightConfig::default();
    config.duration_s = args.duration.unwrap_or(config.duration_s);
    let scene = tracer.scene();
    let plan = FlightPlan::plan(scene.own(), &config, seed)?.placed(&scene.placement());
    let bar = progress::bar(u64::from(plan.sweeps()), "trace");
    let lines = (0..plan.sweeps())
        .into_par_iter()
        .map(|sweep| {
            let line = serde_json::to_string(&link(tracer, &plan, sweep));
            bar.inc(1);
            line
        })
        .collect::<Result<Vec<_>, _>>()?;
    bar.finish_and_clear();
    let mut out = output(args)?;
    for line in lines {
        writeln!(out, "{line}")?;
    }
    out.flush()?;
    Ok(())
}

fn link(tracer: &Tracer<'_>, plan: &FlightPlan, sweep: u32) -> Link {
    let time_s = plan.schedule().sweep_time_s(sweep);
    let motion = plan.uav().at(time_s);
    let tree = tracer.transmitter(plan.gmt().at(time_s).0.into());
    let rx_m = motion.position_m.into();
    Link {
        time_s: Some(time_s),
        uav_quaternion_wb: Some(motion.quaternion_wb()),
        ..tree.to_link(rx_m, &tree.trace(rx_m))
    }
}
