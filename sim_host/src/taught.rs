//! A taught seam: points of the seam with the sheet's normal, by distance; and the file that it is kept in.
//!
//! The file is TOML that a person can read and edit: millimetres, in Σ_B, a row per point. Loading it checks everything that could lead an arm
//! astray: order, jumps, normals, length. An error names the field, its value and what is allowed.

use crate::model::line_of;
use crate::whole_file;
use anyhow::{Context, Result, anyhow, bail, ensure};
use nalgebra::Vector3;
use serde::Deserialize;
use std::fmt::Write;
use std::fs;
use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};

/// Half the stretch over which the seam's course is taken, m: points taught 0.05 mm off turn it by 0.1°.
const COURSE: f64 = 0.020;
/// The columns of the file, in order.
const COLUMNS: [&str; 7] = ["s_mm", "x_mm", "y_mm", "z_mm", "nx", "ny", "nz"];
/// Rows that a seam may have.
const ROWS: RangeInclusive<usize> = 3..=10_000;
/// Length that a seam may have, mm: the core's path holds 2.5 m with its run-in and run-out.
const LENGTH_MM: RangeInclusive<f64> = 10.0..=2400.0;
/// Furthest of a point from the base in any axis, mm: further than the arm reaches.
const REACH_MM: f64 = 1500.0;
/// Largest step in distance between rows, mm: as much as the sensor may go on unseeing.
const STEP_MM: f64 = 50.0;
/// Turn of the way to a point and, the other way, of that beyond it, degrees, and what the way makes of it, mm: more is a jump aside. Even a seam
/// that swings over with radius 10 mm, taught every 2 mm, turns by 11.5°; and 0.3 mm is what sealing allows.
const ASIDE: (f64, f64) = (12.0, 0.3);
/// A step in space may be longer than that in distance by this share, and this much, mm: more is a jump.
const JUMP: (f64, f64) = (0.02, 0.2);
/// And shorter by this share, mm the same: a corner cut by the chord.
const SHORT: f64 = 0.35;
/// Largest turn of the normal from row to row, and of it from the square to the path, degrees.
const TURN_DEG: f64 = 30.0;

/// A point of a taught seam, Σ_B.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TaughtRow {
    /// Distance along the seam, m.
    pub s: f64,
    /// The point, m.
    pub point: Vector3<f64>,
    /// Unit normal of the sheet, toward the nozzle.
    pub normal: Vector3<f64>,
}

/// Where a taught seam is at some distance.
#[derive(Clone, Copy, Debug)]
pub struct TaughtPlace {
    /// Point, m, Σ_B.
    pub point: Vector3<f64>,
    /// Unit tangent.
    pub tangent: Vector3<f64>,
    /// Unit normal of the sheet, square to the tangent.
    pub normal: Vector3<f64>,
}

/// A taught seam.
#[derive(Clone, Debug, PartialEq)]
pub struct TaughtSeam {
    /// Its points, at least three, the first at distance zero.
    rows: Vec<TaughtRow>,
    /// Length to be sealed, m; points may go on beyond it.
    length: f64,
    /// Shape of its joint as the command line spells it, if that is known.
    joint: Option<String>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    joint: Option<String>,
    length_mm: f64,
    columns: Vec<String>,
    points: Vec<Vec<f64>>,
}

impl TaughtSeam {
    /// Of these rows and this length, checked; the shape of its joint is not known.
    pub fn new(rows: Vec<TaughtRow>, length: f64) -> Result<Self> {
        let joint = None;
        let seam = Self { rows, length, joint };
        seam.check()?;
        Ok(seam)
    }

    /// The same, of a joint of this shape, as the command line spells it.
    pub fn of_joint(self, name: String) -> Self {
        Self {
            joint: Some(name),
            ..self
        }
    }

    /// Its points.
    pub fn rows(&self) -> &[TaughtRow] {
        &self.rows
    }

    /// Length to be sealed, m.
    pub fn length(&self) -> f64 {
        self.length
    }

    /// Shape of its joint as the command line spells it; `None` if that is not known, as in files of older versions.
    pub fn joint(&self) -> Option<&str> {
        self.joint.as_deref()
    }

    /// Reads the file `path`; an error is one line that names file, field, value and what is allowed.
    pub fn read(path: &Path) -> Result<Self> {
        let text =
            fs::read_to_string(path).with_context(|| format!("taught seam {}: cannot be read", path.display()))?;
        Self::from_toml(&text).with_context(|| format!("taught seam {}", path.display()))
    }

    /// Writes the file `path`; `title` says in a line what was taught.
    pub fn write(&self, path: &Path, title: &str) -> Result<PathBuf> {
        whole_file::write(path, self.to_toml(title).as_bytes())
    }

    /// From the file's text.
    pub fn from_toml(text: &str) -> Result<Self> {
        let file: File = toml::from_str(text).map_err(|error| {
            let (line, reason) = line_of(text, &error);
            anyhow!("line {line}: {reason}")
        })?;
        ensure!(
            file.columns == COLUMNS,
            "columns: {:?}, must be {COLUMNS:?}",
            file.columns
        );
        let row = |(index, numbers): (usize, &Vec<f64>)| {
            let Ok([s, x, y, z, nx, ny, nz]) = <[f64; 7]>::try_from(numbers.as_slice()) else {
                bail!("points[{index}]: {} numbers, must be 7", numbers.len());
            };
            if let Some(column) = numbers.iter().position(|number| !number.is_finite()) {
                bail!(
                    "points[{index}] {}: {}, must be a number",
                    COLUMNS[column],
                    numbers[column]
                );
            }
            let normal = Vector3::new(nx, ny, nz);
            let size = normal.norm();
            ensure!(
                (0.99..=1.01).contains(&size),
                "points[{index}] nx, ny, nz: length {size:.3}, must be 1 within 0.01"
            );
            Ok(TaughtRow {
                s: s * 1e-3,
                point: Vector3::new(x, y, z) * 1e-3,
                normal: normal / size,
            })
        };
        let rows = file.points.iter().enumerate().map(row).collect::<Result<Vec<_>>>()?;
        let joint = file.joint;
        Ok(Self {
            joint,
            ..Self::new(rows, file.length_mm * 1e-3)?
        })
    }

    /// The file's text.
    pub fn to_toml(&self, title: &str) -> String {
        let joint = self.joint().map_or(String::new(), |name| format!("joint = {name:?}\n"));
        let mut text = format!(
            "# {title}\n\
             # Points of the seam in the base frame and the sheet's unit normal there, toward the nozzle, by distance s along the seam.\n\
             # The bead is laid from s = 0 to length_mm; points beyond it lead the nozzle out.\n\
             {joint}length_mm = {:.3}\ncolumns = {COLUMNS:?}\npoints = [\n",
            self.length * 1e3
        );
        for TaughtRow { s, point, normal } in &self.rows {
            let (p, n) = (point * 1e3, normal);
            // Writing to a string does not fail.
            let _ = writeln!(
                text,
                "  [{:9.3}, {:9.4}, {:9.4}, {:9.4}, {:9.6}, {:9.6}, {:9.6}],",
                s * 1e3,
                p.x,
                p.y,
                p.z,
                n.x,
                n.y,
                n.z
            );
        }
        text + "]\n"
    }

    fn check(&self) -> Result<()> {
        let (rows, length_mm) = (&self.rows, self.length * 1e3);
        ensure!(
            ROWS.contains(&rows.len()),
            "points: {} rows, must be {} to {}",
            rows.len(),
            ROWS.start(),
            ROWS.end()
        );
        ensure!(
            LENGTH_MM.contains(&length_mm),
            "length_mm: {length_mm:.3}, must be {} to {}",
            LENGTH_MM.start(),
            LENGTH_MM.end()
        );
        let last_mm = rows[rows.len() - 1].s * 1e3;
        ensure!(
            length_mm <= last_mm + 1e-3,
            "length_mm: {length_mm:.3}, must be at most the last point's s_mm, {last_mm:.3}"
        );
        ensure!(
            rows[0].s.abs() < 1e-9,
            "points[0] s_mm: {:.3}, must be 0",
            rows[0].s * 1e3
        );
        for (index, row) in rows.iter().enumerate() {
            for (name, value) in ["x_mm", "y_mm", "z_mm"].iter().zip(row.point.iter()) {
                ensure!(
                    value.abs() * 1e3 <= REACH_MM,
                    "points[{index}] {name}: {:.3}, must be within ±{REACH_MM}",
                    value * 1e3
                );
            }
        }
        for (index, pair) in (1..).zip(rows.windows(2)) {
            let [before, row] = pair else { continue };
            let step = (row.s - before.s) * 1e3;
            ensure!(
                step > 1e-3 && step <= STEP_MM,
                "points[{index}] s_mm: {:.3} after {:.3}, must be larger by at most {STEP_MM}",
                row.s * 1e3,
                before.s * 1e3
            );
            let way = row.point - before.point;
            let (apart, most) = (way.norm() * 1e3, step * (1.0 + JUMP.0) + JUMP.1);
            ensure!(
                apart <= most,
                "points[{index}]: a jump of {apart:.3} mm where s_mm grows by {step:.3}, allowed {most:.3}"
            );
            let least = step * (1.0 - SHORT) - JUMP.1;
            ensure!(
                apart >= least,
                "points[{index}]: {apart:.3} mm from the one before where s_mm grows by {step:.3}, must be at least {least:.3}"
            );
            let turn = before.normal.angle(&row.normal).to_degrees();
            ensure!(
                turn <= TURN_DEG,
                "points[{index}] nx, ny, nz: turned by {turn:.1}° from the one before, allowed {TURN_DEG}"
            );
            let lean = (90.0 - way.angle(&row.normal).to_degrees()).abs();
            ensure!(
                apart < 1e-3 || lean <= TURN_DEG,
                "points[{index}] nx, ny, nz: {lean:.1}° off the square to the seam, allowed {TURN_DEG}"
            );
        }
        // Too short a jump to show in a step's length turns the way there and back.
        for (index, four) in (2..).zip(rows.windows(4)) {
            let [a, b, c, d] = four else { continue };
            let [before, way, after] = [b.point - a.point, c.point - b.point, d.point - c.point];
            let (there, back) = (
                way.normalize() - before.normalize(),
                after.normalize() - way.normalize(),
            );
            let turn = way.angle(&before).min(way.angle(&after));
            let (turn, aside) = (turn.to_degrees(), way.norm() * turn.sin() * 1e3);
            ensure!(
                there.dot(&back) >= 0.0 || turn <= ASIDE.0 || aside <= ASIDE.1,
                "points[{index}]: a jump of {aside:.3} mm aside, allowed {}",
                ASIDE.1
            );
        }
        Ok(())
    }

    /// The seam at distance `s` (m): cubic between points, straight on past the ends.
    pub fn at(&self, s: f64) -> TaughtPlace {
        let rows = &self.rows;
        let last = rows.len() - 1;
        let inside = s.clamp(0.0, rows[last].s);
        let index = rows.partition_point(|row| row.s <= inside).clamp(1, last) - 1;
        let (a, b) = (&rows[index], &rows[index + 1]);
        let h = b.s - a.s;
        let u = (inside - a.s) / h;
        let (ta, tb) = (self.slope(index), self.slope(index + 1));
        let (u2, u3) = (u * u, u * u * u);
        let rise = 3.0 * u2 - 2.0 * u3;
        let point = a.point + (b.point - a.point) * rise + (ta * (u3 - 2.0 * u2 + u) + tb * (u3 - u2)) * h;
        let slope =
            (b.point - a.point) * (6.0 * (u - u2) / h) + ta * (3.0 * u2 - 4.0 * u + 1.0) + tb * (3.0 * u2 - 2.0 * u);
        let tangent = slope.normalize();
        // Square to each other, as the core takes them. The file's normals are the sheet's, smoothed over more of it; so is the course that they
        // are squared to, for every ripple of a tangent would swing the tool.
        let course = (self.near(inside + COURSE) - self.near(inside - COURSE)).normalize();
        let normal = across(a.normal + (b.normal - a.normal) * u, &course);
        let tangent = across(tangent, &normal);
        TaughtPlace {
            point: point + tangent * (s - inside),
            tangent,
            normal,
        }
    }

    /// The point at distance `s` (m), linear between points; the seam's nearest end beyond them.
    fn near(&self, s: f64) -> Vector3<f64> {
        let rows = &self.rows;
        let last = rows.len() - 1;
        let index = rows.partition_point(|row| row.s <= s).clamp(1, last) - 1;
        let (a, b) = (&rows[index], &rows[index + 1]);
        a.point + (b.point - a.point) * ((s - a.s) / (b.s - a.s)).clamp(0.0, 1.0)
    }

    /// Derivative at a row: of the parabola through it and its neighbours.
    fn slope(&self, index: usize) -> Vector3<f64> {
        let rows = &self.rows;
        let way = |i: usize| (rows[i + 1].point - rows[i].point) / (rows[i + 1].s - rows[i].s);
        if index == 0 {
            return way(0);
        }
        if index + 1 == rows.len() {
            return way(index - 1);
        }
        let (before, after) = (rows[index].s - rows[index - 1].s, rows[index + 1].s - rows[index].s);
        (way(index - 1) * after + way(index) * before) / (before + after)
    }
}

/// The unit vector of what of `vector` is square to the unit vector `axis`.
fn across(vector: Vector3<f64>, axis: &Vector3<f64>) -> Vector3<f64> {
    (vector - axis * vector.dot(axis)).normalize()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A quarter of R150 in 2 mm steps.
    fn arc() -> TaughtSeam {
        let rows = (0..=118)
            .map(|k| {
                let s = 0.002 * f64::from(k);
                let (sin, cos) = (s / 0.15).sin_cos();
                TaughtRow {
                    s,
                    point: Vector3::new(0.4 + 0.15 * sin, 0.15 * (1.0 - cos), 0.2),
                    normal: Vector3::z(),
                }
            })
            .collect();
        TaughtSeam::new(rows, 0.236).unwrap()
    }

    #[test]
    fn a_seam_reads_back_from_its_file_to_a_tenth_of_a_micrometre() {
        let seam = arc();
        let again = TaughtSeam::from_toml(&seam.to_toml("an arc")).unwrap();
        assert!((again.length() - seam.length()).abs() < 1e-9);
        for (a, b) in seam.rows().iter().zip(again.rows()) {
            assert!((a.point - b.point).norm() < 1e-7 && (a.s - b.s).abs() < 1e-9);
        }
    }

    #[test]
    fn between_rows_an_arc_is_met_within_two_micrometres() {
        let seam = arc();
        for k in 0..2360 {
            let place = seam.at(f64::from(k) * 1e-4);
            let radius = (place.point - Vector3::new(0.4, 0.15, 0.2)).norm();
            assert!((radius - 0.15).abs() < 2e-6, "{radius} m");
            assert!(place.normal.angle(&Vector3::z()) < 1e-9);
        }
        let beyond = seam.at(0.246);
        assert!((beyond.point - seam.at(0.236).point).norm() - 0.010 < 1e-9);
    }

    #[test]
    fn the_joints_shape_reads_back_and_may_be_missing() {
        let seam = arc();
        assert_eq!(TaughtSeam::from_toml(&seam.to_toml("an arc")).unwrap().joint(), None);
        let text = seam.of_joint("vee".into()).to_toml("an arc");
        assert!(text.contains("\njoint = \"vee\"\n"));
        assert_eq!(TaughtSeam::from_toml(&text).unwrap().joint(), Some("vee"));
    }

    #[test]
    fn a_normal_that_leans_along_the_seam_is_put_square_to_it() {
        let text = arc()
            .to_toml("an arc")
            .replace("0.000000,  0.000000,  1.000000", "0.050000,  0.000000,  0.998750");
        let seam = TaughtSeam::from_toml(&text).unwrap();
        for k in 0..236 {
            let place = seam.at(f64::from(k) * 1e-3);
            assert!(place.normal.dot(&place.tangent).abs() < 1e-12, "at {k} mm");
        }
    }

    #[test]
    fn what_could_lead_an_arm_astray_is_refused_with_field_value_and_range() {
        let text = arc().to_toml("an arc");
        let row = |k: usize| {
            text.lines()
                .filter(|line| line.starts_with("  ["))
                .nth(k)
                .unwrap()
                .to_string()
        };
        let replaced = |from: &str, to: &str| {
            assert!(text.contains(from), "{from}");
            format!("{:#}", TaughtSeam::from_toml(&text.replace(from, to)).unwrap_err())
        };
        let error = replaced(&row(50), &row(50).replacen("200.0000", "203.0000", 1));
        assert!(
            error.contains("points[50]: a jump of 3.6") && error.contains("allowed 2.240"),
            "{error}"
        );
        let error = replaced(&row(50), &row(50).replacen("200.0000", "200.6000", 1));
        assert!(
            error.contains("a jump of 0.") && error.contains("aside, allowed 0.3"),
            "{error}"
        );
        let error = replaced(&row(51), &row(49));
        assert!(error.contains("points[51] s_mm: 98.000 after 100.000"), "{error}");
        let error = replaced("length_mm = 236.000", "length_mm = 240.0");
        assert!(
            error.contains("length_mm: 240.000, must be at most the last point's s_mm, 236.000"),
            "{error}"
        );
        let error = replaced("length_mm = 236.000", "length_mm = -1.0");
        assert!(error.contains("must be 10 to 2400"), "{error}");
        let error = replaced(&row(7), &row(7).replace("1.000000", "0.500000"));
        assert!(
            error.contains("points[7] nx, ny, nz: length 0.500, must be 1 within 0.01"),
            "{error}"
        );
        let error = replaced(
            &row(7),
            &row(7).replace(" 0.000000,  0.000000,  1.000000", " 0.0, 1.0, 0.0"),
        );
        assert!(error.contains("points[7] nx, ny, nz: turned by 90.0°"), "{error}");
        let error = replaced(&row(7), "  [14.0, 1.0],");
        assert!(error.contains("points[7]: 2 numbers, must be 7"), "{error}");
        let error = replaced("\"nz\"", "\"nw\"");
        assert!(error.contains("columns"), "{error}");
        let error = replaced("columns", "kolumns");
        assert!(error.starts_with("line 5: ") && error.contains("kolumns"), "{error}");
        assert_eq!(error.lines().count(), 1, "{error}");
        let error = replaced(&row(3), &row(3).replace("200.0000", "nan"));
        assert!(error.contains("points[3] z_mm: NaN, must be a number"), "{error}");
    }
}
