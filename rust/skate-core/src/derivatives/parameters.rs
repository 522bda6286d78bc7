//! Parameters of the scene: derivatives of what the compiled numbers of the model determine.

use crate::{
    error::Invalid,
    model::Model,
    numeric::{elementary, simd::Register},
    scene::Scene,
};

/// Names that start with these are no parameters of the motion: they select its start, its steps or its samples.
const NOT_DIFFERENTIATED: [&str; 4] = [
    "start.",
    "accuracy",
    "control.sample_period",
    "control.action_period",
];

/// Step of the difference quotient relative to the parameter: a power of two.
const RELATIVE_STEP: f64 = 1.0 / 64.0;

/// Models at p + h, p - h, p + 2 h, .., p - 3 h for one parameter p. The quotient of order 6 is exact, but for rounding,
/// for polynomials up to degree 6 in p, and to about 1e-12 for quotients of compiled masses. Forces, positions and guards
/// at a given state are such functions. The long steps keep rounding small.
#[derive(Debug, Clone)]
struct Parameter {
    h: f64,
    models: [Model; 6],
}

impl Parameter {
    /// That of the dotted name.
    fn of(model: &Model, name: &str) -> Result<Self, Invalid> {
        if NOT_DIFFERENTIATED.iter().any(|no| name.starts_with(no)) {
            return Err(Invalid(format!("params: \"{name}\" is not differentiable")));
        }
        let number = |scene: &mut Scene| scene.number_mut(name).copied();
        let value = number(&mut model.scene.clone())
            .ok_or_else(|| Invalid(format!("params: \"{name}\" is not a number of the scene")))?;
        let size = if value == 0.0 { 1.0 } else { value.abs() };
        let h = elementary::exp2(elementary::log2(size).floor()) * RELATIVE_STEP;
        let models = [1.0, -1.0, 2.0, -2.0, 3.0, -3.0].map(|steps| {
            let mut scene = model.scene.clone();
            if let Some(number) = scene.number_mut(name) {
                *number = value + steps * h;
            }
            model.renumbered(scene)
        });
        Ok(Self { h, models })
    }
}

/// The parameters by which a motion is differentiated.
#[derive(Debug, Clone, Default)]
pub struct Parameters(Vec<Parameter>);

impl Parameters {
    /// Those of the dotted names.
    ///
    /// # Errors
    /// `Invalid` for an unknown or repeated name, and for one that is no parameter of the motion.
    pub fn of(model: &Model, names: &[String]) -> Result<Self, Invalid> {
        let mut all = Vec::with_capacity(names.len());
        for (i, name) in names.iter().enumerate() {
            if names[..i].contains(name) {
                return Err(Invalid(format!("params: \"{name}\" is repeated")));
            }
            all.push(Parameter::of(model, name)?);
        }
        Ok(Self(all))
    }

    pub fn len(&self) -> usize {
        self.0.len()
    }

    /// Derivatives of numbers that are functions of the model.
    pub fn slopes<const N: usize>(&self, mut of: impl FnMut(&Model) -> [f64; N]) -> Slopes<N> {
        let quotient = |parameter: &Parameter| {
            let [a, b, c, d, e, f] = parameter.models.each_ref().map(&mut of);
            std::array::from_fn(|i| {
                let [once, twice, thrice] = [a[i] - b[i], c[i] - d[i], e[i] - f[i]];
                (45.0 * once - 9.0 * twice + thrice) / (60.0 * parameter.h)
            })
        };
        Slopes(self.0.iter().map(quotient).collect())
    }
}

/// Derivatives of `N` numbers by every parameter.
#[derive(Debug, Clone, Default)]
pub struct Slopes<const N: usize>(pub Vec<[f64; N]>);

impl<const N: usize> Slopes<N> {
    /// Derivatives along a register's directions: lane l is that of the parameter `first + l`. None where there is
    /// none, and for directions that are not those of parameters.
    #[inline(always)]
    pub fn along<R: Register>(&self, first: Option<usize>) -> Option<[R; N]> {
        let lanes = self.0.get(first?..).filter(|lanes| !lanes.is_empty())?;
        let mut slopes = [R::zero(); N];
        for (i, slope) in slopes.iter_mut().enumerate() {
            *slope = R::from_lanes(|lane| lanes.get(lane).map_or(0.0, |by| by[i]));
        }
        Some(slopes)
    }
}

/// A model and the parameters by which a motion of it is differentiated.
#[derive(Debug, Clone, Copy)]
pub struct Varied<'a> {
    pub model: &'a Model,
    pub parameters: &'a Parameters,
}
