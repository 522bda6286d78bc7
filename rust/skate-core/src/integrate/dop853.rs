//! Explicit Runge-Kutta method of order 8 with an error estimate and dense output of order 7.
//!
//! Coefficients: Dormand and Prince, DOP853 of Hairer, Norsett and Wanner (1993), section II.5; error estimate
//! of orders 5 and 3 and dense output as in section II.10. The dense output takes three more evaluations.

#![allow(clippy::excessive_precision)] // Coefficients as printed.

use crate::{
    error::Termination,
    integrate::{Start, System, TimeStep, step::Stiffness},
    numeric::scalar::Scalar,
};

/// Relative change of the states below which their rate is not estimated.
const ROUNDING: f64 = 1e-12;
/// Number of stages, which is also the index of the slope at the end.
pub const END: usize = 12;
/// Times of the stages, of the end and of the further stages of the dense output, as fractions of the step.
pub const C: [f64; 16] = [
    0.0,
    0.05260015195876773,
    0.0789002279381516,
    0.1183503419072274,
    0.2816496580927726,
    0.3333333333333333,
    0.25,
    0.3076923076923077,
    0.6512820512820513,
    0.6,
    0.8571428571428571,
    1.0,
    1.0,
    0.1,
    0.2,
    0.7777777777777778,
];
/// Non-zero weights (stage, weight) of each stage. Index 12 is the solution, 13 to 15 are for the dense output.
const A1: [(usize, f64); 1] = [(0, 0.05260015195876773)];
const A2: [(usize, f64); 2] = [(0, 0.0197250569845379), (1, 0.0591751709536137)];
const A3: [(usize, f64); 2] = [(0, 0.02958758547680685), (2, 0.08876275643042054)];
const A4: [(usize, f64); 3] = [
    (0, 0.2413651341592667),
    (2, -0.8845494793282861),
    (3, 0.924834003261792),
];
const A5: [(usize, f64); 3] = [
    (0, 0.037037037037037035),
    (3, 0.17082860872947386),
    (4, 0.12546768756682242),
];
const A6: [(usize, f64); 4] = [
    (0, 0.037109375),
    (3, 0.17025221101954405),
    (4, 0.06021653898045596),
    (5, -0.017578125),
];
const A7: [(usize, f64); 5] = [
    (0, 0.03709200011850479),
    (3, 0.17038392571223998),
    (4, 0.10726203044637328),
    (5, -0.015319437748624402),
    (6, 0.008273789163814023),
];
const A8: [(usize, f64); 6] = [
    (0, 0.6241109587160757),
    (3, -3.3608926294469414),
    (4, -0.868219346841726),
    (5, 27.59209969944671),
    (6, 20.154067550477894),
    (7, -43.48988418106996),
];
const A9: [(usize, f64); 7] = [
    (0, 0.47766253643826434),
    (3, -2.4881146199716677),
    (4, -0.590290826836843),
    (5, 21.230051448181193),
    (6, 15.279233632882423),
    (7, -33.28821096898486),
    (8, -0.020331201708508627),
];
const A10: [(usize, f64); 8] = [
    (0, -0.9371424300859873),
    (3, 5.186372428844064),
    (4, 1.0914373489967295),
    (5, -8.149787010746927),
    (6, -18.52006565999696),
    (7, 22.739487099350505),
    (8, 2.4936055526796523),
    (9, -3.0467644718982196),
];
const A11: [(usize, f64); 9] = [
    (0, 2.273310147516538),
    (3, -10.53449546673725),
    (4, -2.0008720582248625),
    (5, -17.9589318631188),
    (6, 27.94888452941996),
    (7, -2.8589982771350235),
    (8, -8.87285693353063),
    (9, 12.360567175794303),
    (10, 0.6433927460157636),
];
const A12: [(usize, f64); 8] = [
    (0, 0.054293734116568765),
    (5, 4.450312892752409),
    (6, 1.8915178993145003),
    (7, -5.801203960010585),
    (8, 0.3111643669578199),
    (9, -0.1521609496625161),
    (10, 0.20136540080403034),
    (11, 0.04471061572777259),
];
const A13: [(usize, f64); 8] = [
    (0, 0.056167502283047954),
    (6, 0.25350021021662483),
    (7, -0.2462390374708025),
    (8, -0.12419142326381637),
    (9, 0.15329179827876568),
    (10, 0.00820105229563469),
    (11, 0.007567897660545699),
    (12, -0.008298),
];
const A14: [(usize, f64); 8] = [
    (0, 0.03183464816350214),
    (5, 0.028300909672366776),
    (6, 0.053541988307438566),
    (7, -0.05492374857139099),
    (10, -0.00010834732869724932),
    (11, 0.0003825710908356584),
    (12, -0.00034046500868740456),
    (13, 0.1413124436746325),
];
const A15: [(usize, f64); 8] = [
    (0, -0.42889630158379194),
    (5, -4.697621415361164),
    (6, 7.683421196062599),
    (7, 4.06898981839711),
    (8, 0.3567271874552811),
    (12, -0.0013990241651590145),
    (13, 2.9475147891527724),
    (14, -9.15095847217987),
];
/// Errors of order 5 and of order 3.
const E5: [(usize, f64); 8] = [
    (0, 0.01312004499419488),
    (5, -1.2251564463762044),
    (6, -0.4957589496572502),
    (7, 1.6643771824549864),
    (8, -0.35032884874997366),
    (9, 0.3341791187130175),
    (10, 0.08192320648511571),
    (11, -0.022355307863886294),
];
const E3: [(usize, f64); 8] = [
    (0, -0.18980075407240762),
    (5, 4.450312892752409),
    (6, 1.8915178993145003),
    (7, -5.801203960010585),
    (8, -0.4226823213237919),
    (9, -0.1521609496625161),
    (10, 0.20136540080403034),
    (11, 0.02265179219836082),
];
/// Dense output: coefficients of its last four terms.
const D0: [(usize, f64); 12] = [
    (0, -8.428938276109013),
    (5, 0.5667149535193777),
    (6, -3.0689499459498917),
    (7, 2.38466765651207),
    (8, 2.117034582445028),
    (9, -0.871391583777973),
    (10, 2.2404374302607883),
    (11, 0.6315787787694688),
    (12, -0.08899033645133331),
    (13, 18.148505520854727),
    (14, -9.194632392478356),
    (15, -4.436036387594894),
];
const D1: [(usize, f64); 12] = [
    (0, 10.427508642579134),
    (5, 242.28349177525817),
    (6, 165.20045171727028),
    (7, -374.5467547226902),
    (8, -22.113666853125306),
    (9, 7.733432668472264),
    (10, -30.674084731089398),
    (11, -9.332130526430229),
    (12, 15.697238121770845),
    (13, -31.139403219565178),
    (14, -9.35292435884448),
    (15, 35.81684148639408),
];
const D2: [(usize, f64); 12] = [
    (0, 19.985053242002433),
    (5, -387.0373087493518),
    (6, -189.17813819516758),
    (7, 527.8081592054236),
    (8, -11.57390253995963),
    (9, 6.8812326946963),
    (10, -1.0006050966910838),
    (11, 0.7777137798053443),
    (12, -2.778205752353508),
    (13, -60.19669523126412),
    (14, 84.32040550667716),
    (15, 11.99229113618279),
];
const D3: [(usize, f64); 12] = [
    (0, -25.69393346270375),
    (5, -154.18974869023643),
    (6, -231.5293791760455),
    (7, 357.6391179106141),
    (8, 93.40532418362432),
    (9, -37.45832313645163),
    (10, 104.0996495089623),
    (11, 29.8402934266605),
    (12, -43.53345659001114),
    (13, 96.32455395918828),
    (14, -39.17726167561544),
    (15, -149.72683625798564),
];

/// All weights as rows; zero where none is listed. The row `END` is the solution.
pub fn tableau() -> Vec<Vec<f64>> {
    let rows: [&[(usize, f64)]; C.len()] = [
        &[],
        &A1,
        &A2,
        &A3,
        &A4,
        &A5,
        &A6,
        &A7,
        &A8,
        &A9,
        &A10,
        &A11,
        &A12,
        &A13,
        &A14,
        &A15,
    ];
    let full = |row: &&[(usize, f64)]| {
        let mut full = vec![0.0; C.len()];
        row.iter().for_each(|&(j, a)| full[j] = a);
        full
    };
    rows.iter().map(full).collect()
}

impl<const N: usize, T: Scalar> TimeStep<N, T> {
    /// As `dopri5`.
    #[inline(always)]
    pub fn dop853(
        &mut self,
        system: &mut impl System<N, T>,
        start: Start<'_, N, T>,
        h: T,
    ) -> Result<(), Termination> {
        self.start(start, h, END);
        self.stage_of(system, 1, A1)?;
        self.stage_of(system, 2, A2)?;
        self.stage_of(system, 3, A3)?;
        self.stage_of(system, 4, A4)?;
        self.stage_of(system, 5, A5)?;
        self.stage_of(system, 6, A6)?;
        self.stage_of(system, 7, A7)?;
        self.stage_of(system, 8, A8)?;
        self.stage_of(system, 9, A9)?;
        self.stage_of(system, 10, A10)?;
        self.stage_of(system, 11, A11)?;
        self.last = self.y1;
        self.stage_of(system, END, A12)
    }

    /// The fastest motion, from the last stage and the end, which are at the same time.
    #[inline(always)]
    pub fn dop853_stiffness(&self) -> Stiffness<T> {
        let one = T::one();
        let slopes = self.mean_square(
            one,
            #[inline(always)]
            |i| self.k[END][i] - self.k[END - 1][i],
        );
        let states = self.mean_square(
            one,
            #[inline(always)]
            |i| (self.y1[i] - self.last[i]) / self.h,
        );
        // States that differ by rounding say nothing about the rate.
        Stiffness {
            h_rho_squared: slopes / (states + T::of(ROUNDING * ROUNDING)),
            size_squared: states,
        }
    }

    /// Evaluate stage `s`.
    #[inline(always)]
    fn stage_of<const S: usize>(
        &mut self,
        system: &mut impl System<N, T>,
        s: usize,
        weights: [(usize, f64); S],
    ) -> Result<(), Termination> {
        let y = self.weighted(weights);
        if s <= END {
            self.y1 = y;
        }
        system.rhs(self.t + T::of(C[s]) * self.h, &y, &mut self.k[s])
    }

    /// y0 + h sum(weight k[stage]).
    #[inline(always)]
    fn weighted<const S: usize>(&self, weights: [(usize, f64); S]) -> [T; N] {
        let mut h = [T::zero(); S];
        for i in 0..S {
            h[i] = self.h * T::of(weights[i].1);
        }
        let mut y = self.y0;
        for i in 0..self.live() {
            let mut sum = y[i];
            for j in 0..S {
                sum += h[j] * self.k[weights[j].0][i];
            }
            y[i] = sum;
        }
        y
    }

    /// Prepare the dense output, `at`.
    #[inline(always)]
    pub(super) fn dop853_dense(
        &mut self,
        system: &mut impl System<N, T>,
    ) -> Result<(), Termination> {
        self.stage_of(system, 13, A13)?;
        self.stage_of(system, 14, A14)?;
        self.stage_of(system, 15, A15)?;
        self.cubic(0..self.live());
        for i in 0..self.live() {
            self.dense[2][i] = self.h * self.sum(D0, i);
            self.dense[3][i] = self.h * self.sum(D1, i);
            self.dense[4][i] = self.h * self.sum(D2, i);
            self.dense[5][i] = self.h * self.sum(D3, i);
        }
        Ok(())
    }

    /// Mean squares of the local errors of order 5 and 3; see `error`.
    #[inline(always)]
    pub fn dop853_squares(&self, tolerance: T) -> [T; 2] {
        [
            self.mean_square(
                tolerance,
                #[inline(always)]
                |i| self.sum(E5, i),
            ),
            self.mean_square(
                tolerance,
                #[inline(always)]
                |i| self.sum(E3, i),
            ),
        ]
    }

    /// sum(weight k[stage]) of a component.
    #[inline(always)]
    fn sum<const S: usize>(&self, weights: [(usize, f64); S], i: usize) -> T {
        let mut sum = T::zero();
        for j in 0..S {
            sum += T::of(weights[j].1) * self.k[weights[j].0][i];
        }
        sum
    }
}

/// Local error as a multiple of the tolerance, from the mean squares of `TimeStep::dop853_squares`: that of order 5,
/// reduced where that of order 3 is large (Hairer, Norsett and Wanner 1993, eq. II.10.17). Near h rho = 5.6, where it
/// does not see the fastest motion, it is at least the size of that.
pub fn error([fifth, third]: [f64; 2], stiffness: Stiffness<f64>, tolerance: f64) -> f64 {
    let size = (fifth + 0.01 * third).sqrt();
    let error = if fifth > 0.0 { fifth / size } else { fifth };
    if stiffness.factor() < 0.99 {
        error.max(stiffness.size_squared.sqrt() / tolerance)
    } else {
        error
    }
}
