//! Joint coordinates and actuator coordinates.
//!
//! In a parallelogram arm both base motors stand in the shoulder: one turns the upper arm (θ₁), the other, through a crank,
//! the forearm's absolute pitch θ₁₂ = θ₁ − θ₂. So the drives turn (θ₀, θ₁, θ₁₂, θ₃, θ₄, θ₅), and θ₂ = θ₁ − θ₁₂ is derived.
//! In general here: actuator i turns `own·q_i + carry·q_{i−1}` with own = ±1.

use hal::wire_struct;

/// How the actuators' angles follow from the joints': lower bidiagonal, with unit determinant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Coupling<const N: usize> {
    /// Coefficient of the joint of the same number: +1 or −1.
    pub own: [f32; N],
    /// Coefficient of the joint before; the first is not used.
    pub carry: [f32; N],
}

wire_struct!(Coupling<const N: usize> { own: [f32; N], carry: [f32; N] });

impl<const N: usize> Coupling<N> {
    /// Every actuator turns its own joint.
    pub fn direct() -> Self {
        Self {
            own: [1.0; N],
            carry: [0.0; N],
        }
    }

    /// Actuator number `elbow` turns the absolute angle q_{elbow−1} − q_{elbow}; the others their own joints.
    pub fn parallel_link(elbow: usize) -> Self {
        Self {
            own: core::array::from_fn(|i| if i == elbow { -1.0 } else { 1.0 }),
            carry: core::array::from_fn(|i| if i == elbow { 1.0 } else { 0.0 }),
        }
    }

    /// Joint angles (or velocities, accelerations) to the actuators'.
    pub fn to_actuators(&self, joints: &[f32; N]) -> [f32; N] {
        let mut before = 0.0;
        let mut actuators = *joints;
        for (actuator, (own, carry)) in actuators.iter_mut().zip(self.rows()) {
            let joint = *actuator;
            *actuator = own * joint + carry * before;
            before = joint;
        }
        actuators
    }

    /// (own, carry) of each actuator, for who goes through several quantities at once.
    pub fn rows(&self) -> impl DoubleEndedIterator<Item = (f32, f32)> + ExactSizeIterator + '_ {
        self.own.iter().copied().zip(self.carry.iter().copied())
    }

    /// Actuator angles (or velocities, accelerations) to the joints'.
    pub fn to_joints(&self, actuators: &[f32; N]) -> [f32; N] {
        let mut before = 0.0;
        core::array::from_fn(|i| {
            before = self.own[i] * (actuators[i] - self.carry[i] * before);
            before
        })
    }

    /// Joint torques to actuator torques of the same power: the transpose of [`Self::to_joints`].
    pub fn torques_to_actuators(&self, joints: &[f32; N]) -> [f32; N] {
        let mut actuators = *joints;
        let mut carried = 0.0; // what the next actuator's torque already exerts on this joint
        for (torque, (own, carry)) in actuators.iter_mut().zip(self.rows()).rev() {
            *torque = own * (*torque - carried);
            carried = carry * *torque;
        }
        actuators
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn turning_only_the_shoulder_motor_keeps_the_forearms_pitch() {
        let k3s = Coupling::<6>::parallel_link(2);
        let joints = k3s.to_joints(&[0.1, -1.5, -1.6, 0.3, -1.5, 0.5]);
        assert!((joints[2] - 0.1).abs() < 1e-6, "θ2 = θ1 − θ12 = 0.1 rad");
        let moved = k3s.to_joints(&[0.1, -1.3, -1.6, 0.3, -1.5, 0.5]);
        assert!((moved[2] - 0.3).abs() < 1e-6, "θ2 follows θ1 by the same 0.2 rad");
    }

    proptest! {
        #[test]
        fn joints_and_actuators_convert_both_ways(q in prop::array::uniform6(-3.0f32..3.0)) {
            let k3s = Coupling::<6>::parallel_link(2);
            let back = k3s.to_joints(&k3s.to_actuators(&q));
            for (a, b) in q.iter().zip(&back) {
                prop_assert!((a - b).abs() < 1e-6);
            }
        }

        #[test]
        fn power_is_the_same_on_both_sides(v in prop::array::uniform6(-3.0f32..3.0), torque in prop::array::uniform6(-9.0f32..9.0)) {
            let k3s = Coupling::<6>::parallel_link(2);
            let joint_side: f32 = v.iter().zip(&torque).map(|(v, t)| v * t).sum();
            let motor_side: f32 = k3s.to_actuators(&v).iter().zip(&k3s.torques_to_actuators(&torque)).map(|(v, t)| v * t).sum();
            prop_assert!((joint_side - motor_side).abs() < 1e-4);
        }
    }
}
