//! What the controller is told before a trial, and how the true part lies: made of options, model and seed.

use super::register::register;
use super::scenario::{Draw, DriveMode, Options, StartName};
use crate::cell::panel::Panel;
use crate::model::{AXES, Model};
use anyhow::anyhow;
use firmware::arm::K3sInverse;
use firmware::cycle::Params;
use firmware::geometry::Pose;
use firmware::job::correction::SensorMount;
use firmware::job::measure::MeasureParams;
use firmware::job::path::{PathError, SPACING, STATIONS, TaughtPath, Travel};
use firmware::job::seal::{PERIOD, SealParams, StartPose};
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
/// Height over the path's ends at which the arm comes and goes, m. Assumed.
pub const CLEARANCE: f32 = 0.040;

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
}

impl Setup {
    /// Draws the part and prepares the controller.
    pub fn new(options: &Options, model: &Model, seed: u64) -> anyhow::Result<Self> {
        let mut draw = Draw::new(options, seed);
        let mount = options
            .calibration
            .map_or_else(|| mount(model), |sensor| sensor.mount());
        let path = taught(options, mount.pose.p.x)?;
        if let Some(seam) = options.taught {
            // The part was taught where it lay then: from there it has moved.
            draw.displacement *= register(seam, options.path)?.inverse();
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
            clearance: CLEARANCE,
            joint: motion_limits(model),
            joint_speed: joint_speeds(model),
            inverse: inverse(model)?,
        };
        Ok(Self {
            params: Params {
                arm: model.arm(),
                servo: servo(options, model),
                seal,
                teach: None,
                exposure_delay: exposure_delay(options),
            },
            master: master(options, model),
            mount,
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

/// The servo loops as the options ask for them.
pub fn servo(options: &Options, model: &Model) -> Servo<AXES> {
    let mut servo = model.servo_in(match options.mode {
        DriveMode::Csv => ServoMode::Velocity,
        DriveMode::Cst => ServoMode::Torque,
    });
    servo.feedforward = options.feed_forward;
    servo
}

/// Highest speeds that a path may ask of the joints, rad/s: the motors' rated ones.
pub fn joint_speeds(model: &Model) -> [f32; AXES] {
    model.motors_data().map(|motor| (motor.rated_speed / motor.gear) as f32)
}

/// The path as it was taught, or as the nominal part would have taught it.
fn taught(options: &Options, lead: f32) -> anyhow::Result<TaughtPath> {
    let travel = Travel {
        speed: options.speed as f32,
        acceleration: ACCELERATION,
        centripetal: CENTRIPETAL,
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
        PathError::TooLong => anyhow!(
            "path: {length:.3} m is too long, must be at most {} m",
            STATIONS as f32 * SPACING
        ),
    })
}

/// The sensor as drawn, which is how the controller knows it until it is calibrated.
pub fn mount(model: &Model) -> SensorMount {
    SensorMount {
        pose: Pose {
            r: Matrix3::identity(),
            p: Vector3::new(model.sensor_lead() as f32, 0.0, 0.0),
        },
        camera_height: Pinhole::TRACKING.height_m,
        slit_slopes: [Pinhole::TRACKING.tan_slit, Pinhole::TRACKING.slit_lean],
    }
}

/// The bus: who is on it, and what each drive is told.
pub fn master(options: &Options, model: &Model) -> MasterConfig<AXES> {
    let (arm, motors) = (model.arm(), model.motors_data());
    let ranges = arm.ranges.map(|range| [f64::from(range.min), f64::from(range.max)]);
    let drives = std::array::from_fn(|axis| {
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
    });
    MasterConfig::new(
        match options.mode {
            DriveMode::Csv => Mode::Velocity,
            DriveMode::Cst => Mode::Torque,
        },
        drives,
    )
}

fn single(v: Vector3<f64>) -> [f32; 3] {
    [v.x as f32, v.y as f32, v.z as f32]
}

/// Limits of the point-to-point motions.
pub fn motion_limits(model: &Model) -> [MotionLimits; AXES] {
    model.motors_data().map(|motor| MotionLimits {
        speed: (APPROACH * motor.rated_speed / motor.gear) as f32,
        acceleration: ACCELERATION_JOINT,
        jerk: JERK_JOINT,
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

/// A core pose as the simulator has poses.
pub fn isometry(pose: &Pose) -> Isometry3<f64> {
    let rotation = Rotation3::from_matrix(&pose.r.map(f64::from));
    Isometry3::from_parts(
        Translation3::from(pose.p.map(f64::from)),
        UnitQuaternion::from_rotation_matrix(&rotation),
    )
}
