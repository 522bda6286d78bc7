//! Access to the numbers of a scene in memory, without its text.

use crate::{
    numeric::checksum::checksum,
    scene::{
        Scene,
        declaration::{Name, Numbers},
    },
};

impl Scene {
    /// Visit every number with its name, in the order of the fields.
    fn each_number<'a>(&'a mut self, mut visit: impl FnMut(Name<'_>, &'a mut f64)) {
        self.each(None, &mut visit);
    }

    /// The number of that dotted name, if the scene has one.
    pub(crate) fn number_mut(&mut self, dotted: &str) -> Option<&mut f64> {
        let mut found = None;
        self.each_number(|name, x| {
            if name.is(dotted) {
                found = Some(x);
            }
        });
        found
    }

    /// All numbers, in an order that is the same for all scenes of a `kind`.
    pub(crate) fn numbers(&mut self) -> Vec<f64> {
        let mut numbers = Vec::with_capacity(128);
        self.each_number(|_, x| numbers.push(*x));
        numbers
    }

    /// A copy with these `numbers`; where the list is shorter, the rest is unchanged.
    pub(crate) fn with_numbers(&self, numbers: &[f64]) -> Self {
        let (mut scene, mut numbers) = (self.clone(), numbers.iter());
        scene.each_number(|_, x| *x = numbers.next().copied().unwrap_or(*x));
        scene
    }

    /// Do only numbers of `randomise` differ from the scene's, each within its range there?
    pub(crate) fn may_draw(&self, numbers: &[f64]) -> bool {
        let (mut numbers, mut may) = (numbers.iter(), true);
        self.clone().each_number(|name, own| {
            let Some(x) = numbers.next() else { return };
            may &= own.to_bits() == x.to_bits() || {
                let range = self.randomise.get(&name.to_string());
                range.is_some_and(|[low, high]| (low..=high).contains(&x))
            };
        });
        may
    }

    /// Checksum of everything but the numbers.
    pub(crate) fn kind(&self) -> u64 {
        let mut plain = self.clone();
        plain.each_number(|_, x| *x = 0.0);
        checksum(plain.to_json().as_bytes())
    }
}

#[cfg(test)]
mod tests {
    use crate::scene::*;

    /// Scenes that together have all possible numbers.
    fn scenes() -> Vec<Scene> {
        let mut full = Scene::default();
        for effect in super::super::effects::EFFECTS {
            full = full.with(effect.name).unwrap_or(full);
        }
        for (i, name) in COORDINATES.iter().enumerate() {
            full.start.q.insert((*name).into(), 1e-3 * i as f64);
            full.start.v.insert((*name).into(), 1e-2 * i as f64);
        }
        let text = |accuracy: &str| serde_json::from_str(accuracy).expect("an accuracy");
        let accuracies = [
            Accuracy::Named(AccuracyName::Fast),
            Accuracy::Tolerance(1e-5),
            text(r#"{"method": "moreau", "step": 0.002}"#),
            text(r#"{"method": "rk4", "step": 0.001}"#),
            text(r#"{"method": "dop853", "step": 0.001}"#),
            text(r#"{"method": "dop853", "tolerance": 1e-7}"#),
            text(r#"{"method": "dopri5", "step": 0.001}"#),
            text(r#"{"method": "dopri5", "tolerance": 1e-7}"#),
            text(r#"{"method": "rosenbrock", "step": 0.001}"#),
            text(r#"{"method": "rosenbrock", "tolerance": 1e-4}"#),
        ];
        let with_accuracy = |accuracy| Scene {
            accuracy,
            ..full.clone()
        };
        let frictions = [
            Friction::Coulomb {
                mu: 0.3,
                capture_speed: 0.02,
            },
            Friction::Viscous { coefficient: 3.0 },
            Friction::None {},
        ];
        let with_friction = |friction| {
            let mut scene = full.clone();
            scene.ice.friction = friction;
            scene
        };
        let all = accuracies.into_iter().map(with_accuracy);
        all.chain(frictions.map(with_friction)).collect()
    }

    /// The visits give the same names and values as the text.
    #[test]
    fn numbers_are_those_of_the_text() {
        for mut scene in scenes() {
            let mut seen = Vec::new();
            scene.each_number(|name, x| seen.push((name.to_string(), *x)));
            let known = scene.parameters();
            let mut known: Vec<_> = known.into_iter().map(|p| (p.name, p.value)).collect();
            assert!(seen.len() > 70);
            let by_name = |a: &(String, f64), b: &(String, f64)| a.0.cmp(&b.0);
            seen.sort_by(by_name);
            known.sort_by(by_name);
            assert_eq!(seen, known);
        }
    }

    /// `number_mut` and `with_values` change the same number.
    #[test]
    fn a_number_set_is_the_one_of_that_name() {
        for scene in scenes() {
            for number in scene.parameters() {
                let x = number.value + 1e-9 * (number.range.high - number.range.low);
                let x = x.min(number.range.high);
                let mut own = scene.clone();
                *own.number_mut(&number.name).expect("known") = x;
                let table = scene.with_values([(number.name.as_str(), x)]);
                assert!(table.is_err() || table == Ok(own), "{}", number.name);
            }
            let mut scene = scene;
            for name in [
                "",
                "ice",
                "ice.",
                "ice.friction",
                ".ice",
                "start.q.q99",
                "name",
            ] {
                assert_eq!(scene.number_mut(name), None, "{name}");
            }
        }
    }

    #[test]
    fn scenes_of_a_kind_differ_in_their_numbers_alone() {
        let scenes = scenes();
        for (i, scene) in scenes.iter().enumerate() {
            let numbers = scene.clone().numbers();
            let doubled: Vec<_> = numbers.iter().map(|x| 2.0 * x).collect();
            let mut other = scene.with_numbers(&doubled);
            assert!(other != *scene && other.numbers() == doubled);
            assert_eq!(other.kind(), scene.kind());
            assert_eq!(other.with_numbers(&numbers), *scene);
            assert!(scenes[..i].iter().all(|known| known.kind() != scene.kind()));
            let mut renamed = scene.clone();
            renamed.contact.impacts ^= true;
            assert_ne!(renamed.kind(), scene.kind());
            renamed = scene.clone();
            renamed.randomise.insert("ice.gravity".into(), [9.0, 9.5]);
            assert_ne!(renamed.kind(), scene.kind());
        }
    }

    #[test]
    fn only_what_has_a_range_is_drawn() {
        let mut scene = Scene::default();
        let range = [9.0, 10.0];
        scene.randomise.insert("ice.gravity".into(), range);
        let with = |name: &str, x: f64| {
            let mut other = scene.clone();
            *other.number_mut(name).expect("known") = x;
            other.numbers()
        };
        assert!(scene.may_draw(&scene.clone().numbers()));
        assert!(
            [9.0, 9.5, 10.0]
                .iter()
                .all(|&x| scene.may_draw(&with("ice.gravity", x)))
        );
        for x in [8.999, 10.001, f64::NAN] {
            assert!(!scene.may_draw(&with("ice.gravity", x)), "{x}");
        }
        assert!(!scene.may_draw(&with("body.head.mass", 9.5)));
    }
}
