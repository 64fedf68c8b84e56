//! What a wave meets on its way, as the paths format names it: `LOS`, `R`, `RR`, `D`, `RD`, `S`, `M`, `TT`.

use std::fmt;

use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// One interaction of a wave with the world.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Interaction {
    /// Specular reflection off a face.
    Reflection,
    /// Diffraction at an edge.
    Diffraction,
    /// Diffuse scattering off a piece of a face.
    Scattering,
    /// Specular reflection off something that is not of the scene: a car or a person.
    Mover,
    /// Straight through a thin sheet: no point of the path, and none of its order.
    Transmission,
}

impl Interaction {
    const fn letter(self) -> char {
        match self {
            Self::Reflection => 'R',
            Self::Diffraction => 'D',
            Self::Scattering => 'S',
            Self::Mover => 'M',
            Self::Transmission => 'T',
        }
    }
}

/// Most interactions that a path of the format has.
const MOST: usize = 8;

/// Name of a path without interaction.
const LINE_OF_SIGHT: &str = "LOS";

/// The interactions of a path in the order of travel. None is line of sight.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Kind {
    interactions: [Interaction; MOST],
    count: u8,
}

impl Kind {
    /// The kind of these interactions; `None` for more than eight.
    pub fn of(interactions: &[Interaction]) -> Option<Self> {
        let mut all = [Interaction::Reflection; MOST];
        all.get_mut(..interactions.len())?.copy_from_slice(interactions);
        Some(Self {
            interactions: all,
            count: interactions.len() as u8,
        })
    }

    /// So many reflections, at most eight; 0 is line of sight.
    #[must_use]
    pub const fn reflections(count: usize) -> Self {
        Self {
            interactions: [Interaction::Reflection; MOST],
            count: if count < MOST { count as u8 } else { MOST as u8 },
        }
    }

    /// The interactions, in the order of travel.
    pub fn interactions(&self) -> &[Interaction] {
        &self.interactions[..usize::from(self.count)]
    }

    /// Number of interactions that turn the wave.
    pub fn order(&self) -> usize {
        self.turns().count()
    }

    fn turns(&self) -> impl Iterator<Item = &Interaction> {
        self.interactions()
            .iter()
            .filter(|met| **met != Interaction::Transmission)
    }

    /// Place of the edge among the interactions that turn the wave, if there is one.
    pub fn edge(&self) -> Option<usize> {
        self.turns().position(|i| *i == Interaction::Diffraction)
    }

    /// Whether the path is line of sight or reflected specularly alone.
    pub fn is_specular(&self) -> bool {
        self.interactions().iter().all(|i| *i == Interaction::Reflection)
    }
}

impl fmt::Display for Kind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.count == 0 {
            return f.write_str(LINE_OF_SIGHT);
        }
        self.interactions()
            .iter()
            .try_for_each(|i| write!(f, "{}", i.letter()))
    }
}

impl Serialize for Kind {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

impl<'de> Deserialize<'de> for Kind {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let text = std::borrow::Cow::<'_, str>::deserialize(deserializer)?;
        let wrong = || {
            serde::de::Error::custom(format!(
                "`kind` is \"{text}\", expected \"LOS\", or one to {MOST} of the letters R, D, S, M and T"
            ))
        };
        if text == LINE_OF_SIGHT {
            return Ok(Self::reflections(0));
        }
        let all = [
            Interaction::Reflection,
            Interaction::Diffraction,
            Interaction::Scattering,
            Interaction::Mover,
            Interaction::Transmission,
        ];
        let interactions: Option<Vec<Interaction>> = text
            .chars()
            .take(MOST + 1)
            .map(|letter| all.into_iter().find(|i| i.letter() == letter))
            .collect();
        let kind = interactions.as_deref().and_then(Self::of);
        kind.filter(|kind| kind.count > 0).ok_or_else(wrong)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_read_as_they_are_written() {
        for name in [
            "LOS", "R", "RRR", "D", "RD", "DR", "RDR", "S", "SR", "M", "RM", "T", "TTR", "RRRRRRRR",
        ] {
            let text = format!("\"{name}\"");
            let kind: Kind = serde_json::from_str(&text).expect(name);
            assert_eq!(serde_json::to_string(&kind).expect(name), text);
            assert_eq!(kind.edge(), name.find('D'));
            assert_eq!(
                kind.is_specular(),
                !name.contains('D') && (name == "LOS" || !name.contains(['S', 'M', 'T']))
            );
        }
        let kind: Kind = serde_json::from_str("\"TRTD\"").expect("a kind");
        assert_eq!((kind.order(), kind.edge()), (2, Some(1)));
        assert_eq!(Kind::reflections(3).to_string(), "RRR");
        for name in ["", "los", "X", "RRRRRRRRR", "R D"] {
            let error = serde_json::from_str::<Kind>(&format!("\"{name}\"")).expect_err(name);
            assert!(
                error.to_string().contains("expected \"LOS\", or one to 8"),
                "{error}"
            );
        }
    }
}
