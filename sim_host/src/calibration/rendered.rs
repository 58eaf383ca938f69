//! Photographs of a chessboard for tests: ray-cast through the camera model, box-filtered, with a little noise.

use nalgebra::{Isometry3, Vector2, Vector3};
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;

use super::Pixel;
use super::board::Board;
use super::camera::Camera;
use super::slit_plane::SlitPlane;
use crate::image_file::GreyImage;

/// Rays per pixel, each way.
const RAYS: usize = 8;
/// Grey values of the squares, of the rim and of what is behind the board.
const DARK: f64 = 40.0;
const BRIGHT: f64 = 170.0;
const BEHIND: f64 = 90.0;
/// Width of the rim about the outer squares, in squares.
const RIM: f64 = 0.5;
/// Noise, grey values.
const NOISE: f64 = 1.5;
/// The slit's light: brightness added, grey values, and half the width of its Gaussian, m.
const LIGHT: f64 = 80.0;
const LIGHT_M: f64 = 0.000_3;

/// A photograph of the board, with the slit's light if one is given.
pub fn photograph(
    board: &Board,
    camera: &Camera,
    (width, height): (usize, usize),
    t_c_w: &Isometry3<f64>,
    slit: Option<&SlitPlane>,
    seed: u64,
) -> GreyImage {
    let mut random = Pcg64::new(u128::from(seed), 0);
    let normal = t_c_w.rotation * Vector3::z();
    let distance = normal.dot(&t_c_w.translation.vector);
    let grey = |ray: Vector2<f64>| {
        let ray = ray.push(1.0);
        let point = ray * (distance / normal.dot(&ray));
        let at = t_c_w.inverse_transform_point(&point.into()) / board.square_m;
        let (columns, rows) = (board.grid.columns as f64, board.grid.rows as f64);
        let within = |margin: f64| {
            (-margin..columns - 1.0 + margin).contains(&at.x) && (-margin..rows - 1.0 + margin).contains(&at.y)
        };
        let ground = if within(1.0) {
            // The square that the origin's corner points away from is dark.
            if ((at.x.floor() + at.y.floor()) as i64) % 2 == 0 {
                DARK
            } else {
                BRIGHT
            }
        } else if within(1.0 + RIM) {
            BRIGHT
        } else {
            BEHIND
        };
        let light = slit.map_or(0.0, |slit| {
            let off = slit.normal.dot(&point) - slit.distance_m;
            LIGHT * (-0.5 * (off / LIGHT_M).powi(2)).exp()
        });
        ground + light
    };
    // Within a pixel a lens is linear: its rays lie between those of its corners.
    let corner = |at: usize| {
        camera.ray(&Pixel::new(
            (at % (width + 1)) as f64 - 0.5,
            (at / (width + 1)) as f64 - 0.5,
        ))
    };
    let corners: Vec<Vector2<f64>> = (0..(width + 1) * (height + 1)).map(corner).collect();
    let pixels = (0..width * height).map(|at| {
        let first = at / width * (width + 1) + at % width;
        let [right, down] = [1, width + 1].map(|next| corners[first + next] - corners[first]);
        let ends = [Vector2::zeros(), right, down, right + down].map(|off| grey(corners[first] + off));
        let one_grey = ends.iter().all(|end| (end - ends[0]).abs() < 0.5);
        // Only a pixel that shows an edge needs all its rays.
        let rays = if one_grey { 1 } else { RAYS };
        let part = |ray: usize| (ray as f64 + 0.5) / rays as f64;
        let sum: f64 = (0..rays * rays)
            .map(|ray| grey(corners[first] + right * part(ray % rays) + down * part(ray / rays)))
            .sum();
        let noise: f64 = StandardNormal.sample(&mut random);
        (sum / (rays * rays) as f64 + NOISE * noise).round().clamp(0.0, 255.0) as u8
    });
    GreyImage {
        width,
        height,
        pixels: pixels.collect(),
    }
}
