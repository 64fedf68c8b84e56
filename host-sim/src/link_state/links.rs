//! True links column by column: what a shard of a data set holds.
//!
//! A column is one `.npy` file. Paths of all links lie one after the other; `paths` says how many belong to each link.

use std::path::Path;

use crate::input::InputError;
use crate::npy;
use crate::tracer::TracedPath;

/// Most paths that a link keeps, the strongest ones: the paper's largest K.
pub const MOST_PATHS: usize = 15;

/// Gain of a path that no dipole hears, dB.
const NO_GAIN_DB: f64 = -300.0;

/// Links, column by column.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Links {
    /// Number of the link among all that the data set could have; its stream of random numbers.
    pub index: Vec<u64>,
    /// GMT positions, m.
    pub tx_m: Vec<[f32; 3]>,
    /// UAV positions, m.
    pub rx_m: Vec<[f32; 3]>,
    /// Relative permittivity of all faces while this link was traced.
    pub permittivity: Vec<f32>,
    /// Number of paths; 0 is an outage.
    pub paths: Vec<u8>,
    /// Way lengths, m.
    pub c_tau_m: Vec<f32>,
    /// Zenith and azimuth of arrival, rad.
    pub aoa_rad: Vec<[f32; 2]>,
    /// Zenith and azimuth of departure, rad.
    pub aod_rad: Vec<[f32; 2]>,
    /// Power gain with vertical half-wave dipoles, dB.
    pub gain_db: Vec<f32>,
    /// Number of reflections.
    pub order: Vec<u8>,
    /// Last interaction point, m; the GMT for a line of sight.
    pub last_vertex_m: Vec<[f32; 3]>,
    /// Where the paths of each link begin.
    begin: Vec<usize>,
}

/// One link of the columns.
#[derive(Clone, Copy, Debug)]
pub struct Link<'a> {
    /// Its number, see [`Links::index`].
    pub index: u64,
    /// GMT position, m.
    pub tx_m: [f32; 3],
    /// UAV position, m.
    pub rx_m: [f32; 3],
    links: &'a Links,
    begin: usize,
    count: usize,
}

/// One true path.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TruePath {
    /// Way length, m.
    pub c_tau_m: f32,
    /// Zenith and azimuth of arrival, rad.
    pub aoa_rad: [f32; 2],
    /// Zenith and azimuth of departure, rad.
    pub aod_rad: [f32; 2],
    /// Power gain, dB.
    pub gain_db: f32,
    /// Number of reflections.
    pub order: u8,
    /// Last interaction point, m.
    pub last_vertex_m: [f32; 3],
}

impl TruePath {
    /// Class of the path: 0 line of sight, 1 first order, 2 higher order.
    pub fn class(&self) -> u8 {
        self.order.min(2)
    }
}

impl<'a> Link<'a> {
    /// Paths, strongest first.
    pub fn paths(&self) -> impl Iterator<Item = TruePath> + use<'a> {
        let links = self.links;
        (self.begin..self.begin + self.count).map(|i| TruePath {
            c_tau_m: links.c_tau_m[i],
            aoa_rad: links.aoa_rad[i],
            aod_rad: links.aod_rad[i],
            gain_db: links.gain_db[i],
            order: links.order[i],
            last_vertex_m: links.last_vertex_m[i],
        })
    }
}

impl Links {
    /// Number of links.
    pub fn len(&self) -> usize {
        self.index.len()
    }

    /// Whether there is no link.
    pub fn is_empty(&self) -> bool {
        self.index.is_empty()
    }

    /// Number of links with at least one path.
    pub fn heard(&self) -> usize {
        self.paths.iter().filter(|n| **n > 0).count()
    }

    /// A link; `None` beyond the last.
    pub fn link(&self, i: usize) -> Option<Link<'_>> {
        Some(Link {
            index: *self.index.get(i)?,
            tx_m: self.tx_m[i],
            rx_m: self.rx_m[i],
            links: self,
            begin: self.begin[i],
            count: usize::from(self.paths[i]),
        })
    }

    /// All links.
    pub fn iter(&self) -> impl Iterator<Item = Link<'_>> {
        (0..self.len()).filter_map(|i| self.link(i))
    }

    /// Appends a traced link, its paths strongest first; keeps [`MOST_PATHS`] of them.
    pub fn push(
        &mut self,
        index: u64,
        tx_m: [f64; 3],
        rx_m: [f64; 3],
        permittivity: f64,
        paths: &[TracedPath],
    ) {
        let single = |p: [f64; 3]| p.map(|c| c as f32);
        let kept = &paths[..paths.len().min(MOST_PATHS)];
        self.begin.push(self.c_tau_m.len());
        self.index.push(index);
        self.tx_m.push(single(tx_m));
        self.rx_m.push(single(rx_m));
        self.permittivity.push(permittivity as f32);
        self.paths.push(kept.len() as u8);
        for path in kept {
            let [re, im] = path.gain();
            let gain_db = 10.0 * libm::log10(re * re + im * im);
            self.c_tau_m.push(path.length_m() as f32);
            self.aoa_rad.push(path.arrival_rad().map(|a| a as f32));
            self.aod_rad.push(path.departure_rad().map(|a| a as f32));
            self.gain_db.push(gain_db.max(NO_GAIN_DB) as f32);
            self.order.push(path.order() as u8);
            self.last_vertex_m
                .push(single(*path.vertices().last().unwrap_or(&tx_m)));
        }
    }

    /// Writes every column to a directory, which must exist.
    ///
    /// # Errors
    /// [`InputError`] naming the file that cannot be written.
    pub fn write(&self, directory: &Path) -> Result<(), InputError> {
        let write = |name: &str, bytes: Vec<u8>| {
            let file = directory.join(name);
            std::fs::write(&file, bytes).map_err(|e| InputError::unwritable(&file, "cannot be written", &e))
        };
        write("index.npy", npy::encode(&self.index, None))?;
        write("tx_m.npy", npy::encode(self.tx_m.as_flattened(), Some(3)))?;
        write("rx_m.npy", npy::encode(self.rx_m.as_flattened(), Some(3)))?;
        write("permittivity.npy", npy::encode(&self.permittivity, None))?;
        write("paths.npy", npy::encode(&self.paths, None))?;
        write("c_tau_m.npy", npy::encode(&self.c_tau_m, None))?;
        write("aoa_rad.npy", npy::encode(self.aoa_rad.as_flattened(), Some(2)))?;
        write("aod_rad.npy", npy::encode(self.aod_rad.as_flattened(), Some(2)))?;
        write("gain_db.npy", npy::encode(&self.gain_db, None))?;
        write("order.npy", npy::encode(&self.order, None))?;
        write(
            "last_vertex_m.npy",
            npy::encode(self.last_vertex_m.as_flattened(), Some(3)),
        )
    }

    /// Reads the columns of a directory.
    ///
    /// # Errors
    /// [`InputError`] naming the file and what was expected.
    pub fn read(directory: &Path) -> Result<Self, InputError> {
        let rows2 = |name: &str| -> Result<Vec<[f32; 2]>, InputError> {
            let flat: Vec<f32> = npy::read(&directory.join(name), Some(2))?;
            Ok(flat.chunks_exact(2).map(|c| [c[0], c[1]]).collect())
        };
        let rows3 = |name: &str| -> Result<Vec<[f32; 3]>, InputError> {
            let flat: Vec<f32> = npy::read(&directory.join(name), Some(3))?;
            Ok(flat.chunks_exact(3).map(|c| [c[0], c[1], c[2]]).collect())
        };
        let mut links = Self {
            index: npy::read(&directory.join("index.npy"), None)?,
            tx_m: rows3("tx_m.npy")?,
            rx_m: rows3("rx_m.npy")?,
            permittivity: npy::read(&directory.join("permittivity.npy"), None)?,
            paths: npy::read(&directory.join("paths.npy"), None)?,
            c_tau_m: npy::read(&directory.join("c_tau_m.npy"), None)?,
            aoa_rad: rows2("aoa_rad.npy")?,
            aod_rad: rows2("aod_rad.npy")?,
            gain_db: npy::read(&directory.join("gain_db.npy"), None)?,
            order: npy::read(&directory.join("order.npy"), None)?,
            last_vertex_m: rows3("last_vertex_m.npy")?,
            begin: Vec::new(),
        };
        let mut total = 0;
        for count in &links.paths {
            links.begin.push(total);
            total += usize::from(*count);
        }
        let (l, p) = (links.len(), total);
        for (name, length, expected) in [
            ("tx_m.npy", links.tx_m.len(), l),
            ("rx_m.npy", links.rx_m.len(), l),
            ("permittivity.npy", links.permittivity.len(), l),
            ("paths.npy", links.paths.len(), l),
            ("c_tau_m.npy", links.c_tau_m.len(), p),
            ("aoa_rad.npy", links.aoa_rad.len(), p),
            ("aod_rad.npy", links.aod_rad.len(), p),
            ("gain_db.npy", links.gain_db.len(), p),
            ("order.npy", links.order.len(), p),
            ("last_vertex_m.npy", links.last_vertex_m.len(), p),
        ] {
            if length != expected {
                let message =
                    format!("expected {expected} rows for {l} links with {p} paths, found {length}");
                return Err(InputError::in_file(&directory.join(name), message));
            }
        }
        Ok(links)
    }

    /// Appends all links of another set.
    pub fn append(&mut self, other: &Self) {
        let offset = self.c_tau_m.len();
        self.begin.extend(other.begin.iter().map(|b| b + offset));
        self.index.extend_from_slice(&other.index);
        self.tx_m.extend_from_slice(&other.tx_m);
        self.rx_m.extend_from_slice(&other.rx_m);
        self.permittivity.extend_from_slice(&other.permittivity);
        self.paths.extend_from_slice(&other.paths);
        self.c_tau_m.extend_from_slice(&other.c_tau_m);
        self.aoa_rad.extend_from_slice(&other.aoa_rad);
        self.aod_rad.extend_from_slice(&other.aod_rad);
        self.gain_db.extend_from_slice(&other.gain_db);
        self.order.extend_from_slice(&other.order);
        self.last_vertex_m.extend_from_slice(&other.last_vertex_m);
    }
}

/// Links for tests.
#[cfg(test)]
pub(in crate::link_state) mod tests {
    use super::*;
    use crate::scene::Scene;
    use crate::tracer::Tracer;

    /// A link over the reference scene with several paths.
    pub(in crate::link_state) fn one_link() -> Links {
        let scene = Scene::load("outdoor_a").expect("built in");
        let tracer = Tracer::new(&scene, 3).expect("order 3");
        let (tx_m, rx_m) = ([93.847903, 108.226018, 2.0], [108.871389, 75.565727, 19.035177]);
        let paths = tracer.transmitter(tx_m).trace(rx_m);
        assert!(paths.len() >= 2);
        let mut links = Links::default();
        links.push(7, tx_m, rx_m, 15.0, &paths);
        links
    }

    #[test]
    fn links_survive_their_directory() {
        let mut links = one_link();
        links.push(8, [1.0; 3], [2.0; 3], 3.5, &[]);
        let again = one_link();
        links.append(&again);
        let directory = tempfile::tempdir().expect("temporary");
        links.write(directory.path()).expect("written");
        let read = Links::read(directory.path()).expect("sound");
        assert_eq!(read, links);
        assert_eq!((read.len(), read.heard()), (3, 2));
        assert_eq!(read.link(1).expect("outage").paths().count(), 0);
        let last: Vec<TruePath> = read.link(2).expect("the second one").paths().collect();
        assert_eq!(last, again.link(0).expect("one").paths().collect::<Vec<_>>());
        assert!(last[0].gain_db > -100.0 && last[0].order == 0);
        std::fs::write(directory.path().join("order.npy"), npy::encode(&[1_u8], None)).expect("written");
        let error = Links::read(directory.path())
            .expect_err("short column")
            .to_string();
        assert!(
            error.contains("order.npy") && error.contains("expected"),
            "{error}"
        );
    }
}
