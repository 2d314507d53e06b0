//! A convex relaxation on a window: in the rows of jerk and in the time, the pace w^(−1/2) becomes a variable y at each
//! collocation point,
//!
//!   minimise Σ c y   subject to   y ≥ w^(−1/2),   y ∓ L(w)/J ≥ 0   and the other rows as they are,
//!
//! with L(w) = q''' w + 3/2 q'' w' + 1/2 q' w'' and the weights c of the 3/8 rule. Its minimum is at most that of the
//! true problem. y is eliminated at each point, so that Newton's matrix keeps its bandwidth.
//!
//! For `cases`, the row of speed may limit y as well (`chord`), and the states (w, w') at both ends may have a price (`Price`).

use fearless_simd::Simd;

use super::columns::Columns;
use super::constraints::Constraints;
use super::forms::{fall, motion, pace, project, Local};
use super::hermite::{COUNT, MASS};
use super::model::Model;
use feedplan_geometry::lanes::eight::{Lanes, Register, LANES};

/// The variables of the relaxation at the collocation points of each block.
pub struct Relaxed {
    pub y: Vec<[Lanes; COUNT]>,
    /// y starts at 1 + `above` times its least possible value.
    pub above: f64,
    /// The coefficients of y in the rows of speed, 1 − w/w_max − chord y ≥ 0; 0 for blocks that have none given.
    pub chord: Vec<[Lanes; COUNT]>,
    pub prices: [Price; 2],
    step: Vec<[Lanes; COUNT]>,
    trial: Vec<[Lanes; COUNT]>,
    /// w^(−1/2) from the last evaluation of the slacks.
    pace: Vec<[Lanes; COUNT]>,
    /// Of the Newton matrix: the inverse of the second derivative by y, then the mixed second derivatives by y and (w, w', w'').
    cross: Vec<[[Lanes; 4]; COUNT]>,
    /// Σ aim ∂s/∂y over the rows, for the aims of the centring and of the predictor's second-order term.
    pulls: Vec<[[Lanes; 2]; COUNT]>,
}

/// The cost of the state (w, w') at an end, price · ((w, w') − from), in s; it is added to the time.
#[derive(Clone, Copy, Debug, Default)]
pub struct Price {
    pub price: [f64; 2],
    pub from: [f64; 2],
}

impl Price {
    /// The cost of a state (w, w'), in s.
    pub fn of(&self, state: [f64; 2]) -> f64 {
        (0..2).map(|i| self.price[i] * (state[i] - self.from[i])).sum()
    }
}

impl Default for Relaxed {
    fn default() -> Self {
        let [y, chord, step, trial, pace] = std::array::from_fn(|_| vec![]);
        let prices = [Price::default(); 2];
        Self { y, above: 0.1, chord, prices, step, trial, pace, cross: vec![], pulls: vec![] }
    }
}

impl Relaxed {
    /// Adds the prices of the ends to the gradients of their intervals.
    #[inline(always)]
    fn add_prices<S: Simd>(&self, simd: S, rows: &Constraints, block: usize, out: &mut [Register<S>; 4]) {
        for (end, n) in [0, rows.count() - 1].into_iter().enumerate() {
            if n / LANES == block {
                let [w, slope] = self.prices[end].price;
                for (k, price) in [w, slope / rows.h(n)].into_iter().enumerate() {
                    let mut own = Lanes::ZERO;
                    own.values_mut()[n % LANES] = price;
                    out[2 * end + k] += own.load(simd);
                }
            }
        }
    }
}

impl Model for Relaxed {
    #[inline(always)]
    fn begin<S: Simd>(&mut self, simd: S, rows: &Constraints, x: &Columns) {
        let count = rows.blocks.len();
        for lanes in [&mut self.y, &mut self.step, &mut self.trial, &mut self.pace] {
            lanes.resize(count, [Lanes::ONE; COUNT]);
        }
        self.chord.resize(count, [Lanes::ZERO; COUNT]);
        self.pulls.resize(count, [[Lanes::ZERO; 2]; COUNT]);
        self.cross.resize(count, [[Lanes::ONE; 4]; COUNT]);
        for (b, block) in rows.blocks.iter().enumerate() {
            let h = block.h.load(simd);
            let (u, per_h) = (x.local(b, h, block.live), h.inverse());
            for p in 0..COUNT {
                let motion = motion(p, per_h, &u);
                let mut least = pace(motion[0]);
                for k in 0..rows.axes() {
                    least = least.max(rows.jerk_of(b, p, k, motion).abs());
                }
                // y starts at most half-way between its least value and the greatest one that the row of speed allows.
                let room = Register::all(simd, 1.0) - motion[0] * block.points[p].speed;
                let chord = self.chord[b][p].load(simd).max(Register::all(simd, f64::MIN_POSITIVE));
                let half = (least + room * chord.inverse()) * 0.5;
                self.y[b][p] = (least * (1.0 + self.above)).min(half).into();
            }
        }
    }

    #[inline(always)]
    fn slack<S: Simd>(
        &mut self,
        rows: &Constraints,
        block: usize,
        p: usize,
        motion: [Register<S>; 3],
        trial: bool,
        out: &mut [Lanes],
    ) {
        let pace = pace(motion[0]);
        let y = if trial { &self.trial } else { &self.y }[block][p].load(pace.simd());
        rows.slack(block, p, motion, y, y - pace, out);
        let speed = &mut out[rows.layout().speed()];
        *speed = (speed.load(pace.simd()) - y * self.chord[block][p]).into();
        self.pace[block][p] = pace.into();
    }

    #[inline(always)]
    fn slack_step<S: Simd>(
        &self,
        rows: &Constraints,
        block: usize,
        p: usize,
        motion: [Register<S>; 3],
        out: &mut [Lanes],
    ) {
        let w = motion[0];
        let step = self.step[block][p].load(w.simd());
        let last = step + fall(self.pace[block][p].load(w.simd())) * w;
        rows.slack_step(block, p, motion, step, last, out);
        let speed = &mut out[rows.layout().speed()];
        *speed = (speed.load(w.simd()) - step * self.chord[block][p]).into();
    }

    #[inline(always)]
    fn local<S: Simd>(
        &mut self,
        rows: &Constraints,
        block: usize,
        u: &[Register<S>; 4],
        weight: &[Lanes],
        dual: &[Lanes],
    ) -> Local<S> {
        let simd = u[0].simd();
        let (own, layout) = (&rows.blocks[block], rows.layout());
        let h = own.h.load(simd);
        let per_h = h.inverse();
        let zero = Register::all(simd, 0.0);
        let mut local = Local::zero(simd);
        for p in 0..COUNT {
            let [weight, dual] = [weight, dual].map(|all| layout.of(all, 0, p));
            let mut form = rows.curvature(simd, block, p, weight);
            let (last, pace) = (weight[layout.positive()].load(simd), self.pace[block][p].load(simd));
            let (fall, chord) = (fall(pace), self.chord[block][p].load(simd));
            let limit = weight[layout.speed()].load(simd) * chord;
            let mut cross = [last + limit * chord, last * fall + limit * own.points[p].speed, zero, zero];
            form[0] += last * fall * fall + dual[layout.positive()] * fall * pace * pace * 1.5;
            let [jerks, _] = layout.pairs(weight);
            for ((weight, &[q1, q2, q3]), per_jerk) in jerks.zip(rows.q(block, p)).zip(&rows.per_jerk) {
                let [up, down] = [weight[0].load(simd), weight[1].load(simd)];
                let (both, turn) = (up + down, down - up);
                let turn = turn * own.jerk * *per_jerk;
                cross[0] += both;
                cross[1] += turn * q3;
                cross[2] += turn * q2 * 1.5;
                cross[3] += turn * q1 * 0.5;
            }
            let per = cross[0].inverse();
            let [p0, p1, p2] = [cross[1] * per, cross[2] * per, cross[3] * per];
            form[0] += -(p0 * cross[1]);
            form[1] += -(p0 * cross[2]);
            form[2] += -(p0 * cross[3]);
            form[3] += -(p1 * cross[2]);
            form[4] += -(p1 * cross[3]);
            form[5] += -(p2 * cross[3]);
            self.cross[block][p] = [per, cross[1], cross[2], cross[3]].map(Lanes::from);
            local.add(p, per_h, &form);
            let cost = h * -MASS[p];
            project(p, per_h, &[p0 * cost, p1 * cost, p2 * cost], &mut local.gradient);
        }
        self.add_prices(simd, rows, block, &mut local.gradient);
        local
    }

    #[inline(always)]
    fn pull<S: Simd>(
        &mut self,
        simd: S,
        rows: &Constraints,
        block: usize,
        p: usize,
        aim: &[Lanes],
        which: usize,
    ) -> [Register<S>; 3] {
        let (mut pull, jerk) = rows.pull(simd, block, p, aim);
        let layout = rows.layout();
        let last = aim[layout.positive()].load(simd);
        pull[0] += last * fall(self.pace[block][p].load(simd));
        let own = jerk + last - aim[layout.speed()].load(simd) * self.chord[block][p];
        self.pulls[block][p][which] = own.into();
        let [per, cross @ ..] = &self.cross[block][p];
        let part = own * *per;
        for k in 0..3 {
            pull[k] += -(part * cross[k]);
        }
        pull
    }

    #[inline(always)]
    fn solved<S: Simd>(&mut self, simd: S, rows: &Constraints, step: &Columns, pulls: [f64; 2]) {
        for (b, block) in rows.blocks.iter().enumerate() {
            let h = block.h.load(simd);
            let (u, per_h) = (step.local(b, h, block.live), h.inverse());
            for p in 0..COUNT {
                let [w, w1, w2] = motion(p, per_h, &u);
                let [per, c0, c1, c2] = self.cross[b][p];
                let [centre, product] = self.pulls[b][p];
                let aim = centre.load(simd) * pulls[0] + product.load(simd) * pulls[1];
                let free = aim - h * MASS[p] - c0 * w - c1 * w1 - c2 * w2;
                self.step[b][p] = (free * per * block.live).into();
            }
        }
    }

    #[inline(always)]
    fn attempt<S: Simd>(&mut self, simd: S, part: f64) {
        let all = |vector| <[[Lanes; COUNT]]>::as_flattened(vector);
        let trial = self.trial.as_flattened_mut().iter_mut();
        for ((trial, y), step) in trial.zip(all(&self.y)).zip(all(&self.step)) {
            *trial = (*y + step.load(simd) * part).into();
        }
    }

    fn accept(&mut self) {
        std::mem::swap(&mut self.y, &mut self.trial);
    }

    #[inline(always)]
    fn time<S: Simd>(&self, simd: S, rows: &Constraints, x: &Columns, trial: bool) -> f64 {
        let y = if trial { &self.trial } else { &self.y };
        let mut time = Register::all(simd, 0.0);
        let mut least = Register::all(simd, f64::INFINITY);
        for (b, block) in rows.blocks.iter().enumerate() {
            let h = block.h.load(simd);
            let (u, per_h) = (x.local(b, h, block.live), h.inverse());
            let mut cost = Register::all(simd, 0.0);
            for p in 0..COUNT {
                least = motion(p, per_h, &u)[0].min(least);
                cost += y[b][p].load(simd) * MASS[p];
            }
            time += cost * h * block.live;
        }
        if least.least() > 0.0 {
            time.sum() + self.prices[0].of(x.at(0)) + self.prices[1].of(x.at(rows.count()))
        } else {
            f64::INFINITY
        }
    }
}
