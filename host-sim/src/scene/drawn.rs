//! Materials for scenes that do not say of what their walls are.

use super::kinds::{FaceKind, Kinds};
use super::{Face, Material, Scene};
use crate::random::Stream;

/// Materials that are drawn, by name.
const BRICK: u16 = 0;
const CONCRETE: u16 = 1;
const GLASS: u16 = 2;
const METAL: u16 = 3;
const ASPHALT: u16 = 4;
const PLASTERBOARD: u16 = 5;
const WOOD: u16 = 6;
const NAMES: [&str; 7] = [
    "brick",
    "concrete",
    "glass",
    "metal",
    "asphalt",
    "plasterboard",
    "wood",
];

/// Share of buildings of brick, and of those of brick or concrete; the others have facades of glass.
const BRICK_SHARE: f64 = 0.4;
const MASONRY_SHARE: f64 = 0.8;

/// Seed of the draws: the same scene is of the same materials in every flight.
const SEED: u64 = 0;

impl Scene {
    /// Gives every face whose material nobody has said one of ITU-R P.2040, by the object that it belongs to.
    ///
    /// Outdoors: ground of asphalt, cars of metal, buildings of brick (40 %), concrete (40 %) or glass (20 %). Indoors, where an
    /// object is a room with its ceiling over it: floors of concrete, walls and ceilings of plasterboard, furniture of wood. Nobody
    /// has said the material of faces that have none of their own in a scene of the paper's material.
    #[must_use]
    pub fn with_drawn_materials(self) -> Self {
        if *self.material() != Material::PAPER {
            return self;
        }
        let drawn: Vec<Material> = NAMES
            .iter()
            .map(|name| Material::named(name).unwrap_or(Material::PAPER))
            .collect();
        let kinds = Kinds::of(self.faces());
        let own: Vec<Material> = self.materials()[1..].to_vec();
        let of_face: Vec<Option<u16>> = (0..self.faces().len() as u32)
            .map(|face| match self.material_of(face) {
                0 => Some(material(&kinds, &self.faces()[face as usize]) + own.len() as u16),
                place => Some(place as u16 - 1),
            })
            .collect();
        self.with_materials(&[own, drawn].concat(), &of_face)
    }
}

/// Place of a face's material among [`NAMES`].
fn material(kinds: &Kinds, face: &Face) -> u16 {
    match (kinds.indoors(), kinds.of_face(face)) {
        (true, FaceKind::Ground) => CONCRETE,
        (true, FaceKind::LowObject) => WOOD,
        (true, FaceKind::Wall | FaceKind::Roof) => PLASTERBOARD,
        (false, FaceKind::Ground) => ASPHALT,
        (false, FaceKind::LowObject) => METAL,
        (false, FaceKind::Wall | FaceKind::Roof) => {
            let share = Stream::new(SEED, u64::from(face.object())).uniform();
            if share < BRICK_SHARE {
                BRICK
            } else if share < MASONRY_SHARE {
                CONCRETE
            } else {
                GLASS
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// How many faces are of each of [`NAMES`].
    fn counts(scene: &Scene) -> [usize; NAMES.len()] {
        core::array::from_fn(|k| {
            let material = Material::named(NAMES[k]).expect("known");
            let is_of = |face: &u32| scene.materials()[scene.material_of(*face)] == material;
            (0..scene.faces().len() as u32).filter(is_of).count()
        })
    }

    #[test]
    fn outdoors_the_ground_is_asphalt_and_buildings_are_of_three_materials() {
        let scene = Scene::load("city:3").expect("generated").with_drawn_materials();
        let [brick, concrete, glass, metal, asphalt, plasterboard, wood] = counts(&scene);
        assert_eq!((asphalt, metal, plasterboard, wood), (1, 0, 0, 0));
        assert_eq!(brick + concrete + glass + asphalt, scene.faces().len());
        assert!(brick > 0 && concrete > 0 && glass > 0);
        let of_object = |object: u32| {
            let faces = (0u32..)
                .zip(scene.faces())
                .filter(|(_, face)| face.object() == object);
            faces
                .map(|(index, _)| scene.material_of(index))
                .collect::<Vec<_>>()
        };
        let building = of_object(5);
        assert!(
            building.len() > 3 && building.iter().all(|m| *m == building[0]),
            "{building:?}"
        );
    }

    #[test]
    fn vans_are_metal_and_rooms_are_plasterboard() {
        let [.., metal, _, _, _] = counts(&Scene::load("street").expect("built in").with_drawn_materials());
        // Eight boxes of five faces.
        assert_eq!(metal, 40);
        let office = Scene::load("indoor").expect("built in").with_drawn_materials();
        let [brick, concrete, glass, metal, asphalt, plasterboard, wood] = counts(&office);
        assert_eq!((brick, glass, metal, asphalt, concrete), (0, 0, 0, 0, 1));
        // Two boxes in each of six rooms.
        assert_eq!(wood, 60);
        assert_eq!(plasterboard, office.faces().len() - 61);
    }

    #[test]
    fn what_a_scene_says_stays() {
        let scene = Scene::load("city:3").expect("generated");
        let faces = scene.faces().len();
        let metal = Material::named("metal").expect("known");
        let mut of_face = vec![None; faces];
        of_face[7] = Some(0);
        let scene = scene.with_materials(&[metal], &of_face).with_drawn_materials();
        assert_eq!(scene.materials()[scene.material_of(7)], metal);
        assert_ne!(scene.materials()[scene.material_of(8)], Material::PAPER);
        let wooden = Scene::new(
            "wood",
            Material::named("wood").expect("known"),
            30e9,
            None,
            vec![super::super::RawFace {
                vertices: vec![[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0]],
                ..Default::default()
            }],
        );
        let wooden = wooden.expect("a scene").with_drawn_materials();
        assert_eq!(wooden.materials().len(), 1);
    }
}
