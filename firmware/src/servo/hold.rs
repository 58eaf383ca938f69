//! Corrections between the samples that arrive: holds over distance along the taught path.
//!
//! Each look ahead gives a [`Knot`]: at this station the path must be shifted by so much. A [`Hold`] turns the knots into a
//! shift at every station. It keeps one segment, from the state (value, slope, curvature) in which the last one
//! ended to the next knot; when the nozzle's station passes the knot, the next segment is planned from there. So what has been
//! commanded is never revised, no later knot is needed to stay smooth, and knots need not be evenly spaced.
//!
//! | kind | between knots | thesis |
//! |---|---|---|
//! | zero | the last knot's value | 4.13 |
//! | first | a straight line | |
//! | second | two parabolas, at rest at every knot | (6.9), (6.10) as corrected in the spec |
//! | smooth | a quintic whose end slope and curvature are those of the parabola through the neighbouring knots | spec, "Better holds" |
//!
//! The smooth hold is C2 everywhere. Towards a lone step Δ it overshoots by 0.10 Δ where the knot after the next is known in
//! time (three periods of lead) and by 0.20 Δ where it is not. Without a next knot the kinds zero, first and second stand
//! still and the smooth one lets its slope decay; both say so ([`Held::starved`]).

mod segment;

use hal::{wire_enum, wire_struct};
use segment::Segment;

/// Channels of a correction: lateral (m, +y of Σ_N), height (m, +z of Σ_N), roll (rad, about x of Σ_N).
pub const CHANNELS: usize = 3;

/// One number per channel.
pub type Channels = [f32; CHANNELS];

/// Knots kept, passed ones included: at 30 mm per sample and 80 mm of lead three lie ahead.
const KNOTS: usize = 8;

/// Smallest distance to answer in, m. Knots must lie a third of that distance apart at least: dividing by less would turn
/// sensor noise into slope.
const ANSWER_MIN: f32 = 1e-3;

/// How to go from knot to knot.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(u8)]
pub enum HoldKind {
    /// Steps.
    Zero,
    /// Straight lines.
    First,
    /// The thesis's: stops at every knot.
    Second,
    /// C2 without stopping.
    #[default]
    Smooth,
}

wire_enum!(HoldKind {
    Zero,
    First,
    Second,
    Smooth
});

/// The correction that the path needs at one station.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Knot {
    /// Distance along the taught path, m.
    pub station: f32,
    /// Correction there.
    pub value: Channels,
}

wire_struct!(Knot {
    station: f32,
    value: Channels
});

/// The correction at one station.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Held {
    /// Correction.
    pub value: Channels,
    /// Its first derivative by station, per m.
    pub slope: Channels,
    /// Its second derivative by station, per m².
    pub curvature: Channels,
    /// No knot lies ahead: this is a guess.
    pub starved: bool,
}

/// Why a knot was not taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum KnotRefused {
    /// Its station is not far enough ahead of the newest knot's, or something in it is not a number.
    NotAhead,
    /// As many knots as can be kept lie ahead already.
    Full,
}

/// The hold of one run along the path.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hold {
    kind: HoldKind,
    /// Shortest distance in which to answer a knot that came late, m.
    answer: f32,
    knots: [Knot; KNOTS],
    count: u8,
    segment: Segment,
    /// Station of the last evaluation, m.
    station: f32,
    /// Station of the knot that the segment leads to, or last led to, m.
    answered: f32,
    /// The segment leads to no knot.
    starved: bool,
    /// The segment was planned without knowing what comes after its knot.
    short_sighted: bool,
}

wire_struct!(Hold {
    kind: HoldKind,
    answer: f32,
    knots: [Knot; KNOTS],
    count: u8,
    segment: Segment,
    station: f32,
    answered: f32,
    starved: bool,
    short_sighted: bool,
});

impl Hold {
    /// Starts at `start`, at rest. Once the shift has had to guess, it comes back to the knots over `answer` (m, at least 1 mm),
    /// not at once, and skips those that lie nearer or are passed; the spacing of the knots is a good choice.
    pub fn new(kind: HoldKind, start: Knot, answer: f32) -> Self {
        let mut knots = [Knot::default(); KNOTS];
        if let Some(first) = knots.first_mut() {
            *first = start;
        }
        Self {
            kind,
            answer: if answer > ANSWER_MIN { answer } else { ANSWER_MIN },
            knots,
            count: 1,
            segment: Segment::rest(start.station, &start.value),
            station: start.station,
            answered: start.station,
            starved: true,
            short_sighted: false,
        }
    }

    /// From here on `answer` (m, at least 1 mm), as [`Self::new`] has it, is another.
    pub fn set_answer(&mut self, answer: f32) {
        self.answer = if answer > ANSWER_MIN { answer } else { ANSWER_MIN };
    }

    /// Adds a knot ahead of all others; when the store is full the oldest goes.
    #[inline(never)] // a few times a second, from two places
    pub fn push(&mut self, knot: Knot) -> Result<(), KnotRefused> {
        let finite = knot.station.is_finite() && knot.value.iter().all(|v| v.is_finite());
        if !finite || knot.station < self.newest() + self.spacing() {
            return Err(KnotRefused::NotAhead);
        }
        if self.count as usize >= KNOTS {
            let [oldest, kept @ ..] = self.knots;
            if oldest.station > self.answered {
                return Err(KnotRefused::Full);
            }
            for (slot, knot) in self.knots.iter_mut().zip(kept) {
                *slot = knot;
            }
            self.count = (KNOTS - 1) as u8;
        }
        if let Some(slot) = self.knots.get_mut(self.count as usize) {
            *slot = knot;
            self.count += 1;
        }
        Ok(())
    }

    /// Station of the newest knot, m.
    pub fn newest(&self) -> f32 {
        self.known().last().map_or(self.answered, |knot| knot.station)
    }

    /// The correction at `station` (m). Stations must not go back; a smaller one than the last is taken as the last.
    pub fn value(&mut self, station: f32) -> Channels {
        self.go_to(station);
        self.segment.value(self.station)
    }

    /// The same with its derivatives.
    pub fn evaluate(&mut self, station: f32) -> Held {
        self.go_to(station);
        let mut held = self.segment.state(self.station);
        held.starved = self.starved;
        held
    }

    /// Goes on to `station`, and plans what is due by then.
    fn go_to(&mut self, station: f32) {
        if self.starved && self.newest() > self.answered {
            // A knot has come since: leave the guess where it is now.
            let here = self.segment.state(self.station);
            self.plan(self.station, &here);
        }
        if station > self.station {
            self.station = station;
        }
        if self.short_sighted && self.newest() > self.answered && self.segment.end() - self.station > self.answer {
            // What comes after the knot is known now: aim anew from where the shift is.
            self.replan();
        }
        // Every turn consumes a knot, but for the last two: the guess, and the rest after it.
        for _ in 0..KNOTS + 2 {
            if self.station < self.segment.end() {
                break;
            }
            let (end, state) = (self.segment.end(), self.segment.state(self.segment.end()));
            self.plan(end, &state);
        }
    }

    /// Knots in the store, oldest first.
    fn known(&self) -> impl DoubleEndedIterator<Item = &Knot> {
        self.knots.get(..self.count as usize).unwrap_or(&[]).iter()
    }

    /// Least distance between knots, m.
    fn spacing(&self) -> f32 {
        self.answer * (1.0 / 3.0)
    }

    /// Where a segment from `start` is to end, at which knot's value, and the knot after it. `None` if all are answered.
    fn target(&self, start: f32) -> Option<(f32, Knot, Option<Knot>)> {
        let on_a_knot = start - self.answered < 0.5 * self.spacing();
        let from = if on_a_knot {
            start + 0.5 * self.spacing()
        } else {
            start + self.answer
        };
        let mut ahead = self.known().filter(|knot| knot.station >= from);
        if let Some(knot) = ahead.next() {
            return Some((knot.station, *knot, ahead.next().copied()));
        }
        let newest = self.known().last().filter(|knot| knot.station > self.answered)?;
        Some((start + self.answer, *newest, None))
    }

    /// Aims the present segment anew at its knot, now that the next one is known.
    fn replan(&mut self) {
        self.short_sighted = false;
        let end = self.segment.end();
        let ahead = |station: f32| self.known().find(|knot| knot.station > station).copied();
        let knot = self.known().find(|knot| knot.station == self.answered).copied();
        if let (HoldKind::Smooth, Some(knot), Some(next)) = (self.kind, knot, ahead(self.answered)) {
            let state = self.segment.state(self.station);
            let aim = aim(self.station, &state, end, &knot.value, Some(&next));
            self.segment = Segment::quintic(self.station, end, &state, &aim);
        }
    }

    /// Plans the segment that starts at `start` in `state`.
    fn plan(&mut self, start: f32, state: &Held) {
        let Some((end, knot, next)) = self.target(start) else {
            self.segment = match self.kind {
                HoldKind::Smooth if !self.starved => Segment::decay(start, self.answer, state),
                _ => Segment::rest(start, &state.value),
            };
            self.starved = true;
            return;
        };
        self.answered = knot.station;
        self.starved = false;
        self.short_sighted = next.is_none();
        self.segment = match self.kind {
            HoldKind::Zero => Segment::rest_until(start, end, &state.value, &knot.value),
            HoldKind::First => Segment::line(start, end, &state.value, &knot.value),
            HoldKind::Second => Segment::parabolas(start, end, &state.value, &knot.value),
            HoldKind::Smooth => {
                Segment::quintic(start, end, state, &aim(start, state, end, &knot.value, next.as_ref()))
            }
        };
    }
}

/// Slope and curvature to pass a knot with: those of the parabola through it and its neighbours; with nothing known beyond
/// it, the slope that leads to it.
fn aim(start: f32, state: &Held, end: f32, value: &Channels, next: Option<&Knot>) -> Held {
    let length = end - start;
    let mut aim = Held {
        value: *value,
        ..Held::default()
    };
    for (i, value) in value.iter().enumerate() {
        let before = (value - state.value[i]) / length;
        (aim.slope[i], aim.curvature[i]) = match next {
            Some(next) => {
                let ahead = next.station - end;
                let after = (next.value[i] - value) / ahead;
                let both = 1.0 / (length + ahead);
                ((before * ahead + after * length) * both, 2.0 * (after - before) * both)
            }
            None => (before, 0.0),
        };
    }
    aim
}

#[cfg(test)]
mod tests;
