//! Cutting grids of structured parts along index planes, for workers in halves, again and again, or in rows.

use mechanics::piece::Region;

use super::{crew::Crew, exchange::Border};

/// How a part is cut for its workers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Shape {
    /// In halves, again and again, across that of these axes where fewest nodes are shared.
    Halves(&'static [usize]),
    /// In slabs across the first of these axes, slabs in rows across the next, rows in bricks across the last. Slabs and rows beside each other
    /// are of different numbers of bricks, whose edges so do not meet: along three axes a brick has 14 neighbours, where a block of a grid has
    /// 26, and along two it has 6 for 8.
    Bricks(&'static [usize]),
}

use Shape::{Bricks, Halves};

/// Shapes to try, in the order in which equals are preferred: a lane set lies along I, so a cut across J has fewer of them at
/// the border and leaves rows long.
pub const SHAPES: &[Shape] = &[
    Halves(&[1, 0, 2]),
    Halves(&[1, 0]),
    Halves(&[1, 2]),
    Halves(&[0, 2]),
    Halves(&[1]),
    Halves(&[0]),
    Halves(&[2]),
    Bricks(&[1, 0]),
    Bricks(&[0, 1]),
    Bricks(&[1, 2]),
    Bricks(&[2, 1]),
    Bricks(&[1, 2, 0]),
    Bricks(&[2, 1, 0]),
    Bricks(&[0, 1, 2]),
];

/// How near to the share of the workers whole planes have to come, relative to the smaller side. A plane that is divided brings shares
/// nearer, and the workers at it more nodes and neighbours.
pub const NEARS: [f64; 4] = [0.002, 0.02, 0.04, 0.08];
/// How much a jagged interface counts against a plane one.
const JAG: f64 = 1.1;

/// Elements of a lane set, which are neighbours along I.
const LANES: f64 = 4.5;

/// A way to cut one part along index planes, of all its boxes together. Where whole planes miss the share of workers by more than `near`, the
/// last plane is divided once more, so that the miss is at most half a column along the part's shortest axis.
pub struct Cutting<'a> {
    pub shape: Shape,
    pub shortest: usize,
    pub near: f64,
    /// Elements of a box that count.
    pub count: &'a dyn Fn(&Cells) -> u64,
}

impl Cutting<'_> {
    /// Cuts boxes for these workers; `out` gets a region for each box that comes of it.
    pub fn cut(&self, boxes: Vec<Cells>, crew: Crew<'_>, out: &mut Vec<(Region, usize)>) {
        match self.shape {
            Bricks(axes) if crew.is_near() => self.bricks(boxes, axes, crew, out),
            Halves(axes) | Bricks(axes) => self.halves(boxes, axes, crew, out),
        }
    }

    fn halves(&self, boxes: Vec<Cells>, axes: &[usize], crew: Crew<'_>, out: &mut Vec<(Region, usize)>) {
        if crew.workers.len() == 1 || self.volume(&boxes) <= 1 {
            return give(boxes, crew, out);
        }
        let mut best: Option<(f64, Cut, usize)> = None;
        for split in crew.splits() {
            for &axis in axes {
                let Some((score, cut)) = self.across(&boxes, axis, crew.share(split)) else { continue };
                if best.as_ref().is_none_or(|(least, ..)| score < least * (1.0 - 1e-9)) {
                    best = Some((score, cut, split));
                }
            }
        }
        let Some((_, cut, split)) = best else { return give(boxes, crew, out) };
        let [below, above] = cut.of(&boxes);
        let [first, others] = crew.divided(split);
        self.cut(below, first, out);
        self.cut(above, others, out);
    }

    /// Groups of workers across the first axis, and bricks of each across the others.
    fn bricks(&self, boxes: Vec<Cells>, axes: &[usize], crew: Crew<'_>, out: &mut Vec<(Region, usize)>) {
        let n = crew.workers.len();
        let Some((&axis, inner)) = axes.split_first().filter(|_| n > 1 && self.volume(&boxes) > 1) else {
            return give(boxes, crew, out);
        };
        let planes = |a: usize| {
            let low = boxes.iter().map(|cells| cells.low[a]).min().unwrap_or(0);
            f64::from(boxes.iter().map(|cells| cells.high[a]).max().unwrap_or(0) - low)
        };
        // As many as make bricks as thick across this axis as across the others.
        let edge =
            libm::pow(axes.iter().map(|&a| planes(a)).product::<f64>() / n as f64, 1.0 / axes.len() as f64);
        let groups = if inner.is_empty() { n } else { ((planes(axis) / edge).round() as usize).clamp(1, n) };
        self.groups(boxes, (axis, inner), &uneven(n, groups), crew, out);
    }

    /// Boxes for groups of so many workers across an axis.
    fn groups(
        &self,
        boxes: Vec<Cells>,
        (axis, inner): (usize, &[usize]),
        sizes: &[usize],
        crew: Crew<'_>,
        out: &mut Vec<(Region, usize)>,
    ) {
        let (some, others) = sizes.split_at(sizes.len() / 2);
        let split = some.iter().sum();
        if split == 0 {
            return self.bricks(boxes, inner, crew, out);
        }
        let Some((_, cut)) = self.across(&boxes, axis, crew.share(split)) else {
            return self.bricks(boxes, inner, crew, out);
        };
        let [below, above] = cut.of(&boxes);
        let [first, last] = crew.divided(split);
        self.groups(below, (axis, inner), some, first, out);
        self.groups(above, (axis, inner), others, last, out);
    }

    /// The best cut across an axis with this share of the elements below it, and how bad it is.
    fn across(&self, boxes: &[Cells], axis: usize, share: f64) -> Option<(f64, Cut)> {
        let volume = self.volume(boxes) as f64;
        let target = volume * share;
        let whole = Cut::whole(boxes, axis, target, self.count)?;
        let interface = volume / whole.planes;
        let missed = self.near * target.min(volume - target);
        let (cut, dearer) = match Cut::jagged(boxes, axis, self.shortest, target, self.count) {
            Some(jagged) if whole.missed > missed && jagged.missed < whole.missed => (jagged, JAG),
            _ => (whole, 1.0),
        };
        Some((interface * dearer + cut.missed, cut))
    }

    fn volume(&self, boxes: &[Cells]) -> u64 {
        boxes.iter().map(self.count).sum()
    }
}

/// Gives boxes that are not cut any more to one worker.
fn give(boxes: Vec<Cells>, crew: Crew<'_>, out: &mut Vec<(Region, usize)>) {
    let worker = crew.fastest();
    out.extend(boxes.into_iter().map(|Cells { low, high }| (Region::Cells { low, high }, worker)));
}

/// Numbers of workers of groups beside each other, which differ: pairs of one with less than half of both and one with more, and one group
/// before them if their number is odd. All are 1 for as many groups as workers.
pub fn uneven(workers: usize, groups: usize) -> Vec<usize> {
    if groups >= workers {
        return vec![1; workers];
    }
    let first = (groups % 2 == 1).then(|| workers.div_ceil(groups));
    let (left, pairs) = (workers - first.unwrap_or(0), groups / 2);
    let pair = |at: usize| {
        let both = (at + 1) * left / pairs - at * left / pairs;
        [both - (both / 2 + 1), both / 2 + 1]
    };
    first.into_iter().chain((0..pairs).flat_map(pair)).filter(|&size| size > 0).collect()
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
    pub fn border_with(&self, other: &Self) -> Border {
        let along = |a: usize| self.high[a].min(other.high[a]).saturating_sub(self.low[a].max(other.low[a]));
        let cells = |a: usize| f64::from(along(a));
        // Boxes do not overlap: along one axis at least they have no cell in common.
        match [0, 1, 2].map(|a| along(a) == 0) {
            [true, false, false] => [LANES * cells(1) * cells(2), 0.0, 0.0, 0.0],
            [false, true, false] => [0.0, cells(0) * cells(2), 0.0, 0.0],
            [false, false, true] => [0.0, 0.0, cells(0) * cells(1), 0.0],
            _ => Border::default(),
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
    /// What of some boxes lies below, and what above.
    fn of(&self, boxes: &[Cells]) -> [Vec<Cells>; 2] {
        let (mut below, mut above) = (Vec::new(), Vec::new());
        for cells in boxes {
            let (low, rest) = cells.at(self.axis, self.plane);
            below.extend(low);
            let Some(rest) = rest else { continue };
            match self.row {
                None => above.push(rest),
                Some((second, row)) => {
                    let (layer, beyond) = rest.at(self.axis, self.plane + 1);
                    above.extend(beyond);
                    let (low, high) = layer.map_or((None, None), |layer| layer.at(second, row));
                    below.extend(low);
                    above.extend(high);
                }
            }
        }
        join(&mut below);
        join(&mut above);
        [below, above]
    }

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
