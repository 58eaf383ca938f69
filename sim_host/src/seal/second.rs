//! The second arm of a cell: five axes beside the sealing robot, with drives on the same bus and moved by the same cycle. What its part of the
//! controller is told, and the arm itself.

use super::cell::follow_drives;
use super::scenario::{Options, Stream, stream};
use super::setup::{drive_configs, drives, encoders, joint_speeds, motion_limits, servo};
use crate::bus::{Bus, Delivery, Mailboxes};
use crate::model::{AXES, Model, SECOND_AXES};
use crate::node::Nodes;
use crate::node::drive::{Drive, Encoder, MotorCommand};
use crate::plant::Plant;
use firmware::cycle::SecondArm;
use firmware::geometry::rotation::rot_x;
use firmware::job::aim::Aim;
use firmware::job::shuttle::ShuttleParams;
use firmware::servo::profile::MotionLimits;
use hal::cia402::PowerState;
use hal::master::MasterConfig;
use nalgebra::{Point3, Vector3};

/// Axes of both arms.
pub const ALL: usize = AXES + SECOND_AXES;

/// Where its tip goes to from its home, and back: m, in its own Σ_B. A stroke across a bench, assumed.
const STROKE: Vector3<f32> = Vector3::new(0.05, 0.30, 0.08);
/// And how far it tilts its tool on the way, about x, rad. Assumed.
const TILT: f32 = 0.4;
/// Its tip's motion: at the speed of sealing, and in a tenth of a second at the sealing path's acceleration. Assumed.
const MOTION: MotionLimits = MotionLimits {
    speed: 0.3,
    acceleration: 2.0,
    jerk: 20.0,
};
/// How far from home it stands at power-up, rad, so that it has a way to go first. Assumed.
const ASIDE: [f64; SECOND_AXES] = [-0.4, -0.2, 0.2, 0.1, 0.2];

/// What the controller is told of it.
pub struct SecondSetup {
    /// The core's parameters.
    pub params: SecondArm<SECOND_AXES>,
    /// The bus, with the drives of both arms.
    pub master: MasterConfig<ALL>,
}

impl SecondSetup {
    /// Beside a sealing arm on the bus `first`.
    pub fn new(options: &Options, first: &MasterConfig<AXES>) -> Self {
        let model = Model::second();
        let arm = model.arm();
        let posture = model.home().map(|angle| angle as f32);
        let home = arm.forward(&posture);
        let far = Aim {
            point: home.p + STROKE,
            direction: (rot_x(TILT) * home.r).column(2).into(),
        };
        let shuttle = ShuttleParams::new(&arm, posture, far, &MOTION, motion_limits(&model), joint_speeds(&model));
        let own = drive_configs(&model);
        let mut all = first.drives.iter().chain(&own);
        let drives = std::array::from_fn(|_| *all.next().expect("as many as both arms have"));
        // With eleven drives, every 4th SYNC would fill the busiest cycle past the 70 % that a bus is planned for.
        let master = MasterConfig {
            tpdo2_every: 8,
            ..MasterConfig::new(first.mode, drives)
        };
        Self {
            params: SecondArm {
                servo: servo(options, &model),
                arm,
                shuttle,
            },
            master,
        }
    }
}

/// The arm itself, on the bus.
pub struct SecondBody {
    /// The arm. Truth.
    pub plant: Plant<SECOND_AXES>,
    /// Its drives.
    pub drives: [Drive; SECOND_AXES],
    encoders: [Encoder; SECOND_AXES],
    commands: [MotorCommand; SECOND_AXES],
    /// Joint angles at the beginning of this cycle, rad.
    joints_at_sync: [f64; SECOND_AXES],
}

impl SecondBody {
    /// At power-up.
    pub fn new(options: &Options, seed: u64, bus: &mut Bus) -> Self {
        let model = Model::second();
        let real = model
            .plant()
            .disturbed(options.model_error, &mut stream(seed, Stream::SecondArm));
        let mut joints = model.home();
        joints.iter_mut().zip(ASIDE).for_each(|(joint, aside)| *joint += aside);
        let mut drives = drives(&model, AXES as u8 + 1);
        for (k, drive) in drives.iter_mut().enumerate() {
            drive.power_on(&mut |frame| bus.send(sender(k), frame));
        }
        Self {
            plant: Plant::at_rest(real, &joints),
            drives,
            encoders: encoders(&model),
            commands: [MotorCommand {
                brake_closed: true,
                ..MotorCommand::default()
            }; SECOND_AXES],
            joints_at_sync: joints,
        }
    }

    /// A cycle begins.
    pub fn start_cycle(&mut self) {
        self.joints_at_sync = self.plant.joints();
    }

    /// Gives a frame to its drives.
    pub fn deliver(&mut self, delivery: &Delivery, mailboxes: &mut Mailboxes) {
        let Delivery { t_ns, frame, .. } = delivery;
        for (k, drive) in self.drives.iter_mut().enumerate() {
            if delivery.sender != sender(k) {
                drive.receive(*t_ns, frame, &mut |answer| mailboxes.send(sender(k), answer));
            }
        }
    }

    /// One tick that ends at `t_ns`, `dt` s long.
    pub fn tick(&mut self, t_ns: u64, dt: f64, bus: &mut Bus) {
        let readings = follow_drives(&mut self.plant, &self.commands, &self.encoders, dt);
        for (k, (drive, command)) in self.drives.iter_mut().zip(&mut self.commands).enumerate() {
            *command = drive.tick(t_ns, dt, readings[k], &mut |frame| bus.send(sender(k), frame));
        }
    }

    /// How far the tip was from where the joint reference (rad) had it at the beginning of this cycle, m.
    pub fn deviation(&self, reference: &[f32; SECOND_AXES]) -> f64 {
        let tip = |q: &[f64; SECOND_AXES]| self.plant.model().chain.tip(q) * Point3::origin();
        (tip(&self.joints_at_sync) - tip(&reference.map(f64::from))).norm()
    }

    /// Every drive is off.
    pub fn powered_down(&self) -> bool {
        self.drives
            .iter()
            .all(|drive| drive.state() == PowerState::SwitchOnDisabled)
    }
}

/// Index on the bus of the sender that its drive `k` is: behind all that a cell has else.
const fn sender(k: usize) -> usize {
    Nodes::<AXES>::CONTROLLER + 1 + k
}
