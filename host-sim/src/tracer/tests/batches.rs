//! Many links at once: the same bytes for any threads and batches, in order, up to the first error.

use super::*;

#[test]
fn neither_threads_nor_batches_change_a_byte() {
    let (scene, list) = reference("outdoor_a");
    let tracer = Tracer::new(&scene, 3).unwrap();
    let mut transmitters: Vec<[f64; 3]> = list.iter().map(|l| l.tx).collect();
    transmitters.dedup();
    let receivers: Vec<[f64; 3]> = list[..200].iter().map(|l| l.rx).collect();
    let lines = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        let mut lines = Vec::new();
        pool.install(|| {
            let line = |tree: &ImageTree<'_>, rx_m: [f64; 3], paths: Vec<TracedPath>| {
                serde_json::to_string(&tree.to_link(rx_m, &paths)).unwrap()
            };
            for_each_link(&tracer, &transmitters, &receivers, line, |line| {
                lines.push(line);
                Ok::<(), ()>(())
            })
        })
        .unwrap();
        lines
    };
    let one = lines(1);
    assert_eq!(one.len(), transmitters.len() * receivers.len());
    assert_eq!(one, lines(2));
    // A tracer of its own for a single link, made after nothing else.
    for link in [0, 123, 456, 999] {
        let alone = Tracer::new(&scene, 3).unwrap();
        let tree = alone.transmitter(transmitters[link / 200]);
        let rx_m = receivers[link % 200];
        assert_eq!(
            one[link],
            serde_json::to_string(&tree.to_link(rx_m, &tree.trace(rx_m))).unwrap()
        );
    }
}

#[test]
fn every_batch_is_traced_in_order() {
    let scene = canyon();
    let tracer = Tracer::new(&scene, 0).unwrap();
    let transmitters: Vec<[f64; 3]> = (0..40).map(|i| [f64::from(i), 1.0, 0.0]).collect();
    let receivers: Vec<[f64; 3]> = (0..3000).map(|i| [0.1 * f64::from(i), 5.0, 0.0]).collect();
    let mut seen = Vec::new();
    let ends = |tree: &ImageTree<'_>, rx_m: [f64; 3], _| (tree.transmitter_m(), rx_m);
    for_each_link(&tracer, &transmitters, &receivers, ends, |ends| {
        seen.push(ends);
        Ok::<(), ()>(())
    })
    .unwrap();
    let all = transmitters
        .iter()
        .flat_map(|tx| receivers.iter().map(|rx| (*tx, *rx)));
    assert!(all.eq(seen), "some are missing or out of order");
}

#[test]
fn the_first_error_of_the_sink_ends_the_work() {
    let scene = canyon();
    let tracer = Tracer::new(&scene, 1).unwrap();
    let receivers: Vec<[f64; 3]> = (0..10).map(|i| [f64::from(i), 5.0, 0.0]).collect();
    let mut taken = 0;
    let result = for_each_link(
        &tracer,
        &[[0.5, 1.0, 0.0]],
        &receivers,
        |_, rx_m, _| rx_m,
        |rx_m| {
            taken += 1;
            if rx_m[0] == 3.0 { Err("full") } else { Ok(()) }
        },
    );
    assert_eq!((result, taken), (Err("full"), 4));
}
