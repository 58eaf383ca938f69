//! Grey values as numbers: blurring, halving, reading between pixels.

use crate::image_file::GreyImage;

/// A grey image in single precision.
#[derive(Clone)]
pub struct Plane {
    /// Pixels in a row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    values: Vec<f32>,
}

impl Plane {
    /// The image's grey values, 0 to 255.
    pub fn of_image(image: &GreyImage) -> Self {
        Self {
            width: image.width,
            height: image.height,
            values: image.pixels.iter().map(|value| f32::from(*value)).collect(),
        }
    }

    /// Value of a pixel inside the image.
    pub fn at(&self, x: usize, y: usize) -> f64 {
        f64::from(self.values[y * self.width + x])
    }

    /// Value between pixels, bilinear; outside the image that of its nearest edge.
    pub fn sample(&self, x: f64, y: f64) -> f64 {
        let clamp = |at: f64, size: usize| at.clamp(0.0, (size - 1) as f64);
        let (x, y) = (clamp(x, self.width), clamp(y, self.height));
        let (left, top) = (x as usize, y as usize);
        let (right, bottom) = ((left + 1).min(self.width - 1), (top + 1).min(self.height - 1));
        let (fx, fy) = (x - left as f64, y - top as f64);
        (self.at(left, top) * (1.0 - fx) + self.at(right, top) * fx) * (1.0 - fy)
            + (self.at(left, bottom) * (1.0 - fx) + self.at(right, bottom) * fx) * fy
    }

    /// Half as many pixels each way, each the mean of four.
    pub fn halved(&self) -> Self {
        let (width, height) = ((self.width / 2).max(1), (self.height / 2).max(1));
        let mean = |x: usize, y: usize| {
            let (right, bottom) = ((2 * x + 1).min(self.width - 1), (2 * y + 1).min(self.height - 1));
            let sum = self.at(2 * x, 2 * y) + self.at(right, 2 * y) + self.at(2 * x, bottom) + self.at(right, bottom);
            (sum / 4.0) as f32
        };
        let values = (0..height).flat_map(|y| (0..width).map(move |x| mean(x, y))).collect();
        Self { width, height, values }
    }

    /// Blurred by a Gaussian of standard deviation `sigma` px, out to three of them.
    pub fn blurred(&self, sigma: f64) -> Self {
        let reach = (3.0 * sigma).ceil() as i64;
        let weight = |at: i64| (-0.5 * (at as f64 / sigma).powi(2)).exp();
        let sum: f64 = (-reach..=reach).map(weight).sum();
        let weights: Vec<(i64, f32)> = (-reach..=reach).map(|at| (at, (weight(at) / sum) as f32)).collect();
        let pass = |values: &[f32], step: usize, size: usize, along: &dyn Fn(usize) -> usize| -> Vec<f32> {
            (0..values.len())
                .map(|index| {
                    let at = along(index) as i64;
                    let begin = index as i64 - at * step as i64;
                    weights
                        .iter()
                        .map(|(by, weight)| {
                            let near = (at + by).clamp(0, size as i64 - 1);
                            weight * values[(begin + near * step as i64) as usize]
                        })
                        .sum()
                })
                .collect()
        };
        let rows = pass(&self.values, 1, self.width, &|index| index % self.width);
        let values = pass(&rows, self.width, self.height, &|index| index / self.width);
        Self { values, ..*self }
    }
}
