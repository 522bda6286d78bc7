//! The checker of laws: right motions keep every law, each law notices its breach.

use skate_core::{
    contact::equations::Y,
    events::{
        guard::Guard,
        observer::{AcceptedStep, Observer, Operation, Present, StepEnd},
    },
    laws::{Law, LawChecker, LawRecord},
    model::{
        Model,
        contact_mode::{ContactMode, End, FREE, Foot, SUPPORT, SoleContact},
        friction::FrictionMode,
        layout::NV,
        state::State,
    },
    rhs::{Evaluation, StepContext},
    scene::{Accuracy, AccuracyName, Scene},
    sim::Simulation,
};

const PAPER: &str = include_str!("../../../skate_env/scenes/paper.toml");
const PAPER_ARMS: &str = include_str!("../../../skate_env/scenes/paper_arms.toml");
const PAPER_PRINTED: &str = include_str!("../../../skate_env/scenes/paper_printed.toml");
const PUSH_ONLY: &str = include_str!("../../../skate_env/scenes/push_only.toml");

fn simulation(text: &str, accuracy: AccuracyName) -> Simulation {
    let mut scene = Scene::from_toml(text).expect("a scene");
    scene.accuracy = Accuracy::Named(accuracy);
    scene.energy_balance = true;
    Simulation::new(Model::compile(&scene).expect("a model")).expect("a start")
}

fn largest(sim: &Simulation, law: Law) -> f64 {
    sim.law_records()[law as usize].largest
}

/// Gaits of the presets. Largest amounts measured, `balanced` and `reference`: friction 4e-6 and 3e-9 J, impacts 4e-10
/// and 3e-10 J, balance 8e-4 and 2e-8 J, momentum 5e-7 and 8e-12 m/s, normal forces 3e-4 and 2e-6 N, direction 1e-12 and
/// 4e-15 m/s, ice 3e-13 m, closed ends 1e-11, positions 7e-11 m, velocities 1e-11 m/s.
#[test]
fn gaits_of_the_presets_keep_every_law() {
    for text in [PAPER, PAPER_ARMS, PAPER_PRINTED, PUSH_ONLY] {
        for accuracy in [AccuracyName::Balanced, AccuracyName::Reference] {
            let mut sim = simulation(text, accuracy);
            sim.check(true);
            // Contacts that close at the start are part of the motion.
            let State { q, v, .. } = sim.state;
            sim.reset(&q, &v, sim.state.support_leg).expect("a start");
            sim.advance(6.0);
            assert_eq!(sim.law_records().len(), Law::ALL.len());
            assert_eq!(sim.broken_laws().next(), None);
        }
    }
}

/// Time stepping keeps the laws that have a finite limit there. Largest amounts measured: friction 0.4 J, impacts 0.4 J,
/// ice 0.7 mm, positions 1 mm.
#[test]
fn time_stepping_keeps_the_laws_of_its_order() {
    for text in [PAPER, PAPER_ARMS, PAPER_PRINTED, PUSH_ONLY] {
        let mut sim = simulation(text, AccuracyName::Fast);
        sim.check(true);
        sim.advance(6.0);
        assert_eq!(sim.broken_laws().next(), None);
    }
}

/// Watching changes no bit, and a copy is watched, too.
#[test]
fn the_check_changes_no_bit_and_survives_copies_and_resets() {
    for accuracy in [AccuracyName::Balanced, AccuracyName::Fast] {
        let mut plain = simulation(PUSH_ONLY, accuracy);
        let mut watched = plain.clone();
        watched.check(true);
        let State {
            q, v, support_leg, ..
        } = plain.state;
        for sim in [&mut plain, &mut watched] {
            sim.advance(0.3);
            sim.kick(0.2).expect("a kick");
            let saved = sim.snapshot();
            sim.advance(0.5);
            sim.restore(&saved).expect("a snapshot");
            sim.advance(0.5);
        }
        assert_eq!(plain.snapshot(), watched.snapshot());
        assert!(plain.law_records().is_empty());
        watched.reset(&q, &v, support_leg).expect("a start");
        assert_eq!(watched.clone().law_records(), watched.law_records());
        assert!(largest(&watched, Law::FiniteRates) > 1.0);
        watched.check(false);
        assert!(watched.law_records().is_empty());
    }
}

/// Derivatives take the place of the check for their motion, and give it back.
#[test]
fn a_motion_that_is_differentiated_is_not_checked() {
    let mut sim = simulation(PAPER, AccuracyName::Balanced);
    sim.check(true);
    let n = sim.model.n;
    sim.linearize(&[0.0; NV][..n - 3], 0.01, &[], &|| true)
        .expect("derivatives");
    assert_eq!(largest(&sim, Law::FiniteRates), 0.0);
    sim.advance(0.02);
    assert!(largest(&sim, Law::FiniteRates) > 1.0);
}

/// A motion of one step or event, altered between two states.
struct Altered {
    model: Model,
    before: State,
    after: State,
    residual: [f64; NV],
}

impl Altered {
    /// The start of the push-only preset without its energy balance, moving forward in the air.
    fn flight() -> Self {
        let sim = simulation(PUSH_ONLY, AccuracyName::Reference);
        let mut model = Model::clone(&sim.model);
        model.scene.energy_balance = false;
        let mut state = sim.state;
        state.mode = ContactMode {
            support: Foot::AIR,
            free: Foot::AIR,
        };
        state.q[1] = 1.0;
        state.v = [0.0; NV];
        state.v[0] = 1.0;
        Self {
            model,
            before: state,
            after: state,
            residual: [0.0; NV],
        }
    }

    /// On the toe of the supporting foot, with this friction mode.
    fn on_toe(friction_mode: FrictionMode) -> Self {
        let mut altered = Self::flight();
        for state in [&mut altered.before, &mut altered.after] {
            state.mode.support = Foot::new(SoleContact::Toe, friction_mode);
            (state.q[1], state.q[2]) = (0.0, -0.3);
            state.v[0] = if friction_mode == FrictionMode::Stuck {
                0.0
            } else {
                1.0
            };
        }
        altered
    }

    fn evaluation(&self, state: &State) -> Evaluation {
        let mut eval = Evaluation::default();
        let context = StepContext::of(&self.model, state, &self.residual);
        eval.accelerations(&self.model, &state.q, &state.v, &context)
            .expect("accelerations");
        eval
    }

    fn present<'a>(&'a self, state: &'a State, eval: &'a Evaluation) -> Present<'a> {
        Present {
            model: &self.model,
            state,
            residual: &self.residual,
            eval,
            guards: &[],
            values: &[],
        }
    }

    /// What is found in a step between the states, after one in which nothing happens.
    fn step(&self) -> Vec<LawRecord> {
        let mut checker = LawChecker::new(&self.model);
        for after in [&self.before, &self.after] {
            let eval = self.evaluation(after);
            let step = AcceptedStep {
                before: &self.before,
                after,
                h: 1e-3,
                theta: 1.0,
                share: 0.0,
                end: StepEnd::Until,
                free_foot_angle: &|_| 0.0,
            };
            checker.step(&self.present(after, &eval), &step);
        }
        checker.records().to_vec()
    }

    /// What is found in an event between them, in which forces change by `jump` [N].
    fn event(&self, guard: Guard, operation: Option<Operation>, jump: f64) -> Vec<LawRecord> {
        let mut checker = LawChecker::new(&self.model);
        let mut eval = self.evaluation(&self.before);
        checker.event(&self.present(&self.before, &eval), guard);
        if let Some(operation) = operation {
            checker.operation(operation);
        }
        eval.solution.f_root[Y] += jump;
        let present = self.present(&self.after, &eval);
        checker.event_ends(&present, guard, (self.before.mode, self.before.support_leg));
        checker.records().to_vec()
    }
}

/// No law is broken.
const KEPT: [Law; 0] = [];

fn broken(records: &[LawRecord]) -> Vec<Law> {
    let broken = records.iter().filter(|record| record.count > 0);
    broken.map(|record| record.law).collect()
}

#[test]
fn each_law_of_a_step_notices_its_breach() {
    let alter = |alter: &dyn Fn(&mut State)| {
        let mut altered = Altered::flight();
        (altered.after.t, altered.after.v[1]) = (1e-3, -9.81e-3);
        alter(&mut altered.after);
        broken(&altered.step())
    };
    assert_eq!(alter(&|_| ()), KEPT);
    assert_eq!(alter(&|state| state.v[0] += 1e-3), [Law::MomentumInFlight]);
    assert_eq!(alter(&|state| state.q[1] = -0.1), [Law::AboveIce]);
    assert!(alter(&|state| state.v[5] = 2e3).contains(&Law::FiniteRates));

    let mut balance = Altered::on_toe(FrictionMode::Forward);
    balance.model.scene.energy_balance = true;
    assert_eq!(broken(&balance.step()), KEPT);
    balance.after.energy_balance.actuators += 0.1;
    assert_eq!(broken(&balance.step()), [Law::EnergyBalance]);
    (
        balance.after.energy_balance.actuators,
        balance.after.energy_balance.damping,
    ) = (-0.1, -0.1);
    assert_eq!(broken(&balance.step()), [Law::FrictionDissipates]);

    let mut sinking = Altered::on_toe(FrictionMode::Forward);
    assert_eq!(broken(&sinking.step()), KEPT);
    sinking.after.q[1] = 1e-3;
    assert_eq!(broken(&sinking.step()), [Law::ClosedEndsStay]);
    (sinking.after.q[1], sinking.after.v[1]) = (0.0, 1e-3);
    assert_eq!(broken(&sinking.step()), [Law::ClosedEndsRest]);

    let driven = Altered::on_toe(FrictionMode::Backward);
    assert_eq!(
        broken(&driven.step()),
        [Law::FrictionDissipates, Law::SlidingDirection]
    );

    let mut pulled = Altered::on_toe(FrictionMode::Stuck);
    pulled.residual[4] = 3e3;
    let one = broken(&pulled.step());
    pulled.residual[4] = -3e3;
    let both = [one, broken(&pulled.step())].concat();
    assert!(both.contains(&Law::NormalForces), "{both:?}");
    assert!(both.contains(&Law::FrictionInCone), "{both:?}");
}

#[test]
fn each_law_of_an_event_notices_its_breach() {
    let lands = Guard::Gap(FREE, End::Heel);
    let impact = Operation::Impact {
        mode: Altered::flight().before.mode,
        has_friction: false,
    };
    let mut altered = Altered::flight();
    assert_eq!(broken(&altered.event(lands, None, 1e3)), KEPT);
    altered.after.v[0] *= 0.5;
    assert_eq!(broken(&altered.event(lands, Some(impact), 0.0)), KEPT);
    assert_eq!(
        broken(&altered.event(lands, None, 0.0)),
        [Law::VelocitiesNeedImpacts]
    );
    altered.after.v[0] *= 4.0;
    assert_eq!(
        broken(&altered.event(lands, Some(impact), 0.0)),
        [Law::ImpactsDissipate]
    );
    altered.after.v[0] *= 0.5;
    altered.after.q[0] += 1e-3;
    assert_eq!(broken(&altered.event(lands, None, 0.0)), [Law::NoJump]);

    // Friction of a foot without friction does nothing, so that forces may go on where its normal force changes sign.
    let mut pulled = Altered::on_toe(FrictionMode::Forward);
    pulled.model.friction.mu = [0.0; 2];
    pulled.before.mode.support.pulled = true;
    let sign = Guard::Pull(SUPPORT);
    assert_eq!(broken(&pulled.event(sign, None, 0.0)), KEPT);
    assert_eq!(
        broken(&pulled.event(sign, None, 100.0)),
        [Law::ForcesContinuous]
    );
}
