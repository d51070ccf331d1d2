//! Joints of rigid bodies: two rods that swing on each other, and a rod on a hinge that is struck.

use crate::{
    case::Figures,
    solve::{Solved, model, run},
};

/// Gravity of the double pendulum (m/s2): strong, so that it swings within few cycles.
const GRAVITY: f64 = 9810.0;

/// Two rods of 0.2 m in a row, which begin level: the first on a hinge in space, the second on the end of the first.
const DOUBLE: &str = r#"
    title = "double pendulum"
    units = "SI"
    [control]
    end_time = 0.02
    [gravity]
    acceleration = [0, 0, -9810]
    [[part]]
    name = "upper"
    material = "STEEL_4340"
    box = { origin = [0, -0.01, -0.01], size = [0.2, 0.02, 0.02], cells = [10, 1, 1] }
    [[part]]
    name = "lower"
    material = "STEEL_4340"
    box = { origin = [0.21, -0.01, -0.01], size = [0.2, 0.02, 0.02], cells = [10, 1, 1] }
    [[rigid]]
    parts = ["upper"]
    [[rigid]]
    parts = ["lower"]
    [[joint]]
    type = "revolute"
    bodies = ["upper"]
    point = [0, 0, 0]
    axis = [0, 1, 0]
    [[joint]]
    type = "revolute"
    bodies = ["upper", "lower"]
    point = [0.205, 0, 0]
    axis = [0, 1, 0]
    "#;

pub(super) fn a_double_pendulum_follows_lagranges_equations(figures: &mut Figures) {
    let solved = run(model(DOUBLE));
    let [upper, lower] = &solved.model.setup.bodies[..] else { panic!("two bodies") };
    let pendulum = Pendulum {
        mass: [upper.mass, lower.mass],
        // About the axis of y through each centre.
        inertia: [upper.inertia[1], lower.inertia[1]],
        centre: [upper.start.centre[0], lower.start.centre[0] - 0.205],
        joint: 0.205,
    };
    let level = 0.5 * std::f64::consts::PI;
    let mut state = [level, level, 0.0, 0.0];
    let steps = 20_000;
    for _ in 0..steps {
        state = pendulum.step(state, solved.state.time / f64::from(steps));
    }
    let wanted = {
        let joint = [pendulum.joint * state[0].sin(), -pendulum.joint * state[0].cos()];
        [joint[0] + pendulum.centre[1] * state[1].sin(), joint[1] - pendulum.centre[1] * state[1].cos()]
    };
    let found = solved.outcome.run_totals.bodies[1].centre;
    let off = (found[0] - wanted[0]).hypot(found[2] - wanted[1]);
    println!("{} cycles; the lower rod is at {found:?}, angles {state:?}", solved.state.cycle);
    figures.add("double pendulum: place of the lower rod over its length", off / 0.2);
    figures.add("double pendulum: energy", solved.rows.last().expect("rows").error.abs());
}

/// Two rods in a plane: masses, inertias about their centres, distances of the centres from the joints above them, and of the
/// second joint from the first.
struct Pendulum {
    mass: [f64; 2],
    inertia: [f64; 2],
    centre: [f64; 2],
    joint: f64,
}

impl Pendulum {
    /// Rates of two angles from the plumb and of their rates.
    fn rates(&self, [p, q, u, v]: [f64; 4]) -> [f64; 4] {
        let ([m, n], [a, b], l) = (self.mass, self.centre, self.joint);
        let coupling = n * l * b;
        let (sine, cosine) = (p - q).sin_cos();
        let first = self.inertia[0] + m * a * a + n * l * l;
        let second = self.inertia[1] + n * b * b;
        let right = [
            -coupling * sine * v * v - (m * a + n * l) * GRAVITY * p.sin(),
            coupling * sine * u * u - n * b * GRAVITY * q.sin(),
        ];
        let cross = coupling * cosine;
        let determinant = first * second - cross * cross;
        [
            u,
            v,
            (right[0] * second - cross * right[1]) / determinant,
            (right[1] * first - cross * right[0]) / determinant,
        ]
    }

    /// A step of Runge and Kutta's of fourth order.
    fn step(&self, state: [f64; 4], dt: f64) -> [f64; 4] {
        let moved = |by: [f64; 4], share: f64| std::array::from_fn(|i| state[i] + share * dt * by[i]);
        let a = self.rates(state);
        let b = self.rates(moved(a, 0.5));
        let c = self.rates(moved(b, 0.5));
        let d = self.rates(moved(c, 1.0));
        std::array::from_fn(|i| state[i] + dt / 6.0 * (a[i] + 2.0 * b[i] + 2.0 * c[i] + d[i]))
    }
}

/// A rod of 300 mm on a hinge at its upper end, which a block of lead strikes so many millimetres below the hinge.
fn struck(distance: f64) -> Solved {
    run(model(&format!(
        r#"
        title = "a rod on a hinge is struck"
        units = "mm-ms-kg"
        [control]
        end_time = 0.1
        [[part]]
        name = "rod"
        material = "STEEL_4340"
        box = {{ origin = [0, -10, -300], size = [20, 20, 300], cells = [2, 2, 30] }}
        [[part]]
        name = "block"
        material = "LEAD"
        velocity = [20, 0, 0]
        box = {{ origin = [-20.5, -8, {}], size = [20, 16, 16], cells = [5, 4, 4] }}
        [[rigid]]
        parts = ["rod"]
        [[joint]]
        name = "hinge"
        type = "revolute"
        bodies = ["rod"]
        point = [10, 0, 0]
        axis = [0, 1, 0]
        [contact]
        [output]
        history_cycles = 1
        contact_forces = [["rod", "block"]]
        "#,
        -distance - 8.0
    )))
}

pub(super) fn a_rod_on_a_hinge_is_struck_at_and_off_its_centre_of_percussion(figures: &mut Figures) {
    for (distance, title) in
        [(100.0, "a third down"), (200.0, "at the centre of percussion"), (280.0, "near its end")]
    {
        let solved = struck(distance);
        let body = &solved.model.setup.bodies[0];
        let mut impulses = [0.0; 2];
        for pair in solved.rows.windows(2) {
            let half_steps = 0.5 * (pair[0].dt + pair[1].dt);
            impulses[0] += pair[1].contacts.first().map_or(0.0, |(_, contact)| contact.force[0]) * half_steps;
            // The hinge holds the rod by what the rod gives space.
            impulses[1] -= pair[1].joints[0][0][0] * half_steps;
        }
        // By the moment about the hinge: J_hinge / J = m a d / I - 1.
        let arm = -body.start.centre[2];
        let inertia = body.inertia[1] + body.mass * arm * arm;
        let wanted = body.mass * arm * distance / inertia - 1.0;
        println!(
            "{title}: impulses {impulses:?}, their ratio {}, wanted {wanted}",
            impulses[1] / impulses[0]
        );
        figures.add(
            &format!("struck rod: impulse of its hinge over that of the block @ {title}"),
            impulses[1] / impulses[0] - wanted,
        );
    }
}
