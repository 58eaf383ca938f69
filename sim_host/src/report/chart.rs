//! One chart as SVG text: curves over a common axis, a band of what is allowed, marks along the bottom.
//!
//! Background and text have no colour of their own: the page gives them one, so that a chart reads on light and on dark.

use anyhow::{Result, anyhow};
use plotters::prelude::*;

/// Drawing units in a pixel of the page: plotters rounds to whole units, and curves drawn in whole pixels look like stairs.
const SCALE: u32 = 10;
/// Size of all text as plotters counts it: it writes 1/1.24 of it, so that this is 12 px.
const TEXT: u32 = 15;
/// Labels that even a low y axis may have. They stand at steps of 1, 2, 5, 10…, of which the next larger leaves at least a third: two of five.
const Y_LABELS: usize = 5;
/// Points that a curve keeps, per pixel of width; more could not be seen.
const POINTS_PER_PX: usize = 2;

/// Colours that keep apart on white and on near-black, for eyes of all kinds (after Okabe and Ito, 2008, darkened or lightened
/// to a middle luminance).
pub const COLOURS: [RGBColor; 6] = [
    RGBColor(0x2b, 0x7f, 0xd0), // blue
    RGBColor(0xe0, 0x7b, 0x1f), // orange
    RGBColor(0x1f, 0xa0, 0x78), // green
    RGBColor(0xc9, 0x4f, 0x8f), // pink
    RGBColor(0x8f, 0x6f, 0xd6), // violet
    RGBColor(0x7d, 0x8a, 0x97), // grey
];
/// What is allowed.
pub const GOOD: RGBColor = RGBColor(0x1f, 0xa0, 0x78);
/// What is refused.
pub const BAD: RGBColor = RGBColor(0xd6, 0x45, 0x45);
const AXIS: RGBColor = RGBColor(0x80, 0x88, 0x90);

/// A curve.
pub struct Curve {
    points: Vec<(f64, f64)>,
    colour: RGBColor,
    broad: bool,
}

impl Curve {
    /// Through `points` (x, y), x never falling, in one of [`COLOURS`].
    pub fn new(points: Vec<(f64, f64)>, colour: usize) -> Self {
        Self {
            points,
            colour: COLOURS[colour],
            broad: false,
        }
    }

    /// As [`Curve::new`], but broad and pale: the ground of another curve, which covers its middle where they agree.
    pub fn broad(points: Vec<(f64, f64)>, colour: usize) -> Self {
        Self {
            broad: true,
            ..Self::new(points, colour)
        }
    }

    fn style(&self) -> ShapeStyle {
        match self.broad {
            true => self.colour.mix(0.45).stroke_width(SCALE * 5),
            false => self.colour.stroke_width(SCALE * 3 / 2),
        }
    }
}

/// A chart. Points that are not finite are left out.
pub struct Chart {
    /// Width and height, px.
    pub size: (u32, u32),
    /// Quantity and unit along x; empty where the chart below says it.
    pub x: &'static str,
    /// Quantity and unit along y.
    pub y: String,
    /// What the y axis must show at least, if not the data alone; data beyond it widens it.
    pub y_least: Option<(f64, f64)>,
    /// Curves, drawn in this order.
    pub curves: Vec<Curve>,
    /// Limits of what is allowed, as a band or (from minus infinity) as an upper bound.
    pub allowed: Option<(f64, f64)>,
    /// Marks along the bottom: where, and whether it is a good one.
    pub marks: Vec<(f64, bool)>,
}

impl Chart {
    /// The chart as an `<svg>` element.
    pub fn svg(&self) -> Result<String> {
        let mut svg = String::new();
        self.draw(&mut svg)
            .map_err(|error| anyhow!("chart {:?}: {error}", self.y))?;
        // Shown at its own size by what shows it alone.
        let sized = |scale: u32| format!("width=\"{}\" height=\"{}\"", self.size.0 * scale, self.size.1 * scale);
        Ok(svg.replacen(&sized(SCALE), &sized(1), 1))
    }

    fn draw(&self, svg: &mut String) -> Result<(), Box<dyn std::error::Error>> {
        let px = |length: u32| length * SCALE;
        let curves: Vec<_> = self
            .curves
            .iter()
            .map(|curve| (self.thinned(&curve.points), curve.style()))
            .collect();
        let points = || curves.iter().flat_map(|(points, _)| points);
        let (left, right) = range(points().map(|point| point.0)).unwrap_or((0.0, 1.0));
        let (left, right) = if right > left {
            (left, right)
        } else {
            (left - 0.5, left + 0.5)
        };
        let least = self.y_least.into_iter().flat_map(|(low, high)| [low, high]);
        let (bottom, top) = range(points().map(|point| point.1).chain(least)).unwrap_or((0.0, 1.0));
        let margin = 0.06 * if top > bottom { top - bottom } else { 1.0 };
        let (bottom, top) = (bottom - margin, top + margin);

        let root = SVGBackend::with_string(svg, (px(self.size.0), px(self.size.1))).into_drawing_area();
        let mut chart = ChartBuilder::on(&root)
            .margin_top(px(8))
            .margin_right(px(14))
            .x_label_area_size(px(if self.x.is_empty() { 22 } else { 42 }))
            .y_label_area_size(px(64))
            .build_cartesian_2d(left..right, bottom..top)?;
        let decimals_x = decimals(right - left);
        let decimals_y = decimals(top - bottom);
        chart
            .configure_mesh()
            .light_line_style(TRANSPARENT)
            .bold_line_style(AXIS.mix(0.22).stroke_width(SCALE))
            .axis_style(AXIS.stroke_width(SCALE))
            .label_style(("sans-serif", px(TEXT)))
            .axis_desc_style(("sans-serif", px(TEXT)))
            .x_labels(self.size.0 as usize / 80)
            .y_labels((self.size.1 as usize / 30).max(Y_LABELS))
            .x_label_formatter(&|value| number(*value, decimals_x))
            .y_label_formatter(&|value| number(*value, decimals_y))
            .x_desc(self.x)
            .y_desc(self.y.as_str())
            .set_all_tick_mark_size(px(4))
            .draw()?;
        if let Some((low, high)) = self.allowed {
            let band = Rectangle::new([(left, low.max(bottom)), (right, high)], GOOD.mix(0.09).filled());
            chart.draw_series([band])?;
            for limit in [low, high].into_iter().filter(|limit| limit.is_finite()) {
                let style = GOOD.mix(0.8).stroke_width(SCALE);
                chart.draw_series(DashedLineSeries::new(
                    [(left, limit), (right, limit)],
                    px(5),
                    px(4),
                    style,
                ))?;
            }
        }
        for (points, style) in curves {
            chart.draw_series(LineSeries::new(points, style))?;
        }
        let tick = |(x, good): &(f64, bool)| {
            let (colour, height) = if *good { (GOOD, 0.05) } else { (BAD, 0.12) };
            let end = bottom + height * (top - bottom);
            PathElement::new([(*x, bottom), (*x, end)], colour.stroke_width(2 * SCALE))
        };
        chart.draw_series(
            self.marks
                .iter()
                .filter(|mark| (left..=right).contains(&mark.0))
                .map(tick),
        )?;
        root.present()?;
        Ok(())
    }

    /// The finite points; where there are more than can be seen, the lowest and the highest of each stretch, so that
    /// no peak is lost.
    fn thinned(&self, points: &[(f64, f64)]) -> Vec<(f64, f64)> {
        let finite: Vec<_> = points
            .iter()
            .copied()
            .filter(|(x, y)| x.is_finite() && y.is_finite())
            .collect();
        let most = self.size.0 as usize * POINTS_PER_PX;
        if finite.len() <= most {
            return finite;
        }
        let stretches = finite.chunks(finite.len().div_ceil(most / 2));
        stretches
            .flat_map(|stretch| {
                let by_y = |a: &&(f64, f64), b: &&(f64, f64)| a.1.total_cmp(&b.1);
                let mut ends: Vec<_> = stretch
                    .iter()
                    .min_by(by_y)
                    .into_iter()
                    .chain(stretch.iter().max_by(by_y))
                    .copied()
                    .collect();
                ends.sort_by(|a, b| a.0.total_cmp(&b.0));
                ends
            })
            .collect()
    }
}

/// Least and greatest; `None` of nothing.
fn range(values: impl Iterator<Item = f64>) -> Option<(f64, f64)> {
    values.fold(None, |range, value| {
        let (least, greatest) = range.unwrap_or((value, value));
        Some((least.min(value), greatest.max(value)))
    })
}

/// Digits after the point that tell the labels of an axis of this length apart.
fn decimals(length: f64) -> usize {
    (1.0 - length.log10().floor()).clamp(0.0, 6.0) as usize
}

/// As people print numbers: a true minus sign, and no "-0.0".
fn number(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$}");
    let digits = text.trim_start_matches('-');
    let zero = digits.chars().all(|c| matches!(c, '0' | '.'));
    if text.starts_with('-') && !zero {
        format!("−{digits}")
    } else {
        digits.to_string()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn chart(points: Vec<(f64, f64)>) -> Chart {
        let curves = vec![Curve::new(points, 0)];
        Chart {
            size: (400, 200),
            x: "t (s)",
            y: "y (mm)".into(),
            y_least: Some((0.0, 0.0)),
            curves,
            allowed: None,
            marks: vec![],
        }
    }

    #[test]
    fn a_thinned_curve_keeps_its_one_peak_and_its_order() {
        let mut points: Vec<_> = (0..10_000).map(|at| (at as f64, (at % 7) as f64)).collect();
        points[4321].1 = 99.0;
        points[5].1 = f64::NAN;
        let chart = chart(points);
        let thinned = chart.thinned(&chart.curves[0].points);
        assert!(thinned.len() <= 800, "{} points", thinned.len());
        assert!(thinned.contains(&(4321.0, 99.0)));
        assert!(thinned.is_sorted_by_key(|point| point.0));
    }

    #[test]
    fn a_chart_of_nothing_of_one_point_or_of_a_constant_is_still_drawn() {
        for points in [
            vec![],
            vec![(1.0, 2.0)],
            vec![(0.0, 0.0), (1.0, 0.0)],
            vec![(f64::NAN, f64::INFINITY)],
        ] {
            let svg = chart(points).svg().expect("drawn");
            assert!(svg.contains("t (s)") && svg.contains("y (mm)") && !svg.contains("NaN"));
        }
    }

    #[test]
    fn a_low_chart_has_two_labels_or_more_on_its_y_axis_however_long_that_is() {
        for tenths in 10..=100 {
            let top = 0.01 * f64::from(tenths);
            let low = Chart {
                size: (480, 120),
                ..chart(vec![(0.0, -0.9 * top), (1.0, top)])
            };
            let svg = low.svg().expect("drawn");
            let labels = svg.matches("text-anchor=\"end\"").count();
            assert!((2..=Y_LABELS).contains(&labels), "{labels} labels up to {top}");
        }
    }

    #[test]
    fn labels_have_the_digits_that_their_axis_needs() {
        assert_eq!([4.0, 0.3, 25.0, 4000.0].map(decimals), [1, 2, 0, 0]);
        assert_eq!(number(-0.6, 1), "−0.6");
        assert_eq!(number(-0.001, 1), "0.0");
    }
}
