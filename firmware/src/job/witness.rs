//! What the sightings of late say together of one place of the path.
//!
//! No sighting is believed alone: a witness counts once another, near by and of another image or slit, agrees with it; one drawn to a
//! glint or a ghost is alone with its error. What those that count say of a place is the value there of a parabola through them, by
//! least squares with limited weights for what lies apart, and with what sheets may bend as a prior on its curvature.

use crate::servo::hold::{CHANNELS, Channels};

/// Sightings kept: two slits' over the 60 mm from the last knot to the furthest sight, three bursts of three.
const KEPT: usize = 18;

/// Half the stretch whose witnesses speak of its middle, m: on each side the distance between two bursts at 0.3 m/s and 100 ms. Near a
/// tight bend it is less.
pub const WINDOW: f32 = 0.025;

/// Furthest that the nearest witness on either side may be from the place, as a share of the window: beyond, it would be a guess.
const NEAR: f32 = 0.7;

/// Two sightings agree if their deviations differ by no more than this from what the seam's course lets expect, m: four standard
/// deviations of their difference on an ordinary surface.
const AGREEMENT: f32 = 0.3e-3;

/// And by this much more per distance between them: how much the seam may bend between corrections, m/m.
const TURNING: f32 = 0.04;

/// Furthest that two sightings may lie apart to confirm each other, m: the first and last of a burst at 0.4 m/s, and a retake.
const SAME_PLACE: f32 = 0.0135;

/// Standard deviation of a sighting whose sensor calls it exact, m.
const NOISE: f32 = 0.06e-3;

/// Residual at which a witness has a quarter of its weight left, m.
const APART: f32 = 0.15e-3;

/// Standard deviation, in units of [`NOISE`], of the parabola's slope and curvature, each by what it makes over the window: 2 mm of
/// deviation over 150 mm turn by 0.08 and bend by 3.5 per m at the peak.
const SLOPE: f32 = 20.0;
/// See [`SLOPE`].
const BEND: f32 = 8.0;

/// One sighting, on the path.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Witness {
    /// Distance along the taught path, m.
    pub station: f32,
    /// Deviation there.
    pub value: Channels,
    /// Its weight among others by the standard deviation that the sensor states.
    trust: f32,
    /// Another agrees.
    counts: bool,
}

impl Witness {
    /// Not confirmed yet; `sigma`: its standard deviation as the sensor states it, m.
    pub fn new(station: f32, value: Channels, sigma: f32) -> Self {
        let relative = sigma / NOISE;
        Self {
            station,
            value,
            trust: 1.0 / (1.0 + relative * relative),
            counts: false,
        }
    }

    /// Both speak of the same place and say the same of it: level with each other, or along the `trend` (m/m) of the corrections. Roll,
    /// measured over a few millimetres of sheet only, does not decide.
    fn agrees(&self, other: &Self, trend: [f32; 2]) -> bool {
        let apart = other.station - self.station;
        let allowed = AGREEMENT + TURNING * apart.abs();
        let [y, z, _] = self.value;
        let [other_y, other_z, _] = other.value;
        let along =
            |[a, b]: [f32; 2]| (other_y - y - a * apart).abs() <= allowed && (other_z - z - b * apart).abs() <= allowed;
        apart.abs() <= SAME_PLACE && (along([0.0; 2]) || along(trend))
    }
}

/// The witnesses of late.
#[derive(Clone, Debug)]
pub struct Witnesses {
    kept: [Witness; KEPT],
    count: usize,
    /// Where the next is put: over the oldest.
    next: usize,
    /// First and furthest station of those that count, m.
    span: Option<(f32, f32)>,
}

impl Witnesses {
    /// None yet.
    pub const EMPTY: Self = Self {
        kept: [Witness {
            station: 0.0,
            value: [0.0; CHANNELS],
            trust: 0.0,
            counts: false,
        }; KEPT],
        count: 0,
        next: 0,
        span: None,
    };

    /// Takes one in, and says whether it is confirmed. `trend`: slope (m/m) of the corrections there, lateral and in height.
    pub fn hear(&mut self, mut new: Witness, trend: [f32; 2]) -> bool {
        let (mut low, mut high) = (f32::INFINITY, f32::NEG_INFINITY);
        let mut reach = |witness: &Witness| {
            let station = witness.station;
            if witness.counts {
                low = if station < low { station } else { low };
                high = if station > high { station } else { high };
            }
        };
        for (place, old) in self.kept.iter_mut().take(self.count).enumerate() {
            if old.agrees(&new, trend) {
                old.counts = true;
                new.counts = true;
            }
            if place != self.next {
                reach(old);
            }
        }
        reach(&new);
        if let Some(place) = self.kept.get_mut(self.next) {
            *place = new;
        }
        self.count = (self.count + 1).min(KEPT);
        self.next = if self.next + 1 < KEPT { self.next + 1 } else { 0 };
        self.span = (low <= high).then_some((low, high));
        new.counts
    }

    /// Stations of those that count, m.
    fn counting(&self) -> impl Iterator<Item = f32> {
        let kept = self.kept.iter().take(self.count);
        kept.filter_map(|witness| witness.counts.then_some(witness.station))
    }

    /// How many count.
    pub fn heard(&self) -> usize {
        self.counting().count()
    }

    /// First and furthest station of which something is known, m.
    pub fn span(&self) -> Option<(f32, f32)> {
        self.span
    }

    /// What those within `window` (m) of `station` say of it; `None` where none that counts is near on either side.
    pub fn say(&self, station: f32, window: f32) -> Option<Channels> {
        let (low, high) = (station - NEAR * window, station + NEAR * window);
        let (mut before, mut after) = (false, false);
        for near in self.counting().filter(|s| *s > low && *s < high) {
            before |= near <= station;
            after |= near >= station;
        }
        if !before || !after {
            return None;
        }
        let [middle, ..] = self.course(station, window);
        Some(middle)
    }

    /// How the seam would go on from `from` to `station` (m), beyond what was seen: along the parabola of the last `window` (m). Roll,
    /// measured over a few millimetres of sheet only, is held.
    pub fn guess(&self, from: f32, station: f32, window: f32) -> Channels {
        let u = (station - from) / window;
        let [[y, z, roll], [y_slope, z_slope, _], [y_bend, z_bend, _]] = self.course(from, window);
        [y + u * (y_slope + u * y_bend), z + u * (z_slope + u * z_bend), roll]
    }

    /// Value, slope and curvature at `station`, distances in windows, of a robust parabola through the witnesses about it.
    fn course(&self, station: f32, window: f32) -> [Channels; 3] {
        let level = self.parabolas(station, window, None);
        self.parabolas(station, window, Some(&level))
    }

    /// Value, slope and curvature at `station`, distances in windows, of the parabolas through the witnesses about it; each counts the
    /// less the further it lies from `drawn`.
    fn parabolas(&self, station: f32, window: f32, drawn: Option<&[Channels; 3]>) -> [Channels; 3] {
        // Sums of w·uⁿ and of w·uⁿ·value, written out: a loop over n would keep them in memory.
        let [mut s0, mut s1, mut s2, mut s3, mut s4] = [1e-6, 0.0, 1.0 / (SLOPE * SLOPE), 0.0, 1.0 / (BEND * BEND)];
        let [mut r0, mut r1, mut r2] = [[0.0; CHANNELS]; 3];
        let add = |sums: &mut Channels, term: f32, [y, z, roll]: Channels| {
            let [sum_y, sum_z, sum_roll] = sums;
            *sum_y += term * y;
            *sum_z += term * z;
            *sum_roll += term * roll;
        };
        let inverse = 1.0 / window;
        for witness in self.kept.iter().take(self.count) {
            let u = (witness.station - station) * inverse;
            let fade = 1.0 - u * u;
            // Asked here and not by `counting`, whose loop within the loop costs a seventh.
            if !witness.counts || fade <= 0.0 {
                continue;
            }
            // Fades out toward the window's ends, so that nothing jumps when one enters it.
            let mut w0 = fade * witness.trust;
            let value @ [y, z, _] = witness.value;
            if let Some([[ay, az, _], [by, bz, _], [cy, cz, _]]) = drawn {
                let (y, z) = (y - ay - u * (by + u * cy), z - az - u * (bz + u * cz));
                let drop = 1.0 / (1.0 + (y * y + z * z) * (1.0 / (APART * APART)));
                w0 *= drop * drop;
            }
            let w1 = w0 * u;
            let w2 = w1 * u;
            let w3 = w2 * u;
            s0 += w0;
            s1 += w1;
            s2 += w2;
            s3 += w3;
            s4 += w3 * u;
            add(&mut r0, w0, value);
            add(&mut r1, w1, value);
            add(&mut r2, w2, value);
        }
        solve([s0, s1, s2, s3, s4], [r0, r1, r2])
    }
}

/// Solves the normal equations of a parabola, for all channels, by elimination; priors keep the pivots positive.
fn solve([s0, s1, s2, s3, s4]: [f32; 5], [r0, r1, r2]: [Channels; 3]) -> [Channels; 3] {
    // The prior on the slope is in s2, where it also meets the product of offset and curvature: there it is taken off.
    let cross = s2 - 1.0 / (SLOPE * SLOPE);
    let (f1, f2) = (s1 / s0, cross / s0);
    let (m11, m12, m22) = (s2 - f1 * s1, s3 - f1 * cross, s4 - f2 * cross);
    let g = m12 / m11;
    let pivot = m22 - g * m12;
    let mut solution = [[0.0; CHANNELS]; 3];
    let [a, b, c] = &mut solution;
    let unknowns = a.iter_mut().zip(b).zip(c);
    for (((a, b), c), ((r0, r1), r2)) in unknowns.zip(r0.iter().zip(&r1).zip(&r2)) {
        let (q1, q2) = (r1 - f1 * r0, r2 - f2 * r0);
        *c = (q2 - g * q1) / pivot;
        *b = (q1 - m12 * *c) / m11;
        *a = (r0 - s1 * *b - cross * *c) / s0;
    }
    solution
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A seam that bends by 1.5 per m, and turns and rolls on.
    fn seam(s: f32) -> Channels {
        [0.002 + 0.03 * s + 0.75 * s * s, -0.001 - 0.02 * s, 0.01 + 0.1 * s]
    }

    /// Heard of the seam at `stations`, one of them off by `error` in lateral direction.
    fn heard(stations: &[f32], wrong: usize, error: f32) -> Witnesses {
        let mut witnesses = Witnesses::EMPTY;
        for (index, &station) in stations.iter().enumerate() {
            let mut value = seam(station);
            value[0] += if index == wrong { error } else { 0.0 };
            witnesses.hear(Witness::new(station, value, 0.0), [0.03, -0.02]);
        }
        witnesses
    }

    const BURSTS: [f32; 9] = [0.000, 0.0045, 0.009, 0.021, 0.0255, 0.030, 0.042, 0.0465, 0.051];

    #[test]
    fn between_its_witnesses_a_bent_seam_is_known_to_a_hundredth_of_a_millimetre() {
        let witnesses = heard(&BURSTS, 99, 0.0);
        for station in [0.009, 0.015, 0.022, 0.036] {
            let [lateral, height, roll] = witnesses.say(station, WINDOW).unwrap();
            let [y, z, x] = seam(station);
            assert!((lateral - y).abs() < 2e-5, "{} m at {station}", lateral - y);
            assert!((height - z).abs() < 1e-6 && (roll - x).abs() < 1e-5, "{height} {roll}");
        }
        assert_eq!(witnesses.span(), Some((0.0, 0.051)));
    }

    #[test]
    fn one_alone_says_nothing_and_a_wrong_one_little() {
        let mut witnesses = Witnesses::EMPTY;
        assert!(!witnesses.hear(Witness::new(0.0, seam(0.0), 0.0), [0.0; 2]));
        assert_eq!((witnesses.say(0.0, WINDOW), witnesses.span()), (None, None));
        assert!(witnesses.hear(Witness::new(0.003, seam(0.003), 0.0), [0.0; 2]));
        assert!(witnesses.say(0.002, WINDOW).is_some());
        // 1 mm off is contradicted by all; 0.35 mm off is confirmed, and pulls little.
        for (error, pull) in [(0.001, 1.5e-5), (0.000_35, 6e-5)] {
            let lateral = heard(&BURSTS, 4, error).say(0.0255, WINDOW).unwrap()[0];
            let off = lateral - seam(0.0255)[0];
            assert!(off.abs() < pull, "{off} m for {error} m");
        }
    }

    #[test]
    fn beyond_what_was_seen_the_seam_is_taken_to_go_on_but_not_to_roll_on() {
        let witnesses = heard(&BURSTS, 99, 0.0);
        let (end, beyond) = (0.051, 0.066);
        let [lateral, height, roll] = witnesses.guess(end, beyond, WINDOW);
        let [y, z, _] = seam(beyond);
        assert!(
            (lateral - y).abs() < 0.4e-3,
            "{} m, where it goes 1.8 mm on",
            lateral - y
        );
        assert!((height - z).abs() < 5e-5, "{} m", height - z);
        let [_, _, last] = seam(end);
        assert!((roll - last).abs() < 2e-5, "{} rad from where it was", roll - last);
    }

    #[test]
    fn where_nothing_was_seen_nothing_is_said() {
        let witnesses = heard(&BURSTS[..3], 99, 0.0);
        assert!(witnesses.say(0.008, WINDOW).is_some() && witnesses.say(0.012, WINDOW).is_none());
        let mut gap = heard(&BURSTS[..3], 99, 0.0);
        for station in [0.060, 0.0645] {
            gap.hear(Witness::new(station, seam(station), 0.0), [0.03, -0.02]);
        }
        assert_eq!(gap.say(0.035, WINDOW), None, "25 mm from either side");
    }
}
