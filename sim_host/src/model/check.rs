//! Validation of a model file: every refusal names the field, its value and what is allowed.

use super::file::{AxisEntry, ModelFile, MotorEntry};
use nalgebra::{Matrix3, SymmetricEigen};
use std::fmt;

/// Why a model file was refused.
#[derive(Clone, Debug, PartialEq)]
pub enum ModelError {
    /// The file could not be read.
    Unreadable {
        /// Path as given.
        path: String,
        /// The system's reason.
        reason: String,
    },
    /// It is not the TOML of a model: line (from 1) and reason.
    Syntax {
        /// Line, from 1.
        line: usize,
        /// The parser's reason.
        reason: String,
    },
    /// A value outside what is allowed.
    Value {
        /// Path of the field in the file.
        field: String,
        /// Its value.
        value: String,
        /// What is allowed.
        allowed: String,
    },
}

impl ModelError {
    pub(super) fn syntax(text: &str, error: &toml::de::Error) -> Self {
        let (line, reason) = line_of(text, error);
        Self::Syntax { line, reason }
    }
}

/// The line of a TOML file's `text` that an error is in, counted from 1, and what it is, in one line.
pub fn line_of(text: &str, error: &toml::de::Error) -> (usize, String) {
    let start = error.span().map_or(0, |span| span.start.min(text.len()));
    let line = 1 + text.as_bytes()[..start].iter().filter(|b| **b == b'\n').count();
    (line, error.message().replace('\n', "; "))
}

impl fmt::Display for ModelError {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Self::Unreadable { path, reason } => {
                write!(f, "robot model {path}: {reason}; give \"k3s\" or a model file")
            }
            Self::Syntax { line, reason } => write!(f, "robot model, line {line}: {reason}"),
            Self::Value { field, value, allowed } => write!(f, "robot model: {field} = {value}; allowed: {allowed}"),
        }
    }
}

impl std::error::Error for ModelError {}

/// What a model file holds of each axis, in arrays.
#[derive(Clone, Debug)]
pub(super) struct Axes<const N: usize> {
    pub axes: [AxisEntry; N],
    pub motors: [MotorEntry; N],
    /// rad.
    pub home: [f64; N],
    /// rad/s per rad.
    pub velocity_proportional: [f64; N],
}

/// The file, if all of it can be.
pub(super) fn check<const N: usize>(file: &ModelFile) -> Result<Axes<N>, ModelError> {
    let axes: [AxisEntry; N] = each("axes", &file.axes)?;
    let home_deg: [f64; N] = each("home_deg", &file.home_deg)?;
    let velocity_proportional: [f64; N] = each("servo.velocity_proportional", &file.servo.velocity_proportional)?;
    for (name, motor) in &file.motors {
        check_motor(name, motor)?;
    }
    for (i, axis) in axes.iter().enumerate() {
        check_axis(i, axis)?;
        let [min, max] = axis.range_deg;
        within(&format!("home_deg[{i}]"), home_deg[i], min, max)?;
        within(
            &format!("servo.velocity_proportional[{i}]"),
            velocity_proportional[i],
            0.0,
            200.0,
        )?;
    }
    if let Some(elbow) = file.parallel_link_elbow
        && !(1..N).contains(&elbow)
    {
        return Err(refuse("parallel_link_elbow", &elbow, &format!("1 to {}", N - 1)));
    }
    for (i, value) in file.tool.tip_m.iter().enumerate() {
        within(&format!("tool.tip_m[{i}]"), *value, -2.0, 2.0)?;
    }
    within("tool.turn_about_x_deg", file.tool.turn_about_x_deg, -180.0, 180.0)?;
    within("sensor.lead_m", file.sensor.lead_m, 0.0, 0.5)?;
    // The core runs at 5 ms (`firmware::job::seal::PERIOD`), and nothing else.
    within("servo.period_s", file.servo.period_s, 0.005, 0.005)?;
    within("servo.torque_omega", file.servo.torque_omega, 0.1, 40.0)?;
    within("servo.torque_zeta", file.servo.torque_zeta, 0.1, 2.0)?;
    let mut motors = Vec::with_capacity(N);
    for (i, axis) in axes.iter().enumerate() {
        let known = file.motors.keys().map(String::as_str).collect::<Vec<_>>().join(", ");
        let motor = file
            .motors
            .get(&axis.motor)
            .ok_or_else(|| refuse(&format!("axes[{i}].motor"), &axis.motor, &known))?;
        motors.push(motor.clone());
    }
    Ok(Axes {
        axes,
        motors: each("axes", &motors)?,
        home: home_deg.map(f64::to_radians),
        velocity_proportional,
    })
}

/// One entry for each axis.
fn each<T: Clone, const N: usize>(field: &str, entries: &[T]) -> Result<[T; N], ModelError> {
    let wrong = |_| refuse(field, &entries.len(), &format!("{N} entries"));
    entries.to_vec().try_into().map_err(wrong)
}

fn check_motor(name: &str, motor: &MotorEntry) -> Result<(), ModelError> {
    let field = |f: &str| format!("motors.{name}.{f}");
    within(&field("rated_torque"), motor.rated_torque, 1e-4, 1e4)?;
    within(
        &field("peak_torque"),
        motor.peak_torque,
        motor.rated_torque,
        10.0 * motor.rated_torque,
    )?;
    within(&field("rated_speed_rpm"), motor.rated_speed_rpm, 1.0, 1e5)?;
    within(&field("max_speed_rpm"), motor.max_speed_rpm, motor.rated_speed_rpm, 1e5)?;
    within(&field("rotor_inertia"), motor.rotor_inertia, 1e-9, 10.0)?;
    within(&field("brake_torque"), motor.brake_torque, 0.0, 1e4)?;
    within(
        &field("encoder_counts"),
        motor.encoder_counts as f64,
        16.0,
        16_777_216.0,
    )
}

fn check_axis(i: usize, axis: &AxisEntry) -> Result<(), ModelError> {
    let field = |f: &str| format!("axes[{i}].{f}");
    within(&field("a"), axis.a, -5.0, 5.0)?;
    within(&field("twist_deg"), axis.twist_deg, -180.0, 180.0)?;
    within(&field("d"), axis.d, -5.0, 5.0)?;
    let [min, max] = axis.range_deg;
    within(&field("range_deg[0]"), min, -720.0, 720.0)?;
    within(&field("range_deg[1]"), max, min, 720.0)?;
    within(&field("mass"), axis.mass, 0.0, 1000.0)?;
    for (k, value) in axis.centre.iter().enumerate() {
        within(&field(&format!("centre[{k}]")), *value, -5.0, 5.0)?;
    }
    for (k, value) in axis.inertia.iter().enumerate() {
        within(&field(&format!("inertia[{k}]")), *value, -1000.0, 1000.0)?;
    }
    within(&field("gear"), axis.gear, 0.1, 1000.0)?;
    within(&field("coulomb"), axis.coulomb, 0.0, 1.0)?;
    within(&field("viscous"), axis.viscous, 0.0, 1.0)?;
    check_inertia(&field("inertia"), &axis.inertia)
}

/// The principal moments A ≤ B ≤ C of a body are not negative, and A + B ≥ C.
fn check_inertia(field: &str, inertia: &[f64; 6]) -> Result<(), ModelError> {
    let [xx, yy, zz, xy, xz, yz] = *inertia;
    let mut moments = SymmetricEigen::new(Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz)).eigenvalues;
    moments.as_mut_slice().sort_by(f64::total_cmp);
    let slack = 1e-9 * moments[2].abs();
    if moments[0] < -slack || moments[0] + moments[1] < moments[2] - slack {
        let value = format!(
            "{inertia:?} (principal moments {:.6}, {:.6}, {:.6})",
            moments[0], moments[1], moments[2]
        );
        return Err(refuse(field, &value, "of a body: 0 ≤ A ≤ B ≤ C and A + B ≥ C"));
    }
    Ok(())
}

fn within(field: &str, value: f64, min: f64, max: f64) -> Result<(), ModelError> {
    if (min..=max).contains(&value) {
        return Ok(());
    }
    Err(refuse(field, &value, &format!("{min} to {max}")))
}

fn refuse(field: &str, value: &dyn fmt::Display, allowed: &str) -> ModelError {
    ModelError::Value {
        field: field.to_owned(),
        value: value.to_string(),
        allowed: allowed.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::super::{K3S, Model};

    fn refusal(from: &str, to: &str) -> String {
        assert!(K3S.contains(from), "{from}");
        Model::parse(&K3S.replacen(from, to, 1))
            .expect_err("must be refused")
            .to_string()
    }

    #[test]
    fn a_value_out_of_range_is_named_with_its_range() {
        assert_eq!(
            refusal("gear = 120.0", "gear = 0.0"),
            "robot model: axes[0].gear = 0; allowed: 0.1 to 1000"
        );
        assert_eq!(
            refusal("mass = 16.0", "mass = nan"),
            "robot model: axes[0].mass = NaN; allowed: 0 to 1000"
        );
        assert_eq!(
            refusal("peak_torque = 2.86", "peak_torque = 0.5"),
            "robot model: motors.main.peak_torque = 0.5; allowed: 0.955 to 9.549999999999999"
        );
        assert_eq!(
            refusal("motor = \"main\"", "motor = \"big\""),
            "robot model: axes[0].motor = big; allowed: main, wrist"
        );
        assert_eq!(
            refusal("elbow = 2", "elbow = 6"),
            "robot model: parallel_link_elbow = 6; allowed: 1 to 5"
        );
    }

    #[test]
    fn an_inertia_that_no_body_has_is_refused() {
        let error = refusal("inertia = [0.020, 0.130, 0.130", "inertia = [0.020, 0.130, 0.160");
        assert!(
            error.starts_with("robot model: axes[1].inertia = [0.02, 0.13, 0.16"),
            "{error}"
        );
        assert!(error.contains("A + B ≥ C"), "{error}");
    }

    #[test]
    fn a_missing_axis_a_wrong_key_and_broken_toml_are_told_in_one_line() {
        let cut = &K3S[..K3S.rfind("[[axes]]").unwrap()];
        assert_eq!(
            Model::parse(cut).unwrap_err().to_string(),
            "robot model: axes = 5; allowed: 6 entries"
        );
        let unknown = refusal("gear = 120.0", "geer = 120.0");
        assert!(
            unknown.contains("line") && unknown.contains("geer") && !unknown.contains('\n'),
            "{unknown}"
        );
        let broken = refusal("name = \"K3S\"", "name = \"K3S");
        assert!(
            broken.starts_with("robot model, line 6:") && !broken.contains('\n'),
            "{broken}"
        );
        let absent = Model::named("no_such_robot.toml").unwrap_err().to_string();
        assert!(absent.contains("no_such_robot.toml"), "{absent}");
    }
}
