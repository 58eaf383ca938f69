//! What the controller is told before a trial, and how the true part lies: made of options, model and seed.

use super::register::register;
use super::scenario::{Draw, DriveMode, Options, StartName};
use super::second::SecondSetup;
use crate::camera::optics::Optics;
use crate::cell::panel::Panel;
use crate::model::{AXES, Model};
use crate::node::drive::{Drive, DriveData, Encoder};
use anyhow::anyhow;
use firmware::arm::K3sInverse;
use firmware::cycle::Params;
use firmware::geometry::Pose;
use firmware::job::access::AccessParams;
use firmware::job::measure::MeasureParams;
use firmware::job::mount::SensorMount;
use firmware::job::path::corner::{CORNERS, UNSEEN};
use firmware::job::path::{PathError, SPACING, TaughtPath, Travel};
use firmware::job::round::RoundParams;
use firmware::job::seal::{PERIOD, SealParams, StartPose};
use firmware::job::stance::Stance;
use firmware::servo::axes::{DriveMode as ServoMode, Servo};
use firmware::servo::profile::MotionLimits;
use firmware::vision::camera::Pinhole;
use hal::cia402::Mode;
use hal::master::{DriveConfig, MasterConfig};
use nalgebra::{Isometry3, Matrix3, Point3, Rotation3, Translation3, UnitQuaternion, Vector3};
use std::f64::consts::TAU;

/// Acceleration and braking along the path, m/s²: full speed within 22 mm, well inside the sensor's lead. Assumed.
pub const ACCELERATION: f32 = 2.0;
/// Highest centripetal acceleration of the tip, m/s²: at the panel's corner it slows to 0.24 m/s. Assumed.
const CENTRIPETAL: f32 = 3.0;
/// Highest rate at which the tool is turned about its own axis, rad/s: three quarters of the wrist motors' rated speed, and half as much again
/// as R150 wants at 0.3 m/s. Assumed.
const TURN_RATE: f32 = 3.0;
/// Height over the path at which the sensor is led round a corner, m: a bead of 10 mm is half as high, and over the sheets of 100 parts that are bent
/// and lie elsewhere 4.6 mm of it are left. Assumed.
const ROUND_RAISE: f32 = 0.008;
/// Speed at which the sensor is led round a corner, m/s, and its acceleration, m/s²: two sightings in each 5 mm. Assumed.
const ROUND_SPEED: f32 = 0.15;
const ROUND_ACCELERATION: f32 = 1.0;
/// Rate at which the tool is turned in that, rad/s: the nozzle then swings about the corner at 0.15 m/s. Assumed.
const ROUND_TURN_RATE: f32 = 2.0;
/// Height over the path's ends at which the arm comes and goes, m. Assumed.
const CLEARANCE: f32 = 0.040;

/// Share of the motors' rated speed for the point-to-point motions: somebody may stand near. Assumed.
const APPROACH: f64 = 0.4;
/// Acceleration of the point-to-point motions, rad/s²: half the rated torque of the main motors on twice their rotors' inertia. Assumed.
const ACCELERATION_JOINT: f32 = 6.0;
/// Jerk of the point-to-point motions, rad/s³: full acceleration within 0.1 s. Assumed.
const JERK_JOINT: f32 = 60.0;

/// Everything that is settled before a trial.
pub struct Setup {
    /// The core's parameters.
    pub params: Params,
    /// The bus.
    pub master: MasterConfig<AXES>,
    /// The sensor on the nozzle.
    pub mount: SensorMount,
    /// The true part.
    pub panel: Panel,
    /// The arm beside the sealing one, if there is one.
    pub second: Option<Box<SecondSetup>>,
    /// Where along its seam the bead is to begin and to end, m.
    pub ends: [f64; 2],
}

impl Setup {
    /// Draws the part and prepares the controller.
    pub fn new(options: &Options, model: &Model, seed: u64) -> anyhow::Result<Self> {
        let mut draw = Draw::new(options, seed);
        let mount = known_mount(options, model);
        let path = taught(options, mount.pose.p.x)?;
        let mut ends = [0.0, draw.panel.path().length()];
        if let Some(seam) = options.taught {
            let taught = register(seam, options.path)?;
            // The part was taught where it lay then: from there it has moved.
            draw.displacement *= taught.displacement.inverse();
            ends = taught.ends;
        }
        let taught_start = isometry(&path.place(0.0).nozzle(0.0, 0.0, 0.0));
        let measured = options.start == StartName::Measured;
        let start = if measured {
            StartPose::default()
        } else {
            draw.start_pose(options, &taught_start, seed)
        };
        let seal = SealParams {
            path,
            start,
            measure: MeasureParams {
                start: measured,
                edge_height: options.joint.pattern().edge_height(),
                bend: options.joint.pattern().is_bend(),
                sections: options.survey,
            },
            mount,
            hold: options.hold.kind(),
            preview: options.preview,
            vision_period: options.vision_period,
            speed: options.speed as f32,
            acceleration: ACCELERATION,
            round: round(options, &mount),
            access: access(model)?,
        };
        let master = master(options, model);
        Ok(Self {
            second: options.second_arm.then(|| Box::new(SecondSetup::new(options, &master))),
            params: Params {
                arm: model.arm(),
                servo: servo(options, model),
                seal,
                teach: None,
                exposure_delay: exposure_delay(options),
            },
            master,
            mount,
            ends,
            panel: if measured {
                draw.panel.ending_at_start()
            } else {
                draw.panel
            },
        })
    }
}

/// The exposure's delay that the controller reckons with, cycles.
pub fn exposure_delay(options: &Options) -> f32 {
    (options.assumed_delay / f64::from(PERIOD)) as f32
}

/// How the tool is held while it looks round a corner.
pub fn stance(options: &Options, mount: &SensorMount) -> Stance {
    let slit = if options.slits == 1 {
        Optics::TRACKING.slits_m[0]
    } else {
        Optics::TWO_SLITS.slits_m[0]
    };
    Stance {
        raise: ROUND_RAISE,
        look: mount.pose.p.x + slit as f32 + ROUND_RAISE * mount.slit_slopes[0],
        lean: options.joint.pattern().flank(),
    }
}

/// How corners are looked round.
fn round(options: &Options, mount: &SensorMount) -> RoundParams {
    RoundParams {
        stance: stance(options, mount),
        speed: ROUND_SPEED,
        acceleration: ROUND_ACCELERATION,
        turn_rate: ROUND_TURN_RATE,
    }
}

/// The servo loops as the options ask for them.
pub fn servo<const N: usize>(options: &Options, model: &Model<N>) -> Servo<N> {
    let mut servo = model.servo_in(match options.mode {
        DriveMode::Csv => ServoMode::Velocity,
        DriveMode::Cst => ServoMode::Torque,
    });
    servo.feedforward = options.feed_forward;
    servo
}

/// Highest speeds that a path may ask of the joints, rad/s: the motors' rated ones.
pub fn joint_speeds<const N: usize>(model: &Model<N>) -> [f32; N] {
    model.motors_data().map(|motor| (motor.rated_speed / motor.gear) as f32)
}

/// The path as it was taught, or as the nominal part would have taught it.
fn taught(options: &Options, lead: f32) -> anyhow::Result<TaughtPath> {
    let travel = Travel {
        speed: options.speed as f32,
        acceleration: ACCELERATION,
        centripetal: CENTRIPETAL,
        turn_rate: TURN_RATE,
        lead,
    };
    let (length, path) = match options.taught {
        Some(seam) => {
            let at = |s: f32| {
                let place = seam.at(f64::from(s));
                (single(place.point), single(place.tangent), single(place.normal))
            };
            (seam.length(), TaughtPath::new(seam.length() as f32, &travel, at))
        }
        None => {
            let (seam, t_b_w) = (options.path.seam(), options.path.placing());
            let at = |s: f32| {
                let frame = seam.at(f64::from(s));
                let point = t_b_w * Point3::from(frame.p);
                (single(point.coords), single(t_b_w * frame.t), single(t_b_w * frame.n))
            };
            (seam.length(), TaughtPath::new(seam.length() as f32, &travel, at))
        }
    };
    path.map_err(|error| match error {
        PathError::TooShort => anyhow!("path: {length:.3} m is too short, must be at least {} m", 2.0 * SPACING),
        PathError::TooLong(most) => anyhow!("path: {length:.3} m is too long, must be at most {most:.3} m"),
        PathError::TooManyCorners => anyhow!("path: more corners than can be looked round, must be at most {CORNERS}"),
        PathError::Unseen(from, to) => anyhow!(
            "path: bent so that the sensor cannot see it from {from:.3} to {to:.3} m, must be at most {UNSEEN} m at a stretch"
        ),
    })
}

/// The sensor as drawn, which is how the controller knows it until it is calibrated.
pub fn mount(model: &Model) -> SensorMount {
    as_drawn(Pose {
        r: Matrix3::identity(),
        p: Vector3::new(model.sensor_lead() as f32, 0.0, 0.0),
    })
}

/// The sensor as the controller knows it: as calibrated, or else as drawn.
pub fn known_mount(options: &Options, model: &Model) -> SensorMount {
    options
        .calibration
        .map_or_else(|| mount(model), |sensor| sensor.mount())
}

/// The sensor as drawn, at `pose` on the nozzle.
pub fn as_drawn(pose: Pose) -> SensorMount {
    let slopes = |slit: Pinhole| [slit.tan_slit, slit.slit_lean];
    SensorMount {
        pose,
        camera_height: Pinhole::START.height_m,
        slit_slopes: slopes(Pinhole::START),
        seam_slopes: Pinhole::TWO_SLITS.map(slopes),
    }
}

/// The bus: who is on it, and what each drive is told.
pub fn master(options: &Options, model: &Model) -> MasterConfig<AXES> {
    MasterConfig::new(
        match options.mode {
            DriveMode::Csv => Mode::Velocity,
            DriveMode::Cst => Mode::Torque,
        },
        drive_configs(model),
    )
}

/// What each drive of an arm is told.
pub fn drive_configs<const N: usize>(model: &Model<N>) -> [DriveConfig; N] {
    let (arm, motors) = (model.arm(), model.motors_data());
    let ranges = arm.ranges.map(|range| [f64::from(range.min), f64::from(range.max)]);
    std::array::from_fn(|axis| {
        let motor = &motors[axis];
        let counts_per_rad = f64::from(motor.encoder_counts) * motor.gear / TAU;
        // The actuator's range: its own joint's, or what two joints can make of it.
        let (own, carry) = (f64::from(arm.coupling.own[axis]), f64::from(arm.coupling.carry[axis]));
        let before = ranges[axis.saturating_sub(1)];
        let ends = ranges[axis].iter().flat_map(|q| before.map(|b| own * q + carry * b));
        let (low, high) = ends.fold((f64::MAX, f64::MIN), |(low, high), end| (low.min(end), high.max(end)));
        DriveConfig {
            vendor_product: crate::node::drive::VENDOR_PRODUCT,
            rated_torque_mnm: (motor.rated_torque * 1000.0).round() as u32,
            encoder_counts: motor.encoder_counts,
            gear: [1, 1],
            max_torque: (1000.0 * motor.peak_torque / motor.rated_torque) as u16,
            max_speed_rpm: (motor.max_speed * 60.0 / TAU).round() as u32,
            position_limits: [(low * counts_per_rad) as i32, (high * counts_per_rad) as i32],
            // To rest from rated speed within 0.1 s.
            quick_stop: (motor.rated_speed * f64::from(motor.encoder_counts) / TAU / 0.1) as u32,
            following_window: u32::MAX,
            following_time_ms: 0,
        }
    })
}

/// An arm's drives, as they are delivered, from node `first` on.
pub fn drives<const N: usize>(model: &Model<N>, first: u8) -> [Drive; N] {
    let motors = model.motors_data();
    std::array::from_fn(|axis| {
        let motor = &motors[axis];
        let data = DriveData {
            rated_torque_n_m: motor.rated_torque,
            peak_torque_n_m: motor.peak_torque,
            max_speed_rpm: (motor.max_speed * 60.0 / TAU).round() as u32,
            encoder_counts: motor.encoder_counts,
            ..DriveData::main(motor.total_inertia)
        };
        Drive::new(first + axis as u8, data)
    })
}

/// Their encoders.
pub fn encoders<const N: usize>(model: &Model<N>) -> [Encoder; N] {
    model.motors_data().map(|motor| Encoder {
        counts_per_revolution: motor.encoder_counts,
    })
}

fn single(v: Vector3<f64>) -> [f32; 3] {
    [v.x as f32, v.y as f32, v.z as f32]
}

/// Limits of the point-to-point motions.
pub fn motion_limits<const N: usize>(model: &Model<N>) -> [MotionLimits; N] {
    model.motors_data().map(|motor| MotionLimits {
        speed: (APPROACH * motor.rated_speed / motor.gear) as f32,
        acceleration: ACCELERATION_JOINT,
        jerk: JERK_JOINT,
    })
}

/// How the arm comes to a seam and leaves it.
pub fn access(model: &Model) -> anyhow::Result<AccessParams> {
    Ok(AccessParams {
        clearance: CLEARANCE,
        joint: motion_limits(model),
        joint_speed: joint_speeds(model),
        inverse: inverse(model)?,
    })
}

/// The closed-form inverse of the model's arm.
pub fn inverse(model: &Model) -> anyhow::Result<K3sInverse> {
    K3sInverse::of(&model.arm()).map_err(|error| {
        anyhow!(
            "axes row {}: not of the K3S's form, must be (0,0,0) (l0,-90,0) (l1,180,0) (l2,90,d3) (0,-90,0) (0,90,0)",
            error.row
        )
    })
}

/// A pose of the simulator as the core has poses.
pub fn pose(isometry: &Isometry3<f64>) -> Pose {
    Pose {
        r: isometry.rotation.to_rotation_matrix().matrix().map(|e| e as f32),
        p: isometry.translation.vector.map(|e| e as f32),
    }
}

/// A core pose as the simulator has poses.
pub fn isometry(pose: &Pose) -> Isometry3<f64> {
    let rotation = Rotation3::from_matrix(&pose.r.map(f64::from));
    Isometry3::from_parts(
        Translation3::from(pose.p.map(f64::from)),
        UnitQuaternion::from_rotation_matrix(&rotation),
    )
}
