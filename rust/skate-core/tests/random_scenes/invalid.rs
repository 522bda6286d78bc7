//! Invalid scenes.

use rand::{Rng, seq::IndexedRandom};
use rand_chacha::ChaCha8Rng;
use serde_json::{Value, json};
use skate_core::scene::Scene;

/// A random invalid scene, and the text that the message must contain.
pub fn invalid_scene(rng: &mut ChaCha8Rng, scene: &Scene) -> (Value, String) {
    let mut table: Value = serde_json::from_str(&scene.to_json()).expect("JSON");
    let numbers = scene.parameters();
    let number = numbers.choose(rng).expect("some number");
    let pointer = |name: &str| format!("/{}", name.replace('.', "/"));
    let leaf = number.name.clone();
    let mut set = |name: &str, value: Value| {
        *table.pointer_mut(&pointer(name)).expect("a field") = value;
    };
    let named = |name: &str| name.to_owned();
    let says = match rng.random_range(0..9) {
        0 => {
            let (low, high) = (number.range.low, number.range.high);
            let far = 1.0 + 10.0 * rng.random::<f64>();
            let outside = [low - far, high + far, -1e300, 1e300];
            set(&leaf, json!(outside.choose(rng)));
            leaf
        }
        1 => {
            let wrong = [json!("slippery"), json!(true), json!(null)];
            let wrong = wrong.choose(rng).expect("some");
            set(&leaf, wrong.clone());
            leaf
        }
        2 => {
            let wrong = [json!([1.0]), json!({"x": 1.0})];
            set(&leaf, wrong.choose(rng).expect("some").clone());
            // Elements of lists and fields of friction are named by their table.
            let table = leaf.trim_end_matches(|c: char| c == '.' || c.is_ascii_digit());
            if table.starts_with("ice.friction") {
                named("ice.friction")
            } else {
                table.to_owned()
            }
        }
        3 => {
            let tables = [
                "",
                "body",
                "body.foot",
                "ice",
                "contact",
                "control",
                "stabilizers",
                "start",
            ];
            let place = *tables.choose(rng).expect("some");
            let host = match place {
                "" => &mut table,
                place => table.pointer_mut(&pointer(place)).expect("a table"),
            };
            let word: String = (0..6).map(|_| rng.random_range('a'..='z')).collect();
            host[word.as_str()] = json!(1.0);
            word
        }
        4 => {
            let wrong = [
                ("contact.law", "three_way"),
                ("start.support_leg", "middle"),
                ("contact.pulled_friction", "some"),
            ];
            let (name, value) = *wrong.choose(rng).expect("some");
            set(name, json!(value));
            named(value)
        }
        5 => {
            let flags = [
                "energy_balance",
                "body.joint_damping",
                "contact.foot_rotation",
                "contact.free_foot",
                "contact.impacts",
                "contact.toe_contact",
            ];
            let name = *flags.choose(rng).expect("some");
            set(name, json!(0.5));
            named(name)
        }
        6 => {
            let joint = format!("q{}", rng.random_range(18..99));
            match rng.random_range(0..3) {
                0 => set("locked", json!([joint])),
                1 => set("start.q", json!({&joint: 0.1})),
                _ => set("start.v", json!({&joint: 0.1})),
            }
            joint
        }
        7 => {
            let kinds = [
                (json!({"kind": "sandy"}), "sandy"),
                (json!({"kind": "coulomb", "capture_speed": 0.0}), "`mu`"),
                (json!({"kind": "none", "mu": 0.1}), "mu"),
                (
                    json!({"kind": "viscous", "coefficient": -1.0}),
                    "coefficient",
                ),
            ];
            let (value, says) = kinds.choose(rng).expect("some");
            set("ice.friction", value.clone());
            named(says)
        }
        _ => {
            let contact = |law: &str| json!({"law": law, "edge_damping": 0.0});
            // Ensure that there is no other error.
            set("ice.friction", json!({"kind": "none"}));
            let rules: [(&[(&str, Value)], &str); 8] = [
                (
                    &[
                        ("contact", contact("push_only")),
                        ("contact.foot_rotation", json!(false)),
                    ],
                    "contact.foot_rotation",
                ),
                (
                    &[
                        ("contact", contact("push_only")),
                        ("contact.toe_contact", json!(true)),
                    ],
                    "contact.toe_contact",
                ),
                (
                    &[
                        ("contact", contact("push_only")),
                        ("contact.point_contact_holds", json!(true)),
                    ],
                    "contact.point_contact_holds",
                ),
                (
                    &[
                        ("contact", contact("push_only")),
                        ("ice.friction", json!({"kind": "sticking"})),
                    ],
                    "ice.friction.kind",
                ),
                (
                    &[
                        ("contact", contact("two_way")),
                        ("contact.toe_contact", json!(true)),
                        ("contact.impacts", json!(false)),
                    ],
                    "contact.toe_contact",
                ),
                (
                    &[
                        ("contact", contact("two_way")),
                        ("contact.foot_rotation", json!(false)),
                        ("contact.edge_damping", json!(1.0)),
                    ],
                    "contact.edge_damping",
                ),
                (
                    &[
                        ("start.q", json!({})),
                        ("start.v", json!({})),
                        ("locked", json!(["q8"])),
                        ("control.arm_swing", json!({"amplitude": 1.0})),
                    ],
                    "control.arm_swing",
                ),
                (
                    &[("start.v", json!({"q17": 1.0})), ("locked", json!(["q17"]))],
                    "start.",
                ),
            ];
            let (changes, says) = rules.choose(rng).expect("some");
            for (name, value) in *changes {
                let (place, key) = name.rsplit_once('.').unwrap_or(("", name));
                let host = match place {
                    "" => &mut table,
                    place => table.pointer_mut(&pointer(place)).expect("a table"),
                };
                host[key] = value.clone();
            }
            named(says)
        }
    };
    (table, says)
}
