//! Joining crossings into a board.
//!
//! A board grows from a crossing: along each of its edges the next crossing must lie where the last step leads, have an
//! edge of that direction, and the other colours about it, since on a chessboard colours alternate. What grows from
//! clutter stays small; what is large enough is cut to the size asked for.

use std::collections::{BTreeMap, BTreeSet};
use std::f64::consts::PI;

use super::saddle::Saddle;
use crate::calibration::Pixel;
use crate::calibration::board::Grid;

/// How far the next crossing may lie from where the last step leads, as a share of that step: perspective and lens
/// change a step by less than a quarter, and half a step is another corner's place.
const MAX_MISS: f64 = 0.35;
/// How far the direction of an edge may change from one crossing to the next, rad.
const MAX_TURN_RAD: f64 = 0.35;

type Cell = (i32, i32);
type Cells = BTreeMap<Cell, usize>;

/// The corners of a board of this grid in order, or how many corners the largest piece has.
pub fn assemble(saddles: &[Saddle], grid: Grid) -> Result<Vec<Pixel>, usize> {
    let mut tried = vec![false; saddles.len()];
    let mut largest = 0;
    // From the strongest contrast down: a board is the strongest thing in its image, mostly.
    let mut seeds: Vec<usize> = (0..saddles.len()).collect();
    seeds.sort_by(|a, b| saddles[*b].contrast.total_cmp(&saddles[*a].contrast));
    for seed in seeds {
        if tried[seed] {
            continue;
        }
        let cells = grow(saddles, seed);
        cells.values().for_each(|member| tried[*member] = true);
        largest = largest.max(cells.len());
        if let Some(corners) = cut(saddles, &cells, grid) {
            return Ok(corners);
        }
    }
    Err(largest)
}

/// Everything that continues the crossing `seed`, which is cell (0, 0); its first edge runs along the cells' first index,
/// its second along the other, so that cells are right-handed as the image is.
fn grow(saddles: &[Saddle], seed: usize) -> Cells {
    let mut cells = Cells::from([((0, 0), seed)]);
    let mut taken = BTreeSet::from([seed]);
    // In rounds, because a cell may have to wait for its neighbours to tell the step.
    loop {
        let before = cells.len();
        for cell in cells.keys().copied().collect::<Vec<Cell>>() {
            for direction in [(1, 0), (0, 1), (-1, 0), (0, -1)] {
                let next = (cell.0 + direction.0, cell.1 + direction.1);
                if cells.contains_key(&next) {
                    continue;
                }
                if let Some(found) = continuation(saddles, &cells, cell, direction).filter(|found| taken.insert(*found))
                {
                    cells.insert(next, found);
                }
            }
        }
        if cells.len() == before {
            return cells;
        }
    }
}

/// Which of a crossing's two edges runs along `direction` at `cell`: they change places from cell to cell.
fn axis_along(cell: Cell, direction: Cell) -> usize {
    ((cell.0 + cell.1 + direction.1).rem_euclid(2)) as usize
}

/// The crossing that follows the one at `cell` in `direction`.
fn continuation(saddles: &[Saddle], cells: &Cells, cell: Cell, direction: Cell) -> Option<usize> {
    let place = |i: i32, j: i32| cells.get(&(i, j)).map(|member| saddles[*member].at);
    let (i, j) = cell;
    let (di, dj) = direction;
    let here = &saddles[*cells.get(&cell)?];
    // The step there, from the step before it, or from the same step on a neighbouring line.
    let before = place(i - di, j - dj).map(|before| here.at - before);
    let beside = || {
        [1, -1].into_iter().find_map(|side| {
            let (i, j) = (i + side * dj, j + side * di);
            Some(place(i + di, j + dj)? - place(i, j)?)
        })
    };
    let step = before.or_else(beside);
    let edge = here.axes[axis_along(cell, direction)];
    let suits = |saddle: &Saddle, away: &Pixel| {
        let along = away.y.atan2(away.x);
        // At the next crossing the same edge has its dark and bright sides the other way round.
        let there = saddle.axes[1 - axis_along(cell, direction)];
        between_lines(along, edge) <= MAX_TURN_RAD && between_lines(along, there) <= MAX_TURN_RAD
    };
    let candidates = saddles.iter().enumerate().filter_map(|(index, saddle)| {
        let away = saddle.at - here.at;
        let distance = match step {
            Some(step) => Some((away - step).norm()).filter(|miss| *miss <= MAX_MISS * step.norm()),
            // The first steps: the nearest along the edge, forward for +, backward for −.
            None if cell == (0, 0) => {
                let forward = away.x * edge.cos() + away.y * edge.sin();
                Some(away.norm()).filter(|_| forward * f64::from(di + dj) > 0.0)
            }
            None => None,
        }?;
        suits(saddle, &away).then_some((distance, index))
    });
    candidates.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, index)| index)
}

/// Angle between two lines, rad, 0 to π/2.
fn between_lines(a: f64, b: f64) -> f64 {
    let angle = (a - b).rem_euclid(PI);
    angle.min(PI - angle)
}

/// The corners in order, if the cells hold one complete grid, and one only: a larger board is not the one asked for.
fn cut(saddles: &[Saddle], cells: &Cells, grid: Grid) -> Option<Vec<Pixel>> {
    if cells.len() < grid.corners() {
        return None;
    }
    let mut first_cells = BTreeSet::new();
    let mut best: Option<((bool, f64), Vec<Pixel>)> = None;
    // Every way to lay the grid over the cells without a mirror: the cell of its origin, and the direction of its x.
    for (di, dj) in [(1, 0), (0, 1), (-1, 0), (0, -1)] {
        for (i, j) in cells.keys() {
            let cell = |at: usize| {
                let (column, row) = ((at % grid.columns) as i32, (at / grid.columns) as i32);
                (i + column * di - row * dj, j + column * dj + row * di)
            };
            let members: Option<Vec<&Saddle>> = (0..grid.corners())
                .map(|at| cells.get(&cell(at)).map(|index| &saddles[*index]))
                .collect();
            let Some(corners) = members else { continue };
            first_cells.extend((0..grid.corners()).map(cell).min());
            let key = order_key(corners[0], corners[1]);
            if best.as_ref().is_none_or(|(least, _)| key < *least) {
                best = Some((key, corners.iter().map(|corner| corner.at).collect()));
            }
        }
    }
    best.filter(|_| first_cells.len() == 1).map(|(_, corners)| corners)
}

/// Least for the order to take: its origin lies between dark squares, then it is nearest to the top left. `next` follows
/// the origin along x.
fn order_key(origin: &Saddle, next: &Saddle) -> (bool, f64) {
    let along_x = next.at - origin.at;
    let direction = along_x.y.atan2(along_x.x);
    // When the x line is crossed toward y from dark to bright, the square between x and y is bright.
    let bright = between_lines(direction, origin.axes[0]) < between_lines(direction, origin.axes[1]);
    (bright, origin.at.x + origin.at.y)
}
