//! What was found of each law.

use crate::{
    laws::{FIRST, Law, LawRecord, Violation, limits::limit},
    model::{Model, state::State},
};

/// One record for each law, in the order of their indices.
#[derive(Debug, Clone)]
pub struct Records(Vec<LawRecord>);

impl Records {
    pub fn new(model: &Model) -> Self {
        let record = |law| LawRecord {
            law,
            limit: limit(law, model),
            largest: 0.0,
            count: 0,
            first: Vec::new(),
        };
        Self(Law::ALL.map(record).into())
    }

    pub fn as_slice(&self) -> &[LawRecord] {
        &self.0
    }

    /// Take the limits of another model of the same scene.
    pub fn set_limits(&mut self, model: &Model) {
        for record in &mut self.0 {
            record.limit = limit(record.law, model);
        }
    }

    /// Record an amount; returns whether it is within the limit.
    pub fn report(
        &mut self,
        law: Law,
        amount: f64,
        state: &State,
        event: Option<&'static str>,
    ) -> bool {
        let record = &mut self.0[law as usize];
        record.largest = record.largest.max(amount);
        let is_kept = amount <= record.limit;
        if !is_kept {
            record.count += 1;
            if record.first.len() < FIRST {
                record.first.push(Violation {
                    t: state.t,
                    amount,
                    mode: state.mode,
                    event,
                });
            }
        }
        is_kept
    }
}
