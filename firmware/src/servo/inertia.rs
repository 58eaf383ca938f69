//! Masses of the links, and what of them an arm's motion can tell apart.
//!
//! Mass on a joint's axis does not notice which of the two links carries it. So of each link what lies on its axis (mass, first and
//! second moment along z) is counted with the link before, until seven numbers of ten are left that joint torques depend on (Gautier and
//! Khalil 1990, base inertial parameters; here for moments of mass, where the rule is that of a few point masses on a line).

use crate::arm::{Arm, Link};
use hal::wire_struct;

/// Mass distribution of one link, in its own frame i: the three moments of mass, about the frame's origin.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LinkInertia {
    /// Mass, kg.
    pub mass: f32,
    /// First moment, mass times centre of mass, kg·m.
    pub first: [f32; 3],
    /// Second moments ∫x², ∫y², ∫z², ∫xy, ∫xz, ∫yz over the mass, kg·m².
    pub second: [f32; 6],
}

impl LinkInertia {
    /// From the `mass` (kg), its `centre` (m, frame i), and the entries xx, yy, zz, xy, xz, yz of its inertia matrix about that centre along
    /// the frame's axes (kg·m²).
    pub fn new(mass: f32, centre: [f32; 3], inertia: [f32; 6]) -> Self {
        let ([x, y, z], [xx, yy, zz, xy, xz, yz]) = (centre, inertia);
        Self {
            mass,
            first: [mass * x, mass * y, mass * z],
            second: [
                0.5 * (yy + zz - xx) + mass * x * x,
                0.5 * (xx + zz - yy) + mass * y * y,
                0.5 * (xx + yy - zz) + mass * z * z,
                mass * x * y - xy,
                mass * x * z - xz,
                mass * y * z - yz,
            ],
        }
    }

    /// Takes on what lies on the axis of the joint at the far end, that of `link` and `outer`.
    fn take_axis_of(&mut self, link: &Link, outer: &Self) {
        let ([_, _, along], [_, _, square, ..]) = (outer.first, outer.second);
        // The axis in this frame: (a, 0, 0) + (d + z)·u.
        let (a, d) = (link.a, link.d);
        let (v, w) = (-link.twist_sin, link.twist_cos); // u = (0, v, w)
        let (mass, once) = (outer.mass, outer.mass * d + along);
        let twice = outer.mass * d * d + 2.0 * along * d + square;
        self.mass += mass;
        let [x, y, z] = &mut self.first;
        *x += mass * a;
        *y += once * v;
        *z += once * w;
        let [xx, yy, zz, xy, xz, yz] = &mut self.second;
        *xx += mass * a * a;
        *yy += twice * v * v;
        *zz += twice * w * w;
        *xy += a * once * v;
        *xz += a * once * w;
        *yz += twice * v * w;
    }
}

/// What of a link's mass distribution is left when what lies on its joint's axis is counted with the link before.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Body {
    /// First moments ∫x, ∫y, kg·m.
    pub first: [f32; 2],
    /// Second moments ∫x², ∫y², ∫xy, ∫xz, ∫yz, kg·m².
    pub second: [f32; 5],
}

wire_struct!(Body {
    first: [f32; 2],
    second: [f32; 5]
});

impl Body {
    /// Those of an arm's links, base first.
    pub fn of_links<const N: usize>(arm: &Arm<N>, links: &[LinkInertia; N]) -> [Self; N] {
        let mut bodies = [Self::default(); N];
        let mut outer: Option<(&Link, LinkInertia)> = None;
        for ((body, own), link) in bodies.iter_mut().zip(links).zip(&arm.links).rev() {
            let mut whole = *own;
            if let Some((link, outer)) = &outer {
                whole.take_axis_of(link, outer);
            }
            let ([x, y, _], [xx, yy, _, xy, xz, yz]) = (whole.first, whole.second);
            *body = Self {
                first: [x, y],
                second: [xx, yy, xy, xz, yz],
            };
            outer = Some((link, whole));
        }
        bodies
    }
}
