//! Cutting grids of structured parts along index planes, recursively, for workers in halves.

use mechanics::piece::Region;

use super::crew::Crew;

/// Recursive bisection along index planes, of all boxes together. Where whole planes miss the share of the workers by more than `near`, the
/// last plane is divided once more, so that the miss is at most half a column along the part's shortest axis. Of `axes` it
/// is that with the smaller interface.
pub fn cut_planes(
    boxes: Vec<Cells>,
    (axes, shortest, near): (&[usize], usize, f64),
    crew: Crew<'_>,
    count: &dyn Fn(&Cells) -> u64,
    out: &mut Vec<(Region, usize)>,
) {
    let volume: u64 = boxes.iter().map(count).sum();
    if crew.workers.len() == 1 || volume <= 1 {
        let worker = crew.fastest();
        out.extend(boxes.into_iter().map(|Cells { low, high }| (Region::Cells { low, high }, worker)));
        return;
    }
    let mut best: Option<(f64, Cut, usize)> = None;
    for split in crew.splits() {
        let target = volume as f64 * crew.divided(split)[0].speed() / crew.speed();
        for &axis in axes {
            let Some(whole) = Cut::whole(&boxes, axis, target, count) else { continue };
            let interface = volume as f64 / whole.planes;
            let missed = near * target.min(volume as f64 - target);
            let (cut, dearer) = match Cut::jagged(&boxes, axis, shortest, target, count) {
                Some(jagged) if whole.missed > missed && jagged.missed < whole.missed => (jagged, JAG),
                _ => (whole, 1.0),
            };
            let score = interface * dearer + cut.missed;
            if best.as_ref().is_none_or(|(least, ..)| score < least * (1.0 - 1e-9)) {
                best = Some((score, cut, split));
            }
        }
    }
    let Some((_, cut, split)) = best else {
        let worker = crew.fastest();
        out.extend(boxes.into_iter().map(|Cells { low, high }| (Region::Cells { low, high }, worker)));
        return;
    };
    let (mut below, mut above) = (Vec::new(), Vec::new());
    for cells in &boxes {
        let (low, rest) = cells.at(cut.axis, cut.plane);
        below.extend(low);
        let Some(rest) = rest else { continue };
        match cut.row {
            None => above.push(rest),
            Some((second, row)) => {
                let (layer, beyond) = rest.at(cut.axis, cut.plane + 1);
                above.extend(beyond);
                let (low, high) = layer.map_or((None, None), |layer| layer.at(second, row));
                below.extend(low);
                above.extend(high);
            }
        }
    }
    join(&mut below);
    join(&mut above);
    let [first, others] = crew.divided(split);
    cut_planes(below, (axes, shortest, near), first, count, out);
    cut_planes(above, (axes, shortest, near), others, count, out);
}

/// Joins boxes that make up one, as those of a divided plane do on both sides once they are cut across it.
fn join(boxes: &mut Vec<Cells>) {
    let mut one = 0;
    while one < boxes.len() {
        match (one + 1..boxes.len()).find_map(|other| Some((other, boxes[one].with(&boxes[other])?))) {
            Some((other, both)) => {
                boxes[one] = both;
                boxes.remove(other);
                one = 0;
            }
            None => one += 1,
        }
    }
}

/// Sets of axes to cut along, in the order in which equals are preferred: a lane set lies along I, so a cut across J has fewer of them at
/// the border and leaves rows long.
pub const AXES: &[&[usize]] = &[&[1, 0, 2], &[1, 0], &[1, 2], &[0, 2], &[1], &[0], &[2]];

/// How near to the share of the workers whole planes have to come, relative to the smaller side. A plane that is divided brings shares
/// nearer, and the workers at it more nodes and neighbours.
pub const NEARS: [f64; 4] = [0.002, 0.02, 0.04, 0.08];
/// How much a jagged interface counts against a plane one.
const JAG: f64 = 1.1;

/// Elements of a lane set, which are neighbours along I.
const LANES: f64 = 4.5;

/// A box of cells of a structured part.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Cells {
    pub low: [u32; 3],
    pub high: [u32; 3],
}

impl Cells {
    pub fn volume(&self) -> u64 {
        (0..3).map(|a| u64::from(self.high[a] - self.low[a])).product()
    }

    /// How many nodes both have.
    pub fn nodes_shared_with(&self, other: &Self) -> f64 {
        let along = |a: usize| {
            f64::from((self.high[a].min(other.high[a]) + 1).saturating_sub(self.low[a].max(other.low[a])))
        };
        (0..3).map(along).product()
    }

    /// Cells of each that are computed with those at the faces that both have: a lane set of them along I, and one across J or K.
    pub fn border_with(&self, other: &Self) -> f64 {
        let along = |a: usize| self.high[a].min(other.high[a]).saturating_sub(self.low[a].max(other.low[a]));
        let cells = |a: usize| f64::from(along(a));
        // Boxes do not overlap: along one axis at least they have no cell in common.
        match [0, 1, 2].map(|a| along(a) == 0) {
            [true, false, false] => LANES * cells(1) * cells(2),
            [false, true, false] => cells(0) * cells(2),
            [false, false, true] => cells(0) * cells(1),
            _ => 0.0,
        }
    }

    /// Both as one box, if they make up one.
    pub fn with(&self, other: &Self) -> Option<Self> {
        let differs =
            |axis: &usize| (self.low[*axis], self.high[*axis]) != (other.low[*axis], other.high[*axis]);
        let axis = (0..3).find(differs)?;
        let abut = self.high[axis] == other.low[axis] || other.high[axis] == self.low[axis];
        if !abut || (axis + 1..3).any(|axis| differs(&axis)) {
            return None;
        }
        let mut both = *self;
        both.low[axis] = self.low[axis].min(other.low[axis]);
        both.high[axis] = self.high[axis].max(other.high[axis]);
        Some(both)
    }

    /// What lies below index plane `plane` of an axis, and the rest.
    fn at(&self, axis: usize, plane: u32) -> (Option<Self>, Option<Self>) {
        let plane = plane.clamp(self.low[axis], self.high[axis]);
        let (mut below, mut above) = (*self, *self);
        below.high[axis] = plane;
        above.low[axis] = plane;
        ((below.volume() > 0).then_some(below), (above.volume() > 0).then_some(above))
    }
}

/// Where boxes are cut: below a plane, and of that plane below a row of another axis.
struct Cut {
    axis: usize,
    plane: u32,
    row: Option<(usize, u32)>,
    /// Elements beside the target.
    missed: f64,
    /// Planes along the axis that the boxes have on average.
    planes: f64,
}

impl Cut {
    /// The plane whose lower side is nearest to `target` elements, with something on both sides.
    fn whole(boxes: &[Cells], axis: usize, target: f64, count: &dyn Fn(&Cells) -> u64) -> Option<Self> {
        let low = boxes.iter().map(|c| c.low[axis]).min()?;
        let high = boxes.iter().map(|c| c.high[axis]).max()?;
        let lower = |plane: u32| below(boxes, axis, plane, count) as f64;
        let missed = |plane: u32| (lower(plane) - target).abs();
        if low + 1 >= high {
            return None;
        }
        // What lies below grows from plane to plane, so the nearest is one of two; of planes with as much below the first.
        let beyond = first_plane(low + 1, high - 1, |plane| lower(plane) >= target);
        let before = lower((beyond - 1).max(low + 1));
        let before = first_plane(low + 1, beyond, |plane| lower(plane) >= before);
        let best = if missed(beyond) < missed(before) { beyond } else { before };
        let planes = f64::from(high - low);
        Some(Self { axis, plane: best, row: None, missed: missed(best), planes })
    }

    /// The same with the plane that crosses the target divided along the longer of the other axes; no part is cut
    /// along its shortest for that.
    fn jagged(
        boxes: &[Cells],
        axis: usize,
        shortest: usize,
        target: f64,
        count: &dyn Fn(&Cells) -> u64,
    ) -> Option<Self> {
        let second = if axis == shortest { (axis + 1) % 3 } else { 3 - axis - shortest };
        let low = boxes.iter().map(|c| c.low[axis]).min()?;
        let high = boxes.iter().map(|c| c.high[axis]).max()?;
        let lower = |plane: u32| below(boxes, axis, plane, count) as f64;
        let plane = first_plane(low + 1, high, |plane| lower(plane) > target) - 1;
        let before = below(boxes, axis, plane, count) as f64;
        let layer: Vec<Cells> = boxes
            .iter()
            .filter_map(|c| c.at(axis, plane).1)
            .filter_map(|c| c.at(axis, plane + 1).0)
            .collect();
        let row = Self::whole(&layer, second, target - before, count)?;
        let planes = f64::from(high - low);
        Some(Self { axis, plane, row: Some((second, row.plane)), missed: row.missed, planes })
    }
}

/// The first plane from `from` on of which `is_there` is true; it stays true from there on, and `end` stands for none before it.
fn first_plane(mut from: u32, mut end: u32, is_there: impl Fn(u32) -> bool) -> u32 {
    while from < end {
        let middle = from + (end - from) / 2;
        if is_there(middle) { end = middle } else { from = middle + 1 }
    }
    end
}

/// Elements that count below a plane.
fn below(boxes: &[Cells], axis: usize, plane: u32, count: &dyn Fn(&Cells) -> u64) -> u64 {
    boxes.iter().filter_map(|c| c.at(axis, plane).0).map(|c| count(&c)).sum()
}
