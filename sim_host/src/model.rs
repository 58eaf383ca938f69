//! The robot model: one TOML file that says everything about an arm, and what each part of the program takes from it.
//!
//! The same numbers make the controller's [`Arm`] and [`Servo`] (f32, what the controller believes) and the plant's
//! [`PlantModel`] (f64, what the arm is); the plant's may be disturbed afterwards.

mod check;
mod file;

use check::Axes;
pub use check::{ModelError, line_of};
use file::ModelFile;

use crate::plant::{Chain, Friction, Link, PlantModel};
use firmware::{
    arm::{Arm, Coupling, JointRange, Link as Row},
    geometry::{Pose, rotation::rot_x},
    servo::{
        axes::{DriveMode, Servo},
        drive::DriveScale,
        feedforward::Dynamics,
        inertia::{Body, LinkInertia},
        pid::Gains,
    },
};
use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use std::{f64::consts::TAU, path::Path};

/// Number of axes of the sealing arm.
pub const AXES: usize = 6;
/// Number of axes of the second arm.
pub const SECOND_AXES: usize = 5;

const K3S: &str = include_str!("../models/k3s.toml");
const SECOND: &str = include_str!("../models/second.toml");

/// A validated robot model.
#[derive(Clone, Debug)]
pub struct Model<const N: usize = AXES> {
    file: ModelFile,
    each: Axes<N>,
}

/// What a servo drive is delivered with: the motor's data, motor-side.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MotorData {
    /// Rated torque, N·m.
    pub rated_torque: f64,
    /// Peak torque, N·m.
    pub peak_torque: f64,
    /// Rated speed, rad/s.
    pub rated_speed: f64,
    /// Greatest speed, rad/s.
    pub max_speed: f64,
    /// Rotor inertia, kg·m².
    pub rotor_inertia: f64,
    /// Rotor and load seen by the motor at the home pose, kg·m²: what a speed loop is tuned for.
    pub total_inertia: f64,
    /// Encoder counts per turn.
    pub encoder_counts: u32,
    /// Turns of the motor per turn of the actuator.
    pub gear: f64,
}

impl Model {
    /// The K3S that is built in.
    pub fn k3s() -> Self {
        Self::read(K3S).expect("the built-in model is valid: a test reads it")
    }

    /// `robot` is the name of a built-in model ("k3s") or the path of a model file.
    pub fn named(robot: &str) -> Result<Self, ModelError> {
        if robot.eq_ignore_ascii_case("k3s") {
            return Ok(Self::k3s());
        }
        let text = std::fs::read_to_string(Path::new(robot)).map_err(|e| ModelError::Unreadable {
            path: robot.to_owned(),
            reason: e.to_string(),
        })?;
        Self::parse(&text)
    }

    /// From the text of a model file.
    pub fn parse(text: &str) -> Result<Self, ModelError> {
        Self::read(text)
    }

    /// The gains of the thesis's Table 1 on this arm's motors and gears: 6 V is rated torque. Kept to be reported.
    pub fn table_1_gains(&self) -> [Gains; AXES] {
        let period = self.file.servo.period_s as f32;
        let motors = self.motors_data();
        std::array::from_fn(|i| {
            let torque_per_volt = motors[i].rated_torque / 6.0 * motors[i].gear;
            Gains::table_1(firmware::servo::pid::TABLE_1[i], torque_per_volt as f32, period)
        })
    }
}

impl Model<SECOND_AXES> {
    /// The five-axis arm that is built in.
    pub fn second() -> Self {
        Self::read(SECOND).expect("the built-in model is valid: a test reads it")
    }
}

impl<const N: usize> Model<N> {
    fn read(text: &str) -> Result<Self, ModelError> {
        let file: ModelFile = toml::from_str(text).map_err(|e| ModelError::syntax(text, &e))?;
        let each = check::check(&file)?;
        Ok(Self { file, each })
    }

    /// The model's name.
    pub fn name(&self) -> &str {
        &self.file.name
    }

    /// Names of the axes, base first.
    pub fn axis_names(&self) -> [&str; N] {
        self.each.axes.each_ref().map(|x| x.name.as_str())
    }

    /// Joint angles of the home pose, rad.
    pub fn home(&self) -> [f64; N] {
        self.each.home
    }

    /// Distance of the sensor's origin ahead of the tip along x_N, m.
    pub fn sensor_lead(&self) -> f64 {
        self.file.sensor.lead_m
    }

    /// The controller's geometry.
    pub fn arm(&self) -> Arm<N> {
        let tool = &self.file.tool;
        let mut turn = rot_x(tool.turn_about_x_deg.to_radians() as f32);
        // A half turn is meant exactly; its f32 angle misses by 9e-8.
        turn.iter_mut().for_each(|e| *e = if e.abs() < 1e-6 { 0.0 } else { *e });
        Arm {
            links: self
                .each
                .axes
                .each_ref()
                .map(|x| Row::craig(x.a as f32, x.twist_deg.to_radians() as f32, x.d as f32)),
            tool: Pose {
                r: turn,
                p: Vector3::from(tool.tip_m).map(|e| e as f32),
            },
            ranges: self.each.axes.each_ref().map(|x| {
                let [min, max] = x.range_deg.map(|e| e.to_radians() as f32);
                JointRange { min, max }
            }),
            coupling: match self.file.parallel_link_elbow {
                Some(elbow) => Coupling::parallel_link(elbow),
                None => Coupling::direct(),
            },
        }
    }

    /// What the controller believes of the dynamics.
    pub fn dynamics(&self) -> Dynamics<N> {
        let friction = self.friction();
        let links = self
            .each
            .axes
            .each_ref()
            .map(|x| LinkInertia::new(x.mass as f32, x.centre.map(|e| e as f32), x.inertia.map(|e| e as f32)));
        Dynamics {
            bodies: Body::of_links(&self.arm(), &links),
            rotor: self.rotor().map(|e| e as f32),
            viscous: friction.map(|f| f.viscous as f32),
            coulomb: friction.map(|f| f.coulomb as f32),
        }
    }

    /// The servo in the file's drive mode.
    pub fn servo(&self) -> Servo<N> {
        self.servo_in(self.file.servo.mode.into())
    }

    /// The servo in `mode`, with the gains that the file gives for it. Encoders count zero at actuator angle zero.
    pub fn servo_in(&self, mode: DriveMode) -> Servo<N> {
        let settings = &self.file.servo;
        let gains = match mode {
            DriveMode::Velocity => self.each.velocity_proportional.map(|k| Gains {
                proportional: k as f32,
                integral: 0.0,
                derivative: 0.0,
            }),
            DriveMode::Torque => {
                let omega = settings.torque_omega as f32;
                self.total_inertia()
                    .map(|j| Gains::pole_placement(j as f32, omega, settings.torque_zeta as f32, 0.1 * omega))
            }
        };
        Servo {
            mode,
            period: settings.period_s as f32,
            gains,
            drives: self.motors_data().map(|m| DriveScale {
                counts_per_rad: (m.encoder_counts as f64 * m.gear / TAU) as f32,
                zero: 0,
                rated_torque: (m.rated_torque * m.gear) as f32,
                peak_torque: (m.peak_torque * m.gear) as f32,
                max_speed: (m.max_speed / m.gear) as f32,
            }),
            dynamics: self.dynamics(),
            feedforward: settings.feedforward,
        }
    }

    /// The motors, base first.
    pub fn motors_data(&self) -> [MotorData; N] {
        const RPM: f64 = TAU / 60.0;
        let total = self.total_inertia();
        std::array::from_fn(|i| {
            let (motor, gear) = (&self.each.motors[i], self.each.axes[i].gear);
            MotorData {
                rated_torque: motor.rated_torque,
                peak_torque: motor.peak_torque,
                rated_speed: motor.rated_speed_rpm * RPM,
                max_speed: motor.max_speed_rpm * RPM,
                rotor_inertia: motor.rotor_inertia,
                total_inertia: total[i] / (gear * gear),
                encoder_counts: motor.encoder_counts,
                gear,
            }
        })
    }

    /// What the arm is, undisturbed.
    pub fn plant(&self) -> PlantModel<N> {
        let tool = &self.file.tool;
        PlantModel {
            chain: Chain::new(
                self.each.axes.each_ref().map(|x| Link {
                    a: x.a,
                    twist: x.twist_deg.to_radians(),
                    d: x.d,
                    mass: x.mass,
                    centre: Vector3::from(x.centre),
                    inertia: x.inertia,
                }),
                Isometry3::from_parts(
                    Translation3::from(tool.tip_m),
                    UnitQuaternion::from_axis_angle(&Vector3::x_axis(), tool.turn_about_x_deg.to_radians()),
                ),
            ),
            elbow: self.file.parallel_link_elbow,
            gear: self.each.axes.each_ref().map(|x| x.gear),
            rotor: self.rotor(),
            friction: self.friction(),
            brake: std::array::from_fn(|i| self.each.motors[i].brake_torque * self.each.axes[i].gear),
            torque_constant: [1.0; N],
        }
    }

    /// Rotor inertias seen at the actuators, kg·m².
    fn rotor(&self) -> [f64; N] {
        std::array::from_fn(|i| self.each.motors[i].rotor_inertia * self.each.axes[i].gear * self.each.axes[i].gear)
    }

    /// Inertia of rotor and load seen at the actuators at the home pose, kg·m².
    fn total_inertia(&self) -> [f64; N] {
        let mass = self.plant().mass_matrix(&self.each.home);
        std::array::from_fn(|i| mass[(i, i)])
    }

    /// Friction at the actuators.
    fn friction(&self) -> [Friction; N] {
        const RPM: f64 = TAU / 60.0;
        std::array::from_fn(|i| {
            let (axis, motor) = (&self.each.axes[i], &self.each.motors[i]);
            let rated = motor.rated_torque * axis.gear;
            Friction {
                coulomb: axis.coulomb * rated,
                viscous: axis.viscous * rated / (motor.rated_speed_rpm * RPM / axis.gear),
            }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use firmware::arm::Turns;

    #[test]
    fn the_built_in_model_reads_and_its_lengths_are_the_specs() {
        let model = Model::k3s();
        let inverse = firmware::arm::K3sInverse::of(&model.arm());
        assert!(inverse.is_ok(), "{inverse:?}");
        assert_eq!(
            (model.name(), model.axis_names()),
            ("K3S", ["J0", "J1", "J2", "J3", "J4", "J5"])
        );
        let tip = model.arm().forward(&[0.0; 6]);
        assert!((tip.p - Vector3::new(0.59, 0.0, -0.65)).abs().max() < 1e-6);
        let home = model.arm().forward(&model.home().map(|q| q as f32));
        assert!(
            (home.p - Vector3::new(0.40, 0.0, 0.30)).abs().max() < 0.01,
            "{}",
            home.p
        );
        assert!(home.r.m33 > 0.999, "nozzle down: z_N out of the work");
    }

    /// The spec asks for loads of 1 to 4 times the reflected rotor, which a motor of one size cannot see in every posture: tucked
    /// in it is less about the base, and the tool about its own axis is always light.
    #[test]
    fn loads_are_in_proportion_to_the_motors() {
        let plant = Model::k3s().plant();
        let stretched = [0.0, -0.6, -0.4, 0.3, -1.2, 0.0];
        for q in [Model::k3s().home(), stretched] {
            let mass = plant.mass_matrix(&q);
            for i in 0..AXES {
                let ratio = mass[(i, i)] / plant.rotor[i] - 1.0;
                let range = if i < 3 { 0.5..4.0 } else { 0.1..4.0 };
                assert!(range.contains(&ratio), "axis {i}: load {ratio:.2} × rotor");
            }
        }
    }

    /// What the joint ranges were chosen for: a panel of 430 × 300 mm at x = 0.40, z = 0.20 m, tilted 20° either way, nozzle down, the
    /// tool turning by 200° on the way, in one posture and without a jump.
    #[test]
    fn the_work_area_is_followed_in_one_posture() {
        use firmware::geometry::rotation::{rot_x, rot_y, rot_z};
        let (model, arm) = (Model::k3s(), Model::k3s().arm());
        let inverse = firmware::arm::K3sInverse::of(&arm).unwrap();
        let home = model.home().map(|q| q as f32);
        for (tilt_x, tilt_y) in [(0.0, 0.0), (0.35, 0.0), (-0.35, 0.0), (0.0, 0.35), (0.0, -0.35)] {
            let tilt = rot_y(tilt_y) * rot_x(tilt_x);
            for (from_x, to_x) in [(-0.15, 0.15), (0.15, -0.15), (0.0, 0.0)] {
                let mut q = home;
                for step in 0..=100 {
                    let part = step as f32 / 100.0;
                    let on_panel = Vector3::new(from_x + (to_x - from_x) * part, -0.215 + 0.43 * part, 0.0);
                    let pose = Pose {
                        r: tilt * rot_z(-1.75 + 3.5 * part),
                        p: Vector3::new(0.40, 0.0, 0.20) + tilt * on_panel,
                    };
                    let next = inverse.nearest(&pose, &q);
                    let next = next.unwrap_or_else(|e| panic!("{e:?} at {part} of {tilt_x} {tilt_y} {from_x}"));
                    let jump = next.iter().zip(&q).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
                    assert!(
                        step == 0 || jump < 0.15,
                        "{jump} rad at {part} of {tilt_x} {tilt_y} {from_x}"
                    );
                    q = next;
                }
            }
        }
    }

    #[test]
    fn gravity_is_well_within_the_rated_torque_over_the_work_area() {
        let (model, arm) = (Model::k3s(), Model::k3s().arm());
        let servo = model.servo();
        let inverse = firmware::arm::K3sInverse::of(&arm).unwrap();
        let home = model.home().map(|q| q as f32);
        for x in [0.2, 0.4, 0.6] {
            for y in [-0.2, 0.0, 0.2] {
                let pose = Pose {
                    p: Vector3::new(x, y, 0.2),
                    ..Pose::identity()
                };
                let q = inverse.nearest(&pose, &home).unwrap();
                let torques = servo.dynamics.torques(&arm, &Turns::of(&q), &[0.0; 6], &[0.0; 6]);
                for (i, torque) in torques.iter().enumerate() {
                    assert!(
                        torque.abs() < 0.7 * servo.drives[i].rated_torque,
                        "axis {i} at {x}, {y}: {torque} N·m"
                    );
                }
            }
        }
    }

    #[test]
    fn the_controllers_dynamics_are_the_plants() {
        let (model, arm) = (Model::k3s(), Model::k3s().arm());
        let q = [0.3, -1.7, 0.2, 0.4, -1.3, 0.9];
        let dq = [0.5, -0.4, 0.3, 0.6, -0.7, 1.1];
        let ddq = [1.0, 2.0, -1.5, 3.0, -2.0, 4.0];
        let frictionless = Dynamics {
            viscous: [0.0; 6],
            coulomb: [0.0; 6],
            ..model.dynamics()
        };
        let torques = frictionless.torques(
            &arm,
            &Turns::of(&q.map(|e| e as f32)),
            &dq.map(|e| e as f32),
            &ddq.map(|e| e as f32),
        );
        let plant = model.plant();
        let wanted = plant.mass_matrix(&q) * plant.to_actuators(&ddq) + plant.bias(&q, &dq);
        for i in 0..AXES {
            assert!(
                (torques[i] as f64 - wanted[i]).abs() < 2e-4,
                "axis {i}: {} against {}",
                torques[i],
                wanted[i]
            );
        }
    }
}
