//! The numbers of a scene where they lie, without a text in between.

use crate::{
    integrate::{Control as Length, ErrorControl, Fixed, Method},
    numeric::checksum::checksum,
    scene::{
        Accuracy, ArmSwing, Contact, Control, Fall, Feedforward, Friction, HeadDamping, Ice,
        KneeStop, Lifting, ProportionalDerivative, Scene, Stabilizers, Start, TimeStepping,
        body::{Bar, Body, Foot, Link},
        ranges::join,
    },
};

/// A number's dotted name, as `Scene::parameters` has it: what stands before the last dot, and after it.
type Name<'a> = (&'a str, &'a str);

/// Visits every number of a scene, in an order that depends on nothing else. All fields are named, so that
/// none that comes is forgotten.
macro_rules! visitor {
    ($function:ident $(, $mut:ident)?) => {
        fn $function<'a>(&'a $($mut)? self, mut visit: impl FnMut(Name<'a>, &'a $($mut)? f64)) {
            let Self {
                name: _, description: _, provenance: _, energy_balance: _, locked: _, randomise: _,
                accuracy, body, ice, contact, control, stabilizers, fall, start,
            } = self;
            match accuracy {
                Accuracy::Named(_) => {}
                Accuracy::Tolerance(x) => visit(("", "accuracy"), x),
                Accuracy::TimeStepping(TimeStepping::Moreau { step })
                | Accuracy::Method(
                    Method::Dopri5(Length::Fixed(Fixed { step }))
                    | Method::Rosenbrock(Length::Fixed(Fixed { step }))
                    | Method::Rk4(Fixed { step }),
                ) => visit(("accuracy", "step"), step),
                Accuracy::Method(
                    Method::Dopri5(Length::Error(ErrorControl { tolerance }))
                    | Method::Rosenbrock(Length::Error(ErrorControl { tolerance })),
                ) => visit(("accuracy", "tolerance"), tolerance),
            }
            let Body {
                joint_damping: _, head, upper_body, middle_body, lower_body, upper_arm, lower_arm, hand,
                waist, upper_leg, lower_leg, foot, shoulder,
            } = body;
            for (table, link) in [
                ("body.head", head),
                ("body.upper_body", upper_body),
                ("body.middle_body", middle_body),
                ("body.lower_body", lower_body),
                ("body.upper_arm", upper_arm),
                ("body.lower_arm", lower_arm),
                ("body.hand", hand),
                ("body.upper_leg", upper_leg),
                ("body.lower_leg", lower_leg),
            ] {
                let Link { length, mass, damping, radius } = link;
                visit((table, "length"), length);
                visit((table, "mass"), mass);
                visit((table, "damping"), damping);
                visit((table, "radius"), radius);
            }
            let Bar { length, mass, radius } = waist;
            visit(("body.waist", "length"), length);
            visit(("body.waist", "mass"), mass);
            visit(("body.waist", "radius"), radius);
            let Foot { height, mass, damping, toe, heel, width } = foot;
            visit(("body.foot", "height"), height);
            visit(("body.foot", "mass"), mass);
            visit(("body.foot", "damping"), damping);
            visit(("body.foot", "toe"), toe);
            visit(("body.foot", "heel"), heel);
            visit(("body.foot", "width"), width);
            visit(("body", "shoulder"), shoulder);
            let Ice { gravity, friction } = ice;
            visit(("ice", "gravity"), gravity);
            match friction {
                Friction::Sticking {} | Friction::None {} => {}
                Friction::Directional { mu_forward, mu_backward, capture_speed } => {
                    visit(("ice.friction", "mu_forward"), mu_forward);
                    visit(("ice.friction", "mu_backward"), mu_backward);
                    visit(("ice.friction", "capture_speed"), capture_speed);
                }
                Friction::Coulomb { mu, capture_speed } => {
                    visit(("ice.friction", "mu"), mu);
                    visit(("ice.friction", "capture_speed"), capture_speed);
                }
                Friction::Viscous { coefficient } => {
                    visit(("ice.friction", "coefficient"), coefficient);
                }
            }
            let Contact {
                law: _, foot_rotation: _, free_foot: _, toe_contact: _, impacts: _, pulled_friction: _,
                point_contact_holds: _, edge_damping,
            } = contact;
            visit(("contact", "edge_damping"), edge_damping);
            let Control { sample_period, action_period, lifting, feedforward, arm_swing } = control;
            visit(("control", "sample_period"), sample_period);
            visit(("control", "action_period"), action_period);
            if let Some(Lifting { K_p: [x, y, z], ahead, height }) = lifting {
                visit(("control.lifting.K_p", "0"), x);
                visit(("control.lifting.K_p", "1"), y);
                visit(("control.lifting.K_p", "2"), z);
                visit(("control.lifting", "ahead"), ahead);
                visit(("control.lifting", "height"), height);
            }
            if let Some(Feedforward { scale, tau7_scale }) = feedforward {
                visit(("control.feedforward", "scale"), scale);
                visit(("control.feedforward", "tau7_scale"), tau7_scale);
            }
            if let Some(ArmSwing { amplitude }) = arm_swing {
                visit(("control.arm_swing", "amplitude"), amplitude);
            }
            let Stabilizers { head_damping, hip_pd, free_knee_pd, knee_stop } = stabilizers;
            if let Some(HeadDamping { y, z }) = head_damping {
                visit(("stabilizers.head_damping", "y"), y);
                visit(("stabilizers.head_damping", "z"), z);
            }
            for (table, pd) in [("stabilizers.hip_pd", hip_pd), ("stabilizers.free_knee_pd", free_knee_pd)] {
                if let Some(ProportionalDerivative { gain, reference, damping }) = pd {
                    visit((table, "gain"), gain);
                    visit((table, "reference"), reference);
                    visit((table, "damping"), damping);
                }
            }
            if let Some(KneeStop { stiffness, damping }) = knee_stop {
                visit(("stabilizers.knee_stop", "stiffness"), stiffness);
                visit(("stabilizers.knee_stop", "damping"), damping);
            }
            if let Some(Fall { head_height }) = fall {
                visit(("fall", "head_height"), head_height);
            }
            let Start { support_leg: _, q, v } = start;
            for (table, values) in [("start.q", q), ("start.v", v)] {
                for (name, x) in values {
                    visit((table, name.as_str()), x);
                }
            }
        }
    };
}

impl Scene {
    visitor!(each_number);
    visitor!(each_number_mut, mut);

    /// The number of that dotted name, if the scene has one.
    pub(crate) fn number_mut(&mut self, name: &str) -> Option<&mut f64> {
        let wanted = name.rsplit_once('.').unwrap_or(("", name));
        let mut found = None;
        self.each_number_mut(|name, x| {
            if name == wanted {
                found = Some(x);
            }
        });
        found
    }

    /// All numbers, in an order that is the same for all scenes of a `kind`.
    pub(crate) fn numbers(&self) -> Vec<f64> {
        let mut numbers = Vec::with_capacity(128);
        self.each_number(|_, &x| numbers.push(x));
        numbers
    }

    /// A copy with other `numbers`; those that are missing stay.
    pub(crate) fn with_numbers(&self, numbers: &[f64]) -> Self {
        let (mut scene, mut numbers) = (self.clone(), numbers.iter());
        scene.each_number_mut(|_, x| *x = numbers.next().copied().unwrap_or(*x));
        scene
    }

    /// Are these numbers the scene's own but for those that are drawn, and these within their ranges?
    pub(crate) fn may_draw(&self, numbers: &[f64]) -> bool {
        let (mut numbers, mut may) = (numbers.iter(), true);
        self.each_number(|(table, last), own| {
            let Some(x) = numbers.next() else { return };
            may &= own.to_bits() == x.to_bits() || {
                let range = self.randomise.get(&join(table, last));
                range.is_some_and(|[low, high]| (low..=high).contains(&x))
            };
        });
        may
    }

    /// Fingerprint of everything but the numbers.
    pub(crate) fn kind(&self) -> u64 {
        let mut plain = self.clone();
        plain.each_number_mut(|_, x| *x = 0.0);
        checksum(plain.to_json().as_bytes())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{AccuracyName, COORDINATES};

    /// Scenes that together have every number there is.
    fn scenes() -> Vec<Scene> {
        let mut full = Scene::default();
        for effect in super::super::effects::EFFECTS {
            full = full.with(effect.name).unwrap_or(full);
        }
        full.stabilizers.hip_pd = Some(ProportionalDerivative::new(10.0, 1.0));
        full.stabilizers.free_knee_pd = Some(ProportionalDerivative::new(20.0, 2.0));
        full.stabilizers.knee_stop = Some(KneeStop {
            stiffness: 100.0,
            damping: 0.5,
        });
        full.stabilizers.head_damping = Some(HeadDamping { y: 1.0, z: 2.0 });
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

    /// The same numbers under the same names as the text has, no more and no fewer.
    #[test]
    fn numbers_are_those_of_the_text() {
        for scene in scenes() {
            let mut seen = Vec::new();
            scene.each_number(|(table, last), &x| {
                seen.push((join(table, last), x));
            });
            let known = scene.parameters();
            let mut known: Vec<_> = known.into_iter().map(|p| (p.name, p.value)).collect();
            assert!(seen.len() > 70);
            let by_name = |a: &(String, f64), b: &(String, f64)| a.0.cmp(&b.0);
            seen.sort_by(by_name);
            known.sort_by(by_name);
            assert_eq!(seen, known);
        }
    }

    /// A number that is set by its name is the one that the text calls so.
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
            let doubled: Vec<_> = scene.numbers().iter().map(|x| 2.0 * x).collect();
            let other = scene.with_numbers(&doubled);
            assert!(other != *scene && other.numbers() == doubled);
            assert_eq!(other.kind(), scene.kind());
            assert_eq!(other.with_numbers(&scene.numbers()), *scene);
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
        assert!(scene.may_draw(&scene.numbers()));
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
