//! A model whose numbers depend on scene parameters.

use crate::{
    error::Invalid,
    model::{Model, lanes::ModelLanes},
    numeric::{dual::Dual, scalar::Scalar},
};

/// Step of the difference quotient relative to the parameter: a power of two.
const RELATIVE_STEP: f64 = 1.0 / 1024.0;

/// Models at p + h, p - h, p + 2 h and p - 2 h for one parameter p. Compiled numbers are low-order rational
/// functions of it, so that the quotient of order 4 is exact to about 1e-12.
#[derive(Debug, Clone)]
pub struct Stencil {
    h: f64,
    models: Vec<Model>,
}

impl Stencil {
    /// For the scene's parameter of that dotted name.
    ///
    /// # Errors
    /// `Invalid` if the scene has no such number.
    pub fn of(model: &Model, name: &str) -> Result<Self, Invalid> {
        let known = |scene: &mut crate::scene::Scene| {
            let number = scene.number_mut(name).copied();
            number
                .ok_or_else(|| Invalid(format!("params: \"{name}\" is not a number of the scene")))
        };
        let value = known(&mut model.scene.clone())?;
        let size = if value == 0.0 { 1.0 } else { value.abs() };
        let h = size.log2().floor().exp2() * RELATIVE_STEP;
        let models = [1.0, -1.0, 2.0, -2.0].map(|steps| {
            let mut scene = model.scene.clone();
            if let Some(number) = scene.number_mut(name) {
                *number = value + steps * h;
            }
            model.renumbered(scene)
        });
        Ok(Self {
            h,
            models: models.into(),
        })
    }

    #[cold]
    #[inline(never)]
    fn slope(&self, of: &dyn Fn(&Model) -> f64) -> f64 {
        let [a, b, c, d] = [0, 1, 2, 3].map(|i| of(&self.models[i]));
        (8.0 * (a - b) - (c - d)) / (12.0 * self.h)
    }
}

/// The model and its derivative by a parameter, if there is one.
#[derive(Debug, Clone, Copy)]
pub struct Varied<'a> {
    pub model: &'a Model,
    pub parameter: Option<&'a Stencil>,
}

impl<'a> Varied<'a> {
    /// Without derivatives.
    pub fn constant(model: &'a Model) -> Self {
        Self {
            model,
            parameter: None,
        }
    }
}

impl ModelLanes<Dual<f64>> for Varied<'_> {
    #[inline(always)]
    fn shape(&self) -> &Model {
        self.model
    }

    #[inline(always)]
    fn lane(&self, _: usize) -> &Model {
        self.model
    }

    #[inline(always)]
    fn number(&self, of: impl Fn(&Model) -> f64) -> Dual<f64> {
        let mut number = Dual::of(of(self.model));
        if let Some(parameter) = self.parameter {
            number.d = parameter.slope(&of);
        }
        number
    }
}
