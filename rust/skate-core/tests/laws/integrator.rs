//! Coefficients and convergence orders of the integration methods.

use skate_core::{
    error::Termination,
    integrate::{
        Control, Fixed, Method, Size, Start, System, TimeStep, dop853, dopri5, rk4, rosenbrock,
    },
};

/// Order conditions of rooted trees up to order 5 for an explicit method (Hairer, Norsett and Wanner 1993,
/// table II.2.1). Returns the largest violation up to `order`.
fn violation(a: &[Vec<f64>], b: &[f64], order: usize) -> f64 {
    let s = b.len();
    let c: Vec<f64> = a.iter().map(|row| row.iter().sum()).collect();
    let sum = |f: &dyn Fn(usize) -> f64| (0..s).map(|i| b[i] * f(i)).sum::<f64>();
    let row = |i: usize, f: &dyn Fn(usize) -> f64| (0..s).map(|j| a[i][j] * f(j)).sum::<f64>();
    let c2 = |i: usize| c[i] * c[i];
    let c3 = |i: usize| c[i] * c[i] * c[i];
    let ac = |i: usize| row(i, &|j| c[j]);
    let ac2 = |i: usize| row(i, &c2);
    let aac = |i: usize| row(i, &ac);
    let conditions = [
        (1, sum(&|_| 1.0), 1.0),
        (2, sum(&|i| c[i]), 1.0 / 2.0),
        (3, sum(&c2), 1.0 / 3.0),
        (3, sum(&ac), 1.0 / 6.0),
        (4, sum(&c3), 1.0 / 4.0),
        (4, sum(&|i| c[i] * ac(i)), 1.0 / 8.0),
        (4, sum(&ac2), 1.0 / 12.0),
        (4, sum(&aac), 1.0 / 24.0),
        (5, sum(&|i| c[i].powi(4)), 1.0 / 5.0),
        (5, sum(&|i| c2(i) * ac(i)), 1.0 / 10.0),
        (5, sum(&|i| ac(i) * ac(i)), 1.0 / 20.0),
        (5, sum(&|i| c[i] * ac2(i)), 1.0 / 15.0),
        (5, sum(&|i| row(i, &c3)), 1.0 / 20.0),
        (5, sum(&|i| c[i] * aac(i)), 1.0 / 30.0),
        (5, sum(&|i| row(i, &|j| c[j] * ac(j))), 1.0 / 40.0),
        (5, sum(&|i| row(i, &ac2)), 1.0 / 60.0),
        (5, sum(&|i| row(i, &aac)), 1.0 / 120.0),
    ];
    let wanted = conditions.iter().filter(|(n, ..)| *n <= order);
    wanted.fold(0.0, |most, (_, left, right)| {
        f64::max(most, (left - right).abs())
    })
}

fn rows<const N: usize, const S: usize>(a: &[[f64; N]; S]) -> Vec<Vec<f64>> {
    let pad = |row: &[f64; N]| row.iter().copied().chain([0.0]).take(S).collect();
    a.iter().map(pad).collect()
}

/// Every tableau meets its order conditions, and not those of the next order.
#[test]
fn tableaus_meet_their_order_conditions() {
    let a = rows(&dopri5::A);
    let high = a[6].clone();
    let low: Vec<f64> = high.iter().zip(dopri5::E).map(|(b, e)| b - e).collect();
    for (b, order) in [(&high, 5), (&low, 4)] {
        // Measured 2e-16.
        assert!(violation(&a, b, order) < 1e-14, "{order}");
    }
    assert!(violation(&a, &low, 5) > 1e-4);
    for (row, c) in a.iter().zip(dopri5::C) {
        assert!((row.iter().sum::<f64>() - c).abs() < 1e-14);
    }
    // Order 5 of the tree conditions; `methods_converge_with_their_orders` shows order 8.
    let tableau = dop853::tableau();
    let weights = tableau[dop853::END][..dop853::END].to_vec();
    let stages = &tableau[..dop853::END];
    // Measured 2e-16.
    assert!(violation(stages, &weights, 5) < 1e-14);
    for (row, c) in tableau.iter().zip(dop853::C) {
        assert!((row.iter().sum::<f64>() - c).abs() < 1e-14);
    }
    let a = rows(&rk4::A);
    assert!(violation(&a, &rk4::B, 4) < 1e-15);
    assert!(violation(&a, &rk4::B, 5) > 1e-3);
    for (row, c) in a.iter().zip(rk4::C) {
        assert!((row.iter().sum::<f64>() - c).abs() < 1e-15);
    }
}

/// Order conditions of W-methods, which hold for any matrix A: those of the explicit part, and those with
/// gamma in place of alpha and zero right-hand side (Hairer and Wanner 1996, section IV.7).
#[test]
fn the_linearly_implicit_method_meets_its_order_conditions() {
    use rosenbrock::{ALPHA, B, B_LOW, GAMMA};
    let sums = |x: &[[f64; 4]; 4]| x.map(|row| row.iter().sum::<f64>());
    let (alpha, gamma) = (sums(&ALPHA), sums(&GAMMA));
    let of = |b: &[f64; 4], f: &dyn Fn(usize) -> f64| (0..4).map(|i| b[i] * f(i)).sum::<f64>();
    let through =
        |x: &[[f64; 4]; 4], y: &[f64; 4], i: usize| -> f64 { (0..4).map(|j| x[i][j] * y[j]).sum() };
    let order_2 = |b: &[f64; 4]| {
        [
            of(b, &|_| 1.0) - 1.0,
            of(b, &|i| alpha[i]) - 0.5,
            of(b, &|i| gamma[i]),
        ]
    };
    let order_3 = |b: &[f64; 4]| {
        [
            of(b, &|i| alpha[i] * alpha[i]) - 1.0 / 3.0,
            of(b, &|i| through(&ALPHA, &alpha, i)) - 1.0 / 6.0,
            of(b, &|i| through(&ALPHA, &gamma, i)),
            of(b, &|i| through(&GAMMA, &alpha, i)),
            of(b, &|i| through(&GAMMA, &gamma, i)),
        ]
    };
    let most = |x: &[f64]| x.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
    // Measured 3e-16; the coefficients have 16 digits.
    assert!(most(&order_2(&B)) < 1e-14 && most(&order_2(&B_LOW)) < 1e-14);
    assert!(most(&order_3(&B)) < 1e-14, "{:?}", order_3(&B));
    assert!(most(&order_3(&B_LOW)) > 1e-3);
    // Stiffly accurate: the solution is the last stage.
    let last: [f64; 4] = std::array::from_fn(|j| ALPHA[3][j] + GAMMA[3][j]);
    assert!((0..4).all(|j| (last[j] - B[j]).abs() < 1e-15));
}

/// Square of the pendulum's angular frequency.
const SWING: f64 = 30.0;

/// Pendulum with friction: y'' = -30 sin(y) - D (y' - cos(t)). The implicit method treats D implicitly.
struct Pendulum {
    damping: f64,
    g: f64,
}

impl System<2> for Pendulum {
    fn rhs(&mut self, t: f64, y: &[f64; 2], dy: &mut [f64; 2]) -> Result<(), Termination> {
        *dy = [y[1], -SWING * y[0].sin() - self.damping * (y[1] - t.cos())];
        Ok(())
    }

    fn factor(&mut self, _: &[f64; 2], g: f64) -> Result<(), Termination> {
        self.g = g;
        Ok(())
    }

    fn solve(&mut self, x: &mut [f64; 2]) -> Result<(), Termination> {
        x[1] /= 1.0 + self.g * self.damping;
        x[0] += self.g * x[1];
        Ok(())
    }
}

fn start<'a>(t: f64, y: &'a [f64; 2], slope: &'a [f64; 2]) -> Start<'a, 2> {
    Start { t, y, slope }
}

/// Integrate to t = 1 with a fixed step. Returns the end and the dense output at the middle of the last
/// step.
fn run(method: Method, damping: f64, steps: u32) -> ([f64; 2], [f64; 2]) {
    let mut system = Pendulum { damping, g: 0.0 };
    let h = 1.0 / f64::from(steps);
    let mut step = TimeStep::new(&[Size::UNIT; 2], &[]);
    let (mut y, mut dy) = ([1.0, 1.0], [0.0; 2]);
    system.rhs(0.0, &y, &mut dy).expect("smooth");
    for i in 0..steps {
        let start = start(f64::from(i) * h, &y, &dy);
        step.attempt(method, &mut system, start, h).expect("smooth");
        (y, dy) = (step.y1, *step.dy1());
    }
    step.make_dense(method, &mut system).expect("smooth");
    (y, step.at(0.5))
}

/// Methods with their orders.
const METHODS: [(Method, f64); 4] = [
    (Method::dop853(1.0), 8.0),
    (Method::dopri5(1.0), 5.0),
    (Method::Rk4(Fixed { step: 1.0 }), 4.0),
    (Method::Rosenbrock(Control::Fixed(Fixed { step: 1.0 })), 3.0),
];

/// Observed orders over factors of four are within 0.25 of theory; dense outputs lose at most one order.
#[test]
fn methods_converge_with_their_orders() {
    for (method, order) in METHODS {
        let fine = Method::dop853(1.0);
        let (exact, _) = run(fine, 1.0, 1024);
        // Order 8 reaches rounding errors with few steps, and its leading error changes sign near 10.
        let first = if order > 5.0 { 5 } else { 32 };
        let error = |n: u32| {
            let (y, _) = run(method, 1.0, n);
            (y[0] - exact[0]).hypot(y[1] - exact[1])
        };
        for n in [first, 2 * first] {
            let observed = (error(n) / error(4 * n)).log2() / 2.0;
            // Measured at the largest deviation: 7.83, 5.14, 3.92 and 3.08.
            assert!(
                (observed - order).abs() < 0.25,
                "{method:?} {n}: {observed}"
            );
        }
        // The middle of the last step against a run that ends there.
        let dense = |n: u32| {
            let middle = 1.0 - 0.5 / f64::from(n);
            let (mut system, count) = (
                Pendulum {
                    damping: 1.0,
                    g: 0.0,
                },
                1024,
            );
            let h = middle / f64::from(count);
            let mut step = TimeStep::new(&[Size::UNIT; 2], &[]);
            let (mut y, mut dy) = ([1.0, 1.0], [0.0; 2]);
            system.rhs(0.0, &y, &mut dy).expect("smooth");
            for i in 0..count {
                let start = start(f64::from(i) * h, &y, &dy);
                step.attempt(fine, &mut system, start, h).expect("smooth");
                (y, dy) = (step.y1, *step.dy1());
            }
            (run(method, 1.0, n).1[0] - y[0]).abs()
        };
        let observed = (dense(first) / dense(4 * first)).log2() / 2.0;
        assert!(observed > order - 1.25, "{method:?} dense: {observed}");
    }
}

/// With damping a hundred times the explicit stability limit, the implicit method is stable and the
/// explicit ones are not.
#[test]
fn only_the_implicit_method_is_stable_on_stiff_friction() {
    for (method, _) in METHODS {
        let ([y, _], _) = run(method, 1e4, 50);
        let exact = 1.0 + 1.0_f64.sin();
        if let Method::Rosenbrock(_) = method {
            // Measured 3e-3, as y' = cos t - 30 sin(y) / D.
            assert!((y - exact).abs() < 5e-3, "{y} {exact}");
        } else {
            assert!(y.is_nan() || (y - exact).abs() > 1e3, "{y}");
        }
    }
}

/// y' = -rate y, beside a component at rest.
struct Decay {
    rate: f64,
}

impl System<2> for Decay {
    fn rhs(&mut self, _: f64, y: &[f64; 2], dy: &mut [f64; 2]) -> Result<(), Termination> {
        *dy = [-self.rate * y[0], 0.0];
        Ok(())
    }

    fn factor(&mut self, _: &[f64; 2], _: f64) -> Result<(), Termination> {
        Err(Termination::Singular)
    }

    fn solve(&mut self, _: &mut [f64; 2]) -> Result<(), Termination> {
        Err(Termination::Singular)
    }
}

/// One step of `dop853` of length 1 from y = 1 and its estimated error.
fn decay(h_rho: f64, tolerance: f64) -> (TimeStep<2>, f64) {
    let (method, mut system) = (Method::dop853(tolerance), Decay { rate: h_rho });
    let mut step = TimeStep::new(&[Size::UNIT; 2], &[]);
    let (y, mut dy) = ([1.0, 0.0], [0.0; 2]);
    system.rhs(0.0, &y, &mut dy).expect("linear");
    step.attempt(method, &mut system, start(0.0, &y, &dy), 1.0)
        .expect("linear");
    let error = step.error(method);
    (step, error)
}

/// The method's own error estimate has a zero near h rho = 5.6, where the true error is 24 %. With the estimate of the
/// fastest rate no step with an error above the tolerance is accepted, and none that follows an accepted one is longer
/// than h rho = 5.
#[test]
fn steps_are_not_accepted_where_the_error_estimate_vanishes() {
    let tolerance = 1e-3;
    for i in 1..=1200 {
        let h_rho = 0.01 * f64::from(i);
        let (step, error) = decay(h_rho, tolerance);
        let true_error = (step.y1[0] - (-h_rho).exp()).abs();
        if error <= 1.0 {
            // Measured 0.011 of the tolerance.
            assert!(true_error < tolerance, "{h_rho}: {true_error}");
        }
        let next = h_rho * step.factor(Method::dop853(tolerance), error.min(1.0));
        // Measured 5.00. A factor is at least 0.2.
        assert!(h_rho > 25.0 || next < 5.01, "{h_rho}: {next}");
    }
}

/// The defect of the dense output is of the order of its local error, 8, and zero at the end.
#[test]
fn the_defect_measures_the_dense_output() {
    let defect = |h_rho: f64, theta: f64| {
        let (mut step, _) = decay(h_rho, 1.0);
        let mut system = Decay { rate: h_rho };
        step.make_dense(Method::dop853(1.0), &mut system)
            .expect("linear");
        let mut dy = [0.0; 2];
        system.rhs(theta, &step.at(theta), &mut dy).expect("linear");
        step.defect(theta, &dy, 1.0)
    };
    for theta in [0.2, 0.5, 0.8] {
        let order = (defect(0.5, theta) / defect(0.25, theta)).log2();
        // Measured 7.62, 8.49 and 8.01.
        assert!((order - 8.0).abs() < 1.0, "{theta}: {order}");
    }
    assert!(defect(1.0, 1.0) < 1e-14);
}
