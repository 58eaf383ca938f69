//! The plane of light of a slit, from its line on a board whose pose is known in several views.
//!
//! Each pixel of the line is a point of the board's plane, so of the slit's. The plane is fitted to those points, each
//! weighted by how far one pixel moves it off the plane, so that what is least is the error in the image.

use anyhow::{Context, Result, ensure};
use nalgebra::{Isometry3, Matrix3, Point3, Vector3};

use super::Pixel;
use super::camera::Camera;

/// Slits that a sensor may have: that of the start view, by which a sensor with one slit tracks too, and the two by which one with two does, the
/// nearer to the nozzle first.
pub const PLANES: usize = 3;
/// Pixels of the line that a view must have.
pub const MIN_PIXELS: usize = 10;
/// Views that are needed: two lines span a plane, and a third tells whether they agree.
pub const MIN_VIEWS: usize = 3;
/// Least spread of the points across the direction in which they spread most, m, root mean square. Assumed: at 1 mm a
/// line known to 0.1 px of 0.12 mm leaves 0.1° in the plane's angle after 50 points.
const MIN_SPREAD_M: f64 = 0.001;
/// Rounds of weighting: the weights hardly change after the second.
const ROUNDS: usize = 5;

/// The slit's line in one view of the board.
#[derive(Clone, Debug)]
pub struct SlitView {
    /// Pose of the board in the camera.
    pub t_c_w: Isometry3<f64>,
    /// Centres of the line, px.
    pub pixels: Vec<Pixel>,
}

/// A plane of light in Σ_C: points p with normal·p = distance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SlitPlane {
    /// Unit normal, its x positive.
    pub normal: Vector3<f64>,
    /// Signed distance from the camera's centre, m.
    pub distance_m: f64,
}

impl SlitPlane {
    /// Angle φ between the plane and the camera's axis in the plane of x and z, rad: 45° in the paper's sensor.
    pub fn angle(&self) -> f64 {
        (-self.normal.z / self.normal.x).atan()
    }

    /// Where the plane crosses the camera's axis, m in front of its centre: h_z where the sensor has c = 0.
    pub fn crossing(&self) -> f64 {
        self.distance_m / self.normal.z
    }

    /// Point of the plane that a pixel shows, in Σ_C, m; none where the pixel looks along the plane or away from it.
    pub fn point(&self, camera: &Camera, pixel: &Pixel) -> Option<Point3<f64>> {
        on_plane(camera, pixel, &self.normal, self.distance_m)
    }
}

/// A slit's plane with what is left of its measurements.
#[derive(Clone, Debug)]
pub struct FittedSlit {
    /// The plane.
    pub plane: SlitPlane,
    /// Root mean square distance, in the image, of the measured line from that of the plane, px.
    pub rms_px: f64,
    /// The same per view, px.
    pub view_rms_px: Vec<f64>,
}

/// Fits the slit's plane to its lines.
pub fn fit(camera: &Camera, views: &[SlitView]) -> Result<FittedSlit> {
    ensure!(
        views.len() >= MIN_VIEWS,
        "slit views {}: must be at least {MIN_VIEWS}",
        views.len()
    );
    let mut measured = Vec::new();
    for (at, view) in views.iter().enumerate() {
        ensure!(
            view.pixels.len() >= MIN_PIXELS,
            "slit view {}: {} pixels of the line, must be at least {MIN_PIXELS}",
            at + 1,
            view.pixels.len()
        );
        let points = view
            .pixels
            .iter()
            .map(|pixel| Measured::new(camera, pixel, &view.t_c_w));
        let points: Option<Vec<Measured>> = points.collect();
        measured.push(points.with_context(|| format!("slit view {}: the board is seen edge on", at + 1))?);
    }
    let all: Vec<&Measured> = measured.iter().flatten().collect();
    let mut plane = weighted(&all, |_| 1.0)?;
    for _ in 0..ROUNDS {
        plane = weighted(&all, |point| {
            1.0 / point.off_per_pixel(&plane.normal).max(f64::MIN_POSITIVE)
        })?;
    }
    let rms = |points: &mut dyn Iterator<Item = &Measured>| {
        let (sum, count) = points.fold((0.0, 0), |(sum, count), point| {
            let off = plane.normal.dot(&point.at.coords) - plane.distance_m;
            (sum + (off / point.off_per_pixel(&plane.normal)).powi(2), count + 1)
        });
        (sum / f64::from(count)).sqrt()
    };
    Ok(FittedSlit {
        plane,
        rms_px: rms(&mut all.iter().copied()),
        view_rms_px: measured.iter().map(|points| rms(&mut points.iter())).collect(),
    })
}

/// A point of the line and how it moves when its pixel does.
struct Measured {
    at: Point3<f64>,
    by_pixel: [Vector3<f64>; 2],
}

impl Measured {
    fn new(camera: &Camera, pixel: &Pixel, t_c_w: &Isometry3<f64>) -> Option<Self> {
        let normal = t_c_w.rotation * Vector3::z();
        let distance = normal.dot(&t_c_w.translation.vector);
        let at = |pixel: Pixel| on_plane(camera, &pixel, &normal, distance);
        let here = at(*pixel)?;
        Some(Self {
            at: here,
            by_pixel: [at(pixel + Pixel::x())? - here, at(pixel + Pixel::y())? - here],
        })
    }

    /// Distance by which one pixel takes the point off a plane with this normal, m.
    fn off_per_pixel(&self, normal: &Vector3<f64>) -> f64 {
        self.by_pixel
            .iter()
            .map(|by| normal.dot(by).powi(2))
            .sum::<f64>()
            .sqrt()
    }
}

fn on_plane(camera: &Camera, pixel: &Pixel, normal: &Vector3<f64>, distance: f64) -> Option<Point3<f64>> {
    let ray = camera.ray(pixel).push(1.0);
    let depth = distance / normal.dot(&ray);
    (depth.is_finite() && depth > 0.0).then(|| Point3::from(ray * depth))
}

/// Plane with the least sum of squared distances, each times its weight.
fn weighted(points: &[&Measured], weight: impl Fn(&Measured) -> f64) -> Result<SlitPlane> {
    let squares: Vec<f64> = points.iter().map(|point| weight(point).powi(2)).collect();
    let sum: f64 = squares.iter().sum();
    let centre = points
        .iter()
        .zip(&squares)
        .map(|(point, square)| point.at.coords * *square)
        .sum::<Vector3<f64>>()
        / sum;
    let spread = points
        .iter()
        .zip(&squares)
        .fold(Matrix3::zeros(), |spread, (point, square)| {
            let off = point.at.coords - centre;
            spread + off * off.transpose() * (square / sum)
        });
    let eigen = spread.symmetric_eigen();
    let mut order = [0, 1, 2];
    order.sort_by(|a, b| eigen.eigenvalues[*a].total_cmp(&eigen.eigenvalues[*b]));
    let across = eigen.eigenvalues[order[1]].max(0.0).sqrt();
    ensure!(
        across >= MIN_SPREAD_M,
        "slit lines spread {:.2} mm across their direction: must be at least {:.0} mm; move the board along the view",
        across * 1e3,
        MIN_SPREAD_M * 1e3
    );
    let normal: Vector3<f64> = eigen.eigenvectors.column(order[0]).into();
    let normal = if normal.x < 0.0 { -normal } else { normal };
    Ok(SlitPlane {
        normal,
        distance_m: normal.dot(&centre),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const CAMERA: Camera = Camera {
        fx: 1250.0,
        fy: 1250.0,
        cx: 224.5,
        cy: 224.5,
        distortion: [0.05, 0.0, 0.0, 0.0, 0.0],
    };

    /// Line of the plane x = c − (h − z)·tan φ on boards that face the camera at the given distances.
    fn views(angle: f64, crossing: f64, distances: &[f64]) -> Vec<SlitView> {
        let view = |distance: &f64| {
            let x = (distance - crossing) * angle.tan();
            let point = |at: i32| CAMERA.project(&Point3::new(x, f64::from(at) * 0.001, *distance));
            SlitView {
                t_c_w: Isometry3::translation(0.0, 0.0, *distance),
                pixels: (-10..=10).map(point).collect(),
            }
        };
        distances.iter().map(view).collect()
    }

    #[test]
    fn the_plane_of_exact_lines_is_found_again() {
        let angle = 44_f64.to_radians();
        let found = fit(&CAMERA, &views(angle, 0.151, &[0.14, 0.145, 0.155])).expect("a plane");
        assert!((found.plane.angle() - angle).abs() < 1e-9, "{}", found.plane.angle());
        assert!(
            (found.plane.crossing() - 0.151).abs() < 1e-9,
            "{}",
            found.plane.crossing()
        );
        assert!(found.rms_px < 1e-6);
        let pixel = CAMERA.project(&Point3::new((0.16 - 0.151) * angle.tan(), 0.004, 0.16));
        let point = found.plane.point(&CAMERA, &pixel).expect("on the plane");
        assert!(
            (point - Point3::new((0.16 - 0.151) * angle.tan(), 0.004, 0.16)).norm() < 1e-8,
            "{point}"
        );
    }

    #[test]
    fn a_line_that_is_off_by_a_pixel_shows_as_such() {
        let mut views = views(0.8, 0.15, &[0.135, 0.14, 0.145, 0.15, 0.155, 0.16, 0.165]);
        views[3].pixels.iter_mut().for_each(|pixel| pixel.x += 1.0);
        let found = fit(&CAMERA, &views).expect("a plane");
        assert!(
            (found.view_rms_px[3] - 6.0 / 7.0).abs() < 0.05,
            "{:?}",
            found.view_rms_px
        );
    }

    #[test]
    fn lines_in_one_place_too_few_views_and_short_lines_are_refused() {
        let error = |views: &[SlitView]| format!("{:#}", fit(&CAMERA, views).expect_err("refused"));
        let message = error(&views(0.8, 0.15, &[0.15, 0.15, 0.15]));
        assert!(
            message.starts_with("slit lines spread 0.00 mm across their direction: must be at least 1 mm"),
            "{message}"
        );
        assert_eq!(
            error(&views(0.8, 0.15, &[0.14, 0.15])),
            "slit views 2: must be at least 3"
        );
        let mut short = views(0.8, 0.15, &[0.14, 0.15, 0.16]);
        short[1].pixels.truncate(9);
        assert_eq!(error(&short), "slit view 2: 9 pixels of the line, must be at least 10");
    }
}
