//! Kinematics and dynamics of the rigid chain in joint coordinates, in the links' own modified Denavit–Hartenberg frames.
//!
//! Forces: recursive Newton–Euler. Mass matrix: composite rigid bodies (Featherstone, Rigid Body Dynamics Algorithms, 6.2). Both
//! agree with Pinocchio (`scripts/dynamics_oracle.py`).

use nalgebra::{Isometry3, Matrix3, Rotation3, Translation3, UnitQuaternion, Vector3};

/// Standard gravity, m/s² (CGPM 1901), along −z of Σ_B.
pub const GRAVITY: f64 = 9.806_65;

/// One link: its row of the table (Craig) and its mass, in its own frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Link {
    /// a_{i−1}, m.
    pub a: f64,
    /// α_{i−1}, rad.
    pub twist: f64,
    /// d_i, m.
    pub d: f64,
    /// Mass, kg.
    pub mass: f64,
    /// Centre of mass, m.
    pub centre: Vector3<f64>,
    /// Inertia about the centre of mass: xx, yy, zz, xy, xz, yz, kg·m².
    pub inertia: [f64; 6],
}

/// The chain with its tool.
#[derive(Clone, Debug, PartialEq)]
pub struct Chain<const N: usize> {
    links: [Link; N],
    /// Sine and cosine of the links' twists.
    twists: [(f64, f64); N],
    tool: Isometry3<f64>,
}

/// Where frame i stands in frame i−1 at one angle.
#[derive(Clone, Copy)]
struct Step {
    r: Matrix3<f64>,
    p: Vector3<f64>,
}

impl<const N: usize> Chain<N> {
    /// Links, base first, and the pose of the tip in the last frame.
    pub fn new(links: [Link; N], tool: Isometry3<f64>) -> Self {
        Self {
            links,
            twists: links.map(|link| libm::sincos(link.twist)),
            tool,
        }
    }

    /// The links, base first.
    pub fn links(&self) -> &[Link; N] {
        &self.links
    }

    /// Multiplies mass and inertia of link `i` by the factors.
    pub(super) fn scale(&mut self, i: usize, mass: f64, inertia: f64) {
        self.links[i].mass *= mass;
        self.links[i].inertia.iter_mut().for_each(|e| *e *= inertia);
    }

    /// Pose of the tip in Σ_B at joint angles `q` (rad).
    pub fn tip(&self, q: &[f64; N]) -> Isometry3<f64> {
        let (mut r, mut p) = (Matrix3::identity(), Vector3::zeros());
        for step in self.steps(q) {
            p += r * step.p;
            r *= step.r;
        }
        let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(r));
        Isometry3::from_parts(Translation3::from(p), rotation) * self.tool
    }

    /// Linear (m/s) and angular (rad/s) velocity of the tip in Σ_B.
    pub fn tip_velocity(&self, q: &[f64; N], dq: &[f64; N]) -> (Vector3<f64>, Vector3<f64>) {
        let (mut r, mut v, mut w) = (Matrix3::identity(), Vector3::zeros(), Vector3::zeros());
        for (step, dq) in self.steps(q).iter().zip(dq) {
            v += w.cross(&(r * step.p));
            r *= step.r;
            w += r.column(2) * *dq;
        }
        (v + w.cross(&(r * self.tool.translation.vector)), w)
    }

    /// Mass matrix (kg·m²) and the torques (N·m) of Coriolis forces and gravity at `q` (rad), `dq` (rad/s).
    pub fn dynamics(&self, q: &[f64; N], dq: &[f64; N]) -> ([[f64; N]; N], [f64; N]) {
        let steps = self.steps(q);
        (self.mass_matrix(&steps), self.bias(&steps, dq))
    }

    fn steps(&self, q: &[f64; N]) -> [Step; N] {
        std::array::from_fn(|i| {
            let link = &self.links[i];
            // libm, not std: the platform's own sine may differ in its last bit from machine to machine.
            let (st, ct) = libm::sincos(q[i]);
            let (sa, ca) = self.twists[i];
            Step {
                r: Matrix3::new(ct, -st, 0.0, st * ca, ct * ca, -sa, st * sa, ct * sa, ca),
                p: Vector3::new(link.a, -sa * link.d, ca * link.d),
            }
        })
    }

    fn bias(&self, steps: &[Step; N], dq: &[f64; N]) -> [f64; N] {
        let zero = Vector3::zeros();
        let mut loads = [(zero, zero); N];
        let (mut w, mut alpha, mut a) = (zero, zero, Vector3::new(0.0, 0.0, GRAVITY));
        for i in 0..N {
            let (step, link) = (&steps[i], &self.links[i]);
            a = step.r.tr_mul(&(a + alpha.cross(&step.p) + w.cross(&w.cross(&step.p))));
            let carried = step.r.tr_mul(&w);
            alpha = step.r.tr_mul(&alpha) + Vector3::new(carried.y * dq[i], -carried.x * dq[i], 0.0);
            w = carried + Vector3::new(0.0, 0.0, dq[i]);
            let c = &link.centre;
            let force = link.mass * (a + alpha.cross(c) + w.cross(&w.cross(c)));
            let inertia = link.inertia_matrix();
            loads[i] = (force, inertia * alpha + w.cross(&(inertia * w)) + c.cross(&force));
        }
        let mut torques = [0.0; N];
        let (mut force, mut moment) = (zero, zero);
        for i in (0..N).rev() {
            let (f, n) = (loads[i].0 + force, loads[i].1 + moment);
            torques[i] = n.z;
            force = steps[i].r * f;
            moment = steps[i].r * n + steps[i].p.cross(&force);
        }
        torques
    }

    fn mass_matrix(&self, steps: &[Step; N]) -> [[f64; N]; N] {
        let mut matrix = [[0.0; N]; N];
        // The body of link i and all beyond it: mass, first moment, inertia about frame i's origin.
        let (mut mass, mut first, mut second) = (0.0, Vector3::zeros(), Matrix3::zeros());
        for i in (0..N).rev() {
            let link = &self.links[i];
            mass += link.mass;
            first += link.mass * link.centre;
            second += link.inertia_matrix() + link.mass * steiner(&link.centre);
            // Unit acceleration about z_i: what it asks of this body, carried inwards joint by joint.
            let mut force = Vector3::new(-first.y, first.x, 0.0);
            let mut moment = second.column(2).into_owned();
            matrix[i][i] = moment.z;
            for j in (0..i).rev() {
                force = steps[j + 1].r * force;
                moment = steps[j + 1].r * moment + steps[j + 1].p.cross(&force);
                matrix[i][j] = moment.z;
                matrix[j][i] = moment.z;
            }
            // The composite body in frame i−1.
            let (r, p) = (&steps[i].r, &steps[i].p);
            let turned = r * first;
            second = r * second * r.transpose() + shift(&turned, p) + mass * steiner(p);
            first = turned + mass * p;
        }
        matrix
    }
}

impl Link {
    fn inertia_matrix(&self) -> Matrix3<f64> {
        let [xx, yy, zz, xy, xz, yz] = self.inertia;
        Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz)
    }
}

/// c·c·1 − c·cᵀ: inertia of a unit mass at `c`.
fn steiner(c: &Vector3<f64>) -> Matrix3<f64> {
    shift(c, c) * 0.5
}

/// Mixed term of moving the reference point by `p` away from a body of first moment `f`: 2 f·p 1 − f·pᵀ − p·fᵀ.
fn shift(f: &Vector3<f64>, p: &Vector3<f64>) -> Matrix3<f64> {
    let outer = f * p.transpose();
    Matrix3::from_diagonal_element(2.0 * f.dot(p)) - outer - outer.transpose()
}
