//! Joint torques of the rigid arm: the recursive Newton–Euler method in the links' own frames (Luh, Walker and Paul 1980;
//! Craig, Introduction to Robotics, ch. 6, whose modified Denavit–Hartenberg frames these are).

use crate::arm::Arm;
use crate::geometry::trig::sin_cos;
use hal::wire_struct;
use nalgebra::Vector3;

/// Standard gravity, m/s² (CGPM 1901); Σ_B's z points up.
pub const GRAVITY: f32 = 9.806_65;

/// Mass distribution of one link, in its own frame i.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LinkInertia {
    /// Mass, kg.
    pub mass: f32,
    /// Centre of mass, m.
    pub centre: [f32; 3],
    /// Inertia about the centre of mass along the frame's axes: xx, yy, zz, xy, xz, yz, kg·m².
    pub inertia: [f32; 6],
}

wire_struct!(LinkInertia {
    mass: f32,
    centre: [f32; 3],
    inertia: [f32; 6]
});

/// Torques (N·m, joint-side) that move the arm through angles `q` (rad) with velocities `dq` (rad/s) and accelerations `ddq`
/// (rad/s²) against inertia, Coriolis forces and gravity; without friction and without the motors' rotors.
pub fn inverse_dynamics<const N: usize>(
    arm: &Arm<N>,
    links: &[LinkInertia; N],
    q: &[f32; N],
    dq: &[f32; N],
    ddq: &[f32; N],
) -> [f32; N] {
    let zero = Vector3::zeros();
    let mut steps = [Step::default(); N];
    let (mut spin, mut turn) = (zero, zero); // angular velocity and acceleration of the link, in its frame
    let mut push = Vector3::new(0.0, 0.0, GRAVITY); // acceleration of its origin, gravity as if the base were lifted
    for (i, step) in steps.iter_mut().enumerate() {
        let link = &arm.links[i];
        let (sin, cos) = sin_cos(q[i]);
        *step = Step {
            twist: (link.twist_cos, link.twist_sin),
            turn: (cos, sin),
            origin: Vector3::new(link.a, -link.d * link.twist_sin, link.d * link.twist_cos),
            ..Step::default()
        };
        push = step.down(&(push + cross(&turn, &step.origin) + cross(&spin, &cross(&spin, &step.origin))));
        let carried = step.down(&spin);
        spin = carried + Vector3::new(0.0, 0.0, dq[i]);
        turn = step.down(&turn) + Vector3::new(carried.y * dq[i], -carried.x * dq[i], ddq[i]);

        let body = &links[i];
        let c = Vector3::new(body.centre[0], body.centre[1], body.centre[2]);
        step.force = (push + cross(&turn, &c) + cross(&spin, &cross(&spin, &c))) * body.mass;
        step.moment = body.times(&turn) + cross(&spin, &body.times(&spin)) + cross(&c, &step.force);
    }

    let mut torques = [0.0; N];
    let (mut force, mut moment) = (zero, zero); // what the outer links ask of this one, in its frame
    for (torque, step) in torques.iter_mut().zip(&steps).rev() {
        let (total_force, total_moment) = (step.force + force, step.moment + moment);
        *torque = total_moment.z;
        force = step.up(&total_force);
        moment = step.up(&total_moment) + cross(&step.origin, &force);
    }
    torques
}

/// One joint's step from frame i−1 to frame i, and what link i's own motion asks for.
#[derive(Clone, Copy, Default)]
struct Step {
    /// Cosine and sine of the twist about x_{i−1}.
    twist: (f32, f32),
    /// Cosine and sine of the joint angle about z_i.
    turn: (f32, f32),
    /// Origin of frame i in frame i−1, m.
    origin: Vector3<f32>,
    /// Force on link i, N, and moment about its frame's origin, N·m, both in frame i.
    force: Vector3<f32>,
    moment: Vector3<f32>,
}

impl Step {
    /// A vector of frame i−1 in frame i.
    fn down(&self, v: &Vector3<f32>) -> Vector3<f32> {
        let ((ca, sa), (ct, st)) = (self.twist, self.turn);
        let (y, z) = (ca * v.y + sa * v.z, ca * v.z - sa * v.y);
        Vector3::new(ct * v.x + st * y, ct * y - st * v.x, z)
    }

    /// A vector of frame i in frame i−1.
    fn up(&self, v: &Vector3<f32>) -> Vector3<f32> {
        let ((ca, sa), (ct, st)) = (self.twist, self.turn);
        let (x, y) = (ct * v.x - st * v.y, st * v.x + ct * v.y);
        Vector3::new(x, ca * y - sa * v.z, sa * y + ca * v.z)
    }
}

impl LinkInertia {
    /// The inertia matrix times `v`.
    fn times(&self, v: &Vector3<f32>) -> Vector3<f32> {
        let [xx, yy, zz, xy, xz, yz] = self.inertia;
        Vector3::new(
            xx * v.x + xy * v.y + xz * v.z,
            xy * v.x + yy * v.y + yz * v.z,
            xz * v.x + yz * v.y + zz * v.z,
        )
    }
}

fn cross(a: &Vector3<f32>, b: &Vector3<f32>) -> Vector3<f32> {
    Vector3::new(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::arm::sample::k3s;
    use proptest::prelude::*;

    /// Uneven on purpose, so that no term drops out.
    fn bodies() -> [LinkInertia; 6] {
        core::array::from_fn(|i| {
            let k = i as f32;
            LinkInertia {
                mass: 8.0 - 1.2 * k,
                centre: [0.1 - 0.03 * k, 0.02 * k, 0.05 - 0.02 * k],
                inertia: [0.05, 0.06, 0.04, 0.004, -0.003, 0.002 * k],
            }
        })
    }

    /// Kinetic and potential energy, from the frames alone.
    fn energy(q: &[f32; 6], dq: &[f32; 6]) -> (f64, f64) {
        let frames = k3s().frames(q);
        let (mut kinetic, mut potential) = (0.0, 0.0);
        for (i, body) in bodies().iter().enumerate() {
            let frame = frames.joints[i];
            let centre = frame * Vector3::from(body.centre);
            let jacobian = frames.jacobian_at(&centre);
            let (mut v, mut w) = (Vector3::<f32>::zeros(), Vector3::<f32>::zeros());
            for (j, dq) in dq.iter().enumerate().take(i + 1) {
                v += jacobian.fixed_view::<3, 1>(0, j) * *dq;
                w += jacobian.fixed_view::<3, 1>(3, j) * *dq;
            }
            let local = frame.r.transpose() * w;
            kinetic += 0.5 * (body.mass * v.dot(&v) + local.dot(&body.times(&local))) as f64;
            potential += (body.mass * GRAVITY * centre.z) as f64;
        }
        (kinetic, potential)
    }

    proptest! {
        /// d/dt (kinetic + potential) = τ·dq along any motion: inertia, Coriolis and gravity in one statement.
        #[test]
        fn the_torques_power_is_the_change_of_energy(
            q in prop::array::uniform6(-2.0f32..2.0), dq in prop::array::uniform6(-1.0f32..1.0), ddq in prop::array::uniform6(-2.0f32..2.0)
        ) {
            let torques = inverse_dynamics(&k3s(), &bodies(), &q, &dq, &ddq);
            let power: f32 = torques.iter().zip(&dq).map(|(t, v)| t * v).sum();
            let dt = 4e-3_f32;
            let at = |t: f32| {
                let q = core::array::from_fn(|i| q[i] + dq[i] * t + 0.5 * ddq[i] * t * t);
                let (kinetic, potential) = energy(&q, &core::array::from_fn(|i| dq[i] + ddq[i] * t));
                kinetic + potential
            };
            let rate = (at(dt) - at(-dt)) / (2.0 * dt as f64);
            prop_assert!((rate - power as f64).abs() < 2e-2 + 2e-3 * power.abs() as f64, "{rate} {power}");
        }

        #[test]
        fn the_mass_matrix_is_symmetric(q in prop::array::uniform6(-3.0f32..3.0)) {
            let still = [0.0; 6];
            let gravity = inverse_dynamics(&k3s(), &bodies(), &q, &still, &still);
            let column = |j: usize| {
                let unit = core::array::from_fn(|i| if i == j { 1.0 } else { 0.0 });
                let torques = inverse_dynamics(&k3s(), &bodies(), &q, &still, &unit);
                core::array::from_fn::<_, 6, _>(|i| torques[i] - gravity[i])
            };
            for i in 0..6 {
                for j in 0..i {
                    prop_assert!((column(i)[j] - column(j)[i]).abs() < 5e-5);
                }
            }
        }
    }
}
