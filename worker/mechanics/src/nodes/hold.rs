//! Nodes that something holds or pushes: forces on nodes, prescribed velocities, rigid walls.

use super::{Advance, NodeSet, Nodes};
use crate::{
    element::vector::Vector,
    lanes::{Lane, SET},
    wall::{self, Motion, Pose, WallVote, touched_quantum},
    work::Work,
};

impl Advance<'_> {
    /// Those of the held nodes from `at` on that [`Advance::hold`] must see: not those that feel only walls and are clear
    /// of them in this step, which most are. And those of `set.strikes` that may strike a wall soon. `v` are the free velocities.
    #[inline(always)]
    pub(super) fn not_clear<L: Lane>(
        &self,
        nodes: &Nodes<'_>,
        set: NodeSet,
        at: usize,
        x: &Vector<L>,
        v: &Vector<L>,
    ) -> [u8; 2] {
        let held = set.held;
        let (mut left, mut kept, mut walls) = (held, 0, 0);
        while left != 0 {
            let lane = left.trailing_zeros();
            let constraint = &self.constraints[usize::from(nodes.constraint[at + lane as usize])];
            walls |= constraint.walls;
            if !constraint.is_of_walls() {
                kept |= 1 << lane;
            }
            left &= left - 1;
        }
        if walls == 0 || (kept == held && set.strikes == 0) {
            return [held, 0];
        }
        let times = [self.step.dt, wall::FORESEEN * self.step.dt];
        let (mut clear, mut near) = (L::mask(u32::MAX), 0);
        while walls != 0 {
            let w = walls.trailing_zeros() as usize;
            walls &= walls - 1;
            // Without nodes that strike, what is later is not computed.
            if set.strikes == 0 {
                let [now, _] = self.walls[w].clear(&self.poses[w], x, v, times);
                clear = L::both(clear, now);
                continue;
            }
            let [now, later] = self.walls[w].clear(&self.poses[w], x, v, times);
            clear = L::both(clear, now);
            let soon = set.strikes & !(L::bits(later) as u8);
            if soon != 0 {
                near |= self.feeling(nodes, soon, at, w);
            }
        }
        [kept | held & !(L::bits(clear) as u8), near]
    }

    /// Those of these nodes from `at` on that feel a wall: what is far from another one must not decide with it.
    #[cold]
    fn feeling(&self, nodes: &Nodes<'_>, mut of: u8, at: usize, wall: usize) -> u8 {
        let mut feeling = 0;
        while of != 0 {
            let lane = of.trailing_zeros();
            of &= of - 1;
            let walls = self.constraints[usize::from(nodes.constraint[at + lane as usize])].walls;
            feeling |= ((walls >> wall & 1) as u8) << lane;
        }
        feeling
    }

    /// The greatest speed at which one of these nodes from `at` on closes in on a wall that it may strike soon. It is that before the step: a
    /// node that rests on a wall has none against it, however hard it is pressed.
    #[cold]
    pub(super) fn closing(&self, nodes: &Nodes<'_>, mut near: u8, at: usize) -> f64 {
        let mut greatest = 0.0_f64;
        while near != 0 {
            let i = at + near.trailing_zeros() as usize;
            near &= near - 1;
            let of = |along: &[Vec<f64>; 3]| std::array::from_fn(|a| along[a][i]);
            let felt = self.constraints[usize::from(nodes.constraint[i])].walls;
            let (x, v) = (of(nodes.x), of(nodes.v));
            greatest = greatest.max(wall::closing(
                self.walls,
                self.poses,
                felt,
                x,
                v,
                wall::FORESEEN * self.step.dt,
            ));
        }
        greatest
    }

    /// Corrects the free velocities of held nodes from `at` on; gives the work of what holds the booked ones.
    pub(super) fn hold(
        &self,
        nodes: &mut Nodes<'_>,
        set: NodeSet,
        at: usize,
        velocity: &mut [[f64; SET]; 3],
    ) -> Work {
        let mut external = Work::default();
        let half_steps = self.step.half_steps();
        let curves = &self.step.loads.curves;
        let mut same: Option<(u16, [Option<f64>; 3])> = None;
        for lane in (0..SET).filter(|lane| set.held >> lane & 1 == 1) {
            let i = at + lane;
            let old = [nodes.v[0][i], nodes.v[1][i], nodes.v[2][i]];
            let free = [velocity[0][lane], velocity[1][lane], velocity[2][lane]];
            let mut new = free;
            let mass = nodes.mass[i];
            let booked = set.booked >> lane & 1 == 1;
            let constraint = nodes.constraint[i];
            let held = &self.constraints[constraint as usize];
            let mut is_held = held.forces != 0;
            let mut forces = held.forces;
            while forces != 0 {
                let load = &self.step.loads.forces[forces.trailing_zeros() as usize];
                let inertia = if load.by_mass { 1.0 } else { mass };
                let scale = half_steps * self.step.mean(&load.drive) / inertia;
                for a in 0..3 {
                    new[a] += load.force[a] * scale;
                }
                forces &= forces - 1;
            }
            let x = [nodes.x[0][i], nodes.x[1][i], nodes.x[2][i]];
            // Neighbours have the same velocities, as long as no circle has them depend on the place.
            let prescribed = match same {
                Some((of, velocities)) if of == constraint => velocities,
                _ => held.prescribed(curves, x, self.step.time, self.step.dt),
            };
            same = held.circle.is_none().then_some((constraint, prescribed));
            for axis in 0..3 {
                let Some(velocity) = prescribed[axis] else { continue };
                is_held = true;
                let before = new[axis];
                new[axis] = velocity;
                if let Some(support) = held.supports[axis].checked_sub(1).filter(|_| booked) {
                    let vote = &mut nodes.walls[self.walls.len() + usize::from(support)];
                    let impulse = mass * (new[axis] - before);
                    vote.impulse[axis] -= self.step.quanta.momentum.round(impulse);
                    vote.work.merge(self.work(impulse * old[axis], impulse * new[axis]));
                }
            }
            let mut walls = held.walls;
            while walls != 0 {
                let w = walls.trailing_zeros() as usize;
                let before = new;
                walls &= walls - 1;
                if !self.walls[w].stop(&self.poses[w], x, &mut new, self.step.dt) {
                    continue;
                }
                is_held = true;
                if booked {
                    self.struck(&mut nodes.walls[w], &self.poses[w], mass, [old, before, new]);
                    if let Motion::Free { mass: own, .. } = self.walls[w].motion {
                        nodes.walls[w].touched += touched_quantum(own).round(mass);
                    }
                }
            }
            if !is_held {
                continue;
            }
            if booked && new != free {
                let with = |v: [f64; 3]| (0..3).map(|a| mass * (new[a] - free[a]) * v[a]).sum::<f64>();
                external.merge(self.work(with(old), with(new)));
            }
            for a in 0..3 {
                velocity[a][lane] = new[a];
            }
        }
        external
    }

    /// Books what a wall and a node that it stops give each other. The velocities are those before the step, without the wall, and with it.
    ///
    /// Of the work of the impulse, `J . v`, the wall does `J . w` with its own velocity; the rest is lost.
    fn struck(&self, vote: &mut WallVote, [_, speed]: &Pose, mass: f64, [old, free, new]: [[f64; 3]; 3]) {
        let impulse: [f64; 3] = std::array::from_fn(|a| mass * (new[a] - free[a]));
        for a in 0..3 {
            vote.impulse[a] -= self.step.quanta.momentum.round(impulse[a]);
        }
        let with = |v: [f64; 3]| (0..3).map(|a| impulse[a] * v[a]).sum::<f64>();
        let done = with(*speed);
        vote.work.merge(self.work(done, done));
        vote.loss.merge(self.work(done - with(old), done - with(new)));
    }

    /// Work of an impulse in this step, from its products with the velocities before and after it.
    fn work(&self, with_old: f64, with_new: f64) -> Work {
        Work::of([with_old, with_new], self.step.share_before(), self.step.dithered())
    }
}
