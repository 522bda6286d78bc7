//! The method has its order.

use skate_core::integrate::{Flow, dopri5::Step};

struct Pendulum;

impl Flow<2> for Pendulum {
    fn rhs(
        &mut self,
        _: f64,
        y: &[f64; 2],
        dy: &mut [f64; 2],
    ) -> Result<(), skate_core::error::EndCause> {
        *dy = [y[1], -y[0].sin()];
        Ok(())
    }
}

/// The pair converges with order 5, its dense output with order 4, within 0.25.
#[test]
fn the_method_has_its_order() {
    let run = |steps: u32| {
        let h = 1.0 / f64::from(steps);
        let mut y = [1.0, 0.5];
        let mut step = Step::new(&[1.0, 1.0]);
        let mut middle = y;
        for i in 0..steps {
            let mut dy = [0.0; 2];
            Pendulum.rhs(0.0, &y, &mut dy).expect("smooth");
            step.attempt(&mut Pendulum, (0.0, &y, &dy), h)
                .expect("smooth");
            if i == steps / 2 {
                step.make_dense();
                middle = step.at(0.5);
            }
            y = step.y1;
        }
        (y, middle)
    };
    let (exact, _) = run(4096);
    let error = |n: u32| (run(n).0[0] - exact[0]).abs();
    let order = (error(8) / error(32)).log2() / 2.0;
    assert!((order - 5.0).abs() < 0.25, "{order}");
    let dense = |n: u32| {
        let h = 1.0 / f64::from(n);
        let fine = {
            let mut y = [1.0, 0.5];
            let mut step = Step::new(&[1.0, 1.0]);
            let count = 4096;
            let h = (0.5 + 0.5 * h) / f64::from(count);
            for _ in 0..count {
                let mut dy = [0.0; 2];
                Pendulum.rhs(0.0, &y, &mut dy).expect("smooth");
                step.attempt(&mut Pendulum, (0.0, &y, &dy), h)
                    .expect("smooth");
                y = step.y1;
            }
            y
        };
        (run(n).1[0] - fine[0]).abs()
    };
    let order = (dense(8) / dense(32)).log2() / 2.0;
    // The continuous extension's local error is of order 5; it falls at least that fast.
    assert!(order > 3.75, "{order}");
}
