//! What a jitter is good for, in the bands that LinuxCNC's users know.
//!
//! Source: LinuxCNC user manual, "Latency Test" (docs/html/install/latency-test.html), on the greatest jitter: under about
//! 15 to 20 µs very nice results with software stepping; 30 to 50 µs still good, at a lower step rate; 100 µs or more no good
//! candidate for software stepping; over 1 ms none for LinuxCNC at all.

/// Ends of the bands, µs, and what they are called here. The manual says nothing of 50 to 100 µs.
const BANDS: [(f64, &str); 4] = [
    (20.0, "very nice"),
    (50.0, "good"),
    (100.0, "marginal"),
    (1000.0, "no software stepping"),
];

/// The band of the greatest start-to-start error, µs.
pub fn of(start_error_max_us: f64) -> &'static str {
    BANDS
        .iter()
        .find(|(end, _)| start_error_max_us < *end)
        .map_or("unsuitable", |(_, name)| name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_of_the_manuals_figures_falls_into_its_band() {
        let names = [9.075, 15.0, 40.0, 70.0, 100.0, 999.0, 1000.0].map(of);
        let expected = ["very nice", "very nice", "good", "marginal"];
        assert_eq!(names[..4], expected);
        assert_eq!(
            names[4..],
            ["no software stepping", "no software stepping", "unsuitable"]
        );
    }
}
