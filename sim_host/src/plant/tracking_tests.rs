//! The controller's servo on the plant, with the drives reduced to what they do to a torque: how well a straight seam is
//! followed at 0.3 m/s when the controller's model is 10 % wrong.

use super::*;
use crate::model::Model;
use firmware::{
    arm::K3sInverse,
    arm::Turns,
    geometry::Pose,
    servo::{
        axes::{DriveMode, Reference, Servo},
        profile::{MotionLimits, Profile},
    },
};
use rand::SeedableRng;
use rand_pcg::Pcg64;

const CYCLE: f64 = 5e-3;
const TICKS: usize = 20;

/// Joint references of a line of 400 mm across the work area and back to rest, cycle by cycle.
fn line(model: &Model) -> Vec<[f32; AXES]> {
    let inverse = K3sInverse::of(&model.arm()).unwrap();
    let profile = Profile::plan(
        0.4,
        &MotionLimits {
            speed: 0.3,
            acceleration: 1.0,
            jerk: 20.0,
        },
    );
    let mut q = model.home().map(|q| q as f32);
    let cycles = (profile.duration() as f64 / CYCLE) as usize + 40;
    (0..cycles)
        .map(|k| {
            let way = profile
                .evaluate((k as f64 - 20.0).max(0.0) as f32 * CYCLE as f32)
                .position;
            let pose = Pose {
                p: Vector3::new(0.4, -0.2 + way, 0.2),
                ..Pose::identity()
            };
            q = inverse.nearest(&pose, &q).unwrap();
            q
        })
        .collect()
}

/// A drive's speed loop at the plant's step: PI of 2π·60 rad/s on the motor, peak torque limited; ideal current loop.
struct SpeedLoop {
    integral: [f64; AXES],
}

impl SpeedLoop {
    fn torque(&mut self, model: &Model, i: usize, wanted: f64, speed: f64, offset: f64) -> f64 {
        let motor = &model.motors_data()[i];
        let gain = motor.total_inertia * motor.gear * 377.0;
        let error = wanted - speed;
        self.integral[i] += gain * 377.0 / 5.0 * error * DT;
        (gain * error + self.integral[i] + offset).clamp(-motor.peak_torque, motor.peak_torque)
    }
}

const DT: f64 = CYCLE / TICKS as f64;

/// Greatest and rms distance of the tip from where it should be, m, over the moving part.
fn error(servo: &Servo<AXES>, seed: u64) -> (f64, f64) {
    let model = Model::k3s();
    let arm = model.arm();
    let references = line(&model);
    let wrong = model.plant().disturbed(0.1, &mut Pcg64::seed_from_u64(seed));
    let mut plant = Plant::at_rest(wrong, &references[0].map(f64::from));
    let measure = |plant: &Plant| -> [f32; AXES] {
        let actuators = plant.actuators();
        std::array::from_fn(|i| {
            let drive = &servo.drives[i];
            drive.angle((actuators[i] * drive.counts_per_rad as f64).floor() as i32)
        })
    };
    let mut state = servo.preset(&measure(&plant));
    let mut turns = Turns::of(&references[0]);
    let mut loops = SpeedLoop { integral: [0.0; AXES] };
    let still = Reference::still(references[0]);
    let mut acting = servo.step(&arm, &mut state, &still, &turns, &measure(&plant), &mut ());
    let (mut worst, mut sum, mut count) = (0.0_f64, 0.0, 0);
    for k in 0..references.len() - 3 {
        let velocity = |j: usize| -> [f32; AXES] {
            std::array::from_fn(|i| (references[j + 1][i] - references[j][i]) / CYCLE as f32)
        };
        let (before, now, after) = (velocity(k), velocity(k + 1), velocity(k + 2));
        let reference = Reference {
            position: references[k],
            velocity: now,
            acceleration: std::array::from_fn(|i| (after[i] - before[i]) / (2.0 * CYCLE as f32)),
        };
        let wanted = arm.forward(&references[k]).p.map(f64::from);
        let distance = (plant.T_b_n().translation.vector - wanted).norm();
        if k > 20 {
            worst = worst.max(distance);
            sum += distance * distance;
            count += 1;
        }
        turns.go(&references[k + 1]);
        let next = servo.step(&arm, &mut state, &reference, &turns, &measure(&plant), &mut ());
        for _ in 0..TICKS {
            let speeds = plant.actuator_velocities();
            let torques = std::array::from_fn(|i| {
                let drive = &servo.drives[i];
                let torque = drive.torque(acting[i].torque) as f64 / model.motors_data()[i].gear;
                match servo.mode {
                    DriveMode::Torque => torque,
                    DriveMode::Velocity => {
                        loops.torque(&model, i, drive.speed(acting[i].velocity) as f64, speeds[i], torque)
                    }
                }
            });
            plant.tick(DT, &torques);
        }
        acting = next;
    }
    (worst, (sum / count as f64).sqrt())
}

/// Both modes, feed-forward on and off: the drive's own speed loop and the feed-forward are each worth an order of magnitude.
#[test]
fn a_straight_seam_is_followed_with_a_model_ten_percent_wrong() {
    let model = Model::k3s();
    let run = |mode, feedforward| {
        error(
            &Servo {
                feedforward,
                ..model.servo_in(mode)
            },
            1,
        )
    };
    let (velocity, velocity_bare) = (run(DriveMode::Velocity, true), run(DriveMode::Velocity, false));
    let (torque, torque_bare) = (run(DriveMode::Torque, true), run(DriveMode::Torque, false));
    println!(
        "max, rms of the tip in m: CSV {velocity:?}, bare {velocity_bare:?}; CST {torque:?}, bare {torque_bare:?}"
    );
    assert!(velocity.0 < 0.1e-3, "CSV with feed-forward: {velocity:?} m");
    assert!(velocity_bare.0 > 5e-3, "without: {velocity_bare:?} m");
    assert!(torque.0 < torque_bare.0 / 5.0, "CST: {torque:?} and {torque_bare:?} m");
}
