//! Joint torques of the rigid arm: the recursive Newton–Euler method in the links' own frames (Luh, Walker and Paul 1980;
//! Craig, Introduction to Robotics, ch. 6, whose modified Denavit–Hartenberg frames these are).

use super::inertia::Body;
use crate::arm::{Arm, Link, Turns};
use crate::geometry::rotation::cross;
use nalgebra::Vector3;

/// Standard gravity, m/s² (CGPM 1901); Σ_B's z points up.
pub const GRAVITY: f32 = 9.806_65;

impl Body {
    /// Force (N) on the body and moment (N·m) about its frame's origin, when that origin is accelerated by `push` and the body turns so that
    /// its points are accelerated by `field` times their place.
    fn ask(&self, push: &Vector3<f32>, field: &Field) -> (Vector3<f32>, Vector3<f32>) {
        let (Field { x, y, z }, [u, v], [xx, yy, xy, xz, yz]) = (field, self.first, self.second);
        let force = Vector3::new(x.x * u + x.y * v, y.x * u + y.y * v, z.x * u + z.y * v);
        // ∫ r × (field·r), the antisymmetric part of field times second moments, and first moment × push.
        let moment = Vector3::new(
            (z.x * xy + z.y * yy + z.z * yz) - (y.x * xz + y.y * yz) + v * push.z,
            (x.x * xz + x.y * yz) - (z.x * xx + z.y * xy + z.z * xz) - u * push.z,
            (y.x * xx + y.y * xy + y.z * xz) - (x.x * xy + x.y * yy + x.z * yz) + (u * push.y - v * push.x),
        );
        (force, moment)
    }

    /// Moment (N·m) about z alone, when the body turns about its frame's z with this angular acceleration (rad/s²) and no other spin.
    fn ask_about_z(&self, push: &Vector3<f32>, turn: f32) -> f32 {
        let ([xx, yy, ..], [x, y]) = (self.second, self.first);
        turn * (xx + yy) + (x * push.y - y * push.x)
    }
}

/// Torques (N·m, joint-side) that move the arm through the angles of `turns` with velocities `dq` (rad/s) and accelerations `ddq`
/// (rad/s²) against inertia, Coriolis forces and gravity; without friction and without the motors' rotors.
#[inline(never)] // on its own it has all registers
pub fn inverse_dynamics<const N: usize>(
    arm: &Arm<N>,
    bodies: &[Body; N],
    turns: &Turns<N>,
    dq: &[f32; N],
    ddq: &[f32; N],
) -> [f32; N] {
    let mut steps = [Step::default(); N];
    let mut joints = steps
        .iter_mut()
        .zip(&arm.links)
        .zip(bodies)
        .zip(turns.iter())
        .zip(dq.iter().zip(ddq));
    let mut torques = [0.0; N];
    // The first link turns about an axis that stands still: of all terms few are left, and of its own only the torque counts.
    let Some(((((_, link), body), sine_cosine), (dq, ddq))) = joints.next() else {
        return torques;
    };
    // Angular velocity and acceleration of the link, in its frame.
    let (mut spin, mut turn) = (Vector3::new(0.0, 0.0, *dq), Vector3::new(0.0, 0.0, *ddq));
    // Acceleration of its origin, gravity as if the base were lifted.
    let mut push = Joint::of(link, sine_cosine).down(&Vector3::new(0.0, 0.0, GRAVITY));
    let mut field = Field::of(&spin, &turn);
    let first = body.ask_about_z(&push, *ddq);
    for ((((step, link), body), sine_cosine), (dq, ddq)) in joints {
        let joint = Joint::of(link, sine_cosine);
        if has_offset(link) {
            push += field.at(&origin(link));
        }
        push = joint.down(&push);
        let carried = joint.down(&spin);
        spin = Vector3::new(carried.x, carried.y, carried.z + dq);
        turn = joint.down(&turn) + Vector3::new(carried.y * dq, -carried.x * dq, *ddq);
        field = Field::of(&spin, &turn);
        let (force, moment) = body.ask(&push, &field);
        *step = Step { force, moment };
    }

    let (mut force, mut moment) = (Vector3::zeros(), Vector3::zeros()); // what the outer links ask of this one, in its frame
    let outward = torques.iter_mut().zip(&steps).zip(&arm.links).zip(turns.iter());
    for (((torque, step), link), sine_cosine) in outward.skip(1).rev() {
        force += step.force;
        moment += step.moment;
        *torque = moment.z;
        let joint = Joint::of(link, sine_cosine);
        force = joint.up(&force);
        moment = joint.up(&moment);
        if has_offset(link) {
            moment += cross(&origin(link), &force);
        }
    }
    if let Some(torque) = torques.first_mut() {
        *torque = first + moment.z;
    }
    torques
}

/// Whether frame i stands off frame i−1: half of an arm's do not, where joint axes meet, and need no lever.
fn has_offset(link: &Link) -> bool {
    // By their bits, which takes two instructions; a negative zero only costs the lever.
    link.a.to_bits() | link.d.to_bits() != 0
}

/// Origin of frame i in frame i−1, m.
fn origin(link: &Link) -> Vector3<f32> {
    Vector3::new(link.a, -link.d * link.twist_sin, link.d * link.twist_cos)
}

/// How the acceleration of a turning body's points grows with their place in its frame, 1/s²: [α]× + [ω]×[ω]×, by rows (Balafoutis and
/// Patel 1991, "angular acceleration tensor"). Made once a link, it stands for each `α × r + ω × (ω × r)`.
struct Field {
    x: Vector3<f32>,
    y: Vector3<f32>,
    z: Vector3<f32>,
}

impl Field {
    /// Of angular velocity `spin` (rad/s) and acceleration `turn` (rad/s²).
    fn of(spin: &Vector3<f32>, turn: &Vector3<f32>) -> Self {
        let (xx, yy, zz) = (spin.x * spin.x, spin.y * spin.y, spin.z * spin.z);
        let (xy, xz, yz) = (spin.x * spin.y, spin.x * spin.z, spin.y * spin.z);
        Self {
            x: Vector3::new(-(yy + zz), xy - turn.z, xz + turn.y),
            y: Vector3::new(xy + turn.z, -(xx + zz), yz - turn.x),
            z: Vector3::new(xz - turn.y, yz + turn.x, -(xx + yy)),
        }
    }

    /// Times a place.
    fn at(&self, r: &Vector3<f32>) -> Vector3<f32> {
        let Self { x, y, z } = self;
        Vector3::new(
            x.x * r.x + x.y * r.y + x.z * r.z,
            y.x * r.x + y.y * r.y + y.z * r.z,
            z.x * r.x + z.y * r.y + z.z * r.z,
        )
    }
}

/// What the way out leaves for the way back, of one link.
#[derive(Clone, Copy, Default)]
struct Step {
    /// Force on link i, N, and moment about its frame's origin, N·m, both in frame i.
    force: Vector3<f32>,
    moment: Vector3<f32>,
}

/// One joint's rotation from frame i−1 to frame i.
struct Joint {
    /// Cosine and sine of the twist about x_{i−1}.
    twist: (f32, f32),
    /// Sine and cosine of the joint angle about z_i.
    turn: (f32, f32),
}

impl Joint {
    /// The one before `link`, with this sine and cosine of its angle.
    fn of(link: &Link, turn: (f32, f32)) -> Self {
        Self {
            twist: (link.twist_cos, link.twist_sin),
            turn,
        }
    }

    /// A vector of frame i−1 in frame i.
    fn down(&self, v: &Vector3<f32>) -> Vector3<f32> {
        let ((ca, sa), (st, ct)) = (self.twist, self.turn);
        let (y, z) = (ca * v.y + sa * v.z, ca * v.z - sa * v.y);
        Vector3::new(ct * v.x + st * y, ct * y - st * v.x, z)
    }

    /// A vector of frame i in frame i−1.
    fn up(&self, v: &Vector3<f32>) -> Vector3<f32> {
        let ((ca, sa), (st, ct)) = (self.twist, self.turn);
        let (x, y) = (ct * v.x - st * v.y, st * v.x + ct * v.y);
        Vector3::new(x, ca * y - sa * v.z, sa * y + ca * v.z)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::arm::sample::k3s;
    use crate::servo::inertia::LinkInertia;
    use nalgebra::Matrix3;
    use proptest::prelude::*;

    /// Uneven on purpose, so that no term drops out.
    fn masses() -> [(f32, [f32; 3], [f32; 6]); 6] {
        core::array::from_fn(|i| {
            let k = i as f32;
            let centre = [0.1 - 0.03 * k, 0.02 * k, 0.05 - 0.02 * k];
            (8.0 - 1.2 * k, centre, [0.05, 0.06, 0.04, 0.004, -0.003, 0.002 * k])
        })
    }

    fn bodies() -> [Body; 6] {
        let links = masses().map(|(mass, centre, inertia)| LinkInertia::new(mass, centre, inertia));
        Body::of_links(&k3s(), &links)
    }

    /// Kinetic and potential energy, from the frames alone.
    fn energy(q: &[f32; 6], dq: &[f32; 6]) -> (f64, f64) {
        let frames = k3s().frames(q);
        let (mut kinetic, mut potential) = (0.0, 0.0);
        for (i, (mass, centre, [xx, yy, zz, xy, xz, yz])) in masses().into_iter().enumerate() {
            let frame = frames.joints[i];
            let centre = frame * Vector3::from(centre);
            let jacobian = frames.jacobian_at(&centre);
            let (mut v, mut w) = (Vector3::<f32>::zeros(), Vector3::<f32>::zeros());
            for (j, dq) in dq.iter().enumerate().take(i + 1) {
                v += jacobian.fixed_view::<3, 1>(0, j) * *dq;
                w += jacobian.fixed_view::<3, 1>(3, j) * *dq;
            }
            let local = frame.r.transpose() * w;
            let inertia = Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz);
            kinetic += 0.5 * (mass * v.dot(&v) + local.dot(&(inertia * local))) as f64;
            potential += (mass * GRAVITY * centre.z) as f64;
        }
        (kinetic, potential)
    }

    proptest! {
        /// d/dt (kinetic + potential) = τ·dq along any motion: inertia, Coriolis and gravity in one statement.
        #[test]
        fn the_torques_power_is_the_change_of_energy(
            q in prop::array::uniform6(-2.0f32..2.0), dq in prop::array::uniform6(-1.0f32..1.0), ddq in prop::array::uniform6(-2.0f32..2.0)
        ) {
            let torques = inverse_dynamics(&k3s(), &bodies(), &Turns::of(&q), &dq, &ddq);
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
            let gravity = inverse_dynamics(&k3s(), &bodies(), &Turns::of(&q), &still, &still);
            let column = |j: usize| {
                let unit = core::array::from_fn(|i| if i == j { 1.0 } else { 0.0 });
                let torques = inverse_dynamics(&k3s(), &bodies(), &Turns::of(&q), &still, &unit);
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
