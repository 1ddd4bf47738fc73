//! Motion in the simulator of GRBL: a queue of blocks, the active block, and homing.

use std::collections::VecDeque;

use firmware_protocol::axis::{Limits, Way};
use firmware_protocol::ramp::{Ramp, Run};

use super::settings::{AXES, Table};
use crate::stage::simulator::Plant;
use crate::stage::simulator::TICK_HZ;

const NM_PER_MM: f64 = 1e6;
const MINUTE_S: f64 = 60.0;
/// Blocks that the planner holds.
const PLANNER_BLOCKS: usize = 15;

/// An accepted straight move.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Block {
    target_mm: [f64; AXES],
    /// `None` for the highest velocity.
    feed_mm_min: Option<f64>,
    jog: bool,
}

impl Eq for Block {}

impl Block {
    pub(super) fn new(target_mm: [f64; AXES], feed_mm_min: Option<f64>, jog: bool) -> Self {
        Self { target_mm, feed_mm_min, jog }
    }
}

/// The phases of homing, in order.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Leg {
    Seek,
    BackOff,
    Locate,
    PullOff,
}

#[derive(Debug, Clone, Default)]
pub(super) struct Motion {
    /// Machine position of the X axis in steps; the other axes in mm.
    steps: i64,
    others_mm: [f64; AXES],
    queue: VecDeque<Block>,
    block: Option<Block>,
    run: Option<Run>,
    outwards: bool,
    homing: Option<Leg>,
}

fn ramp(table: &Table, feed_mm_min: Option<f64>) -> Option<Ramp> {
    let rate_mm_min = feed_mm_min.map_or(table.get(110), |feed| feed.min(table.get(110)));
    let velocity_nm_s = (rate_mm_min / MINUTE_S * NM_PER_MM) as u32;
    Ramp::new(velocity_nm_s, (table.get(120) * NM_PER_MM) as u32, table.get(100) as u32, TICK_HZ)
}

fn steps_of(table: &Table, mm: f64) -> i64 {
    (mm * table.get(100)).round() as i64
}

impl Motion {
    pub(super) fn position_mm(&self, table: &Table) -> [f64; AXES] {
        [self.steps as f64 / table.get(100), self.others_mm[1], self.others_mm[2]]
    }

    /// Position after all queued blocks.
    pub(super) fn planned_mm(&self, table: &Table) -> [f64; AXES] {
        let last = self.queue.back().or(self.block.as_ref());
        last.map_or_else(|| self.position_mm(table), |block| block.target_mm)
    }

    /// Nominal rate of the active block, in mm/min.
    pub(super) fn feed(&self) -> f64 {
        if self.moving() { self.block.and_then(|block| block.feed_mm_min).unwrap_or(0.0) } else { 0.0 }
    }

    pub(super) fn moving(&self) -> bool {
        self.run.is_some()
    }

    pub(super) fn queue_is_empty(&self) -> bool {
        self.queue.is_empty()
    }

    /// Queues a block. Returns `false` if there is no room.
    pub(super) fn queue(&mut self, block: Block) -> bool {
        let room = self.queue.len() < PLANNER_BLOCKS;
        if room {
            self.queue.push_back(block);
        }
        room
    }

    /// Starts the next block. Returns whether it is a jog.
    pub(super) fn next_block(&mut self, table: &Table) -> Option<bool> {
        let block = self.queue.pop_front()?;
        self.begin(block, table);
        Some(block.jog)
    }

    fn begin(&mut self, block: Block, table: &Table) {
        let target = steps_of(table, block.target_mm[0]);
        self.outwards = target > self.steps;
        let distance = u32::try_from(target.abs_diff(self.steps)).unwrap_or(u32::MAX);
        self.run = ramp(table, block.feed_mm_min).map(|ramp| Run::new(distance, ramp));
        self.block = Some(block);
    }

    /// Decelerates to rest; jogs are dropped, other moves wait to be resumed.
    pub(super) fn stop(&mut self) {
        if let Some(run) = &mut self.run {
            run.stop();
        }
        if self.block.is_some_and(|block| block.jog) {
            self.queue.clear();
        }
    }

    /// Resumes held moves. Returns whether there were any.
    pub(super) fn resume(&mut self) -> bool {
        let held = self.block.take();
        held.into_iter().for_each(|block| self.queue.push_front(block));
        !self.queue.is_empty()
    }

    /// Stops at once, and drops all blocks.
    pub(super) fn halt(&mut self) {
        self.run = None;
        self.block = None;
        self.homing = None;
        self.queue.clear();
    }

    /// Marks the active block as done without moving the carriage.
    pub(super) fn pretend(&mut self) {
        if let Some(run) = &mut self.run {
            let sign = if self.outwards { 1 } else { -1 };
            while !run.finished() {
                self.steps += if run.tick() { sign } else { 0 };
            }
        }
    }

    pub(super) fn tick(&mut self, plant: &Plant) {
        let Some(run) = &mut self.run else { return };
        if run.tick() {
            self.steps += if self.outwards { 1 } else { -1 };
            plant.step(if self.outwards { Way::Out } else { Way::Home });
        }
        if run.finished() {
            let complete = run.complete();
            self.run = None;
            if (complete || self.block.is_some_and(|block| block.jog))
                && let Some(block) = self.block.take()
            {
                self.others_mm = block.target_mm;
            }
        }
    }

    pub(super) fn begin_homing(&mut self, table: &Table) {
        self.halt();
        // GRBL counts from 0 during the search.
        self.steps = 0;
        self.begin_leg(Leg::Seek, table);
    }

    /// Whether homing moves upwards.
    fn homes_upwards(table: &Table) -> bool {
        table.get(23) as u8 & 1 == 0
    }

    fn begin_leg(&mut self, leg: Leg, table: &Table) {
        let (mm, feed, towards) = match leg {
            Leg::Seek => (1.5 * table.get(130), table.get(25), true),
            Leg::BackOff | Leg::PullOff => (table.get(27), table.get(24), false),
            Leg::Locate => (5.0 * table.get(27), table.get(24), true),
        };
        self.homing = Some(leg);
        self.outwards = towards == Self::homes_upwards(table);
        let steps = u32::try_from(steps_of(table, mm)).unwrap_or(u32::MAX);
        self.run = ramp(table, Some(feed)).map(|ramp| Run::new(steps, ramp));
    }

    /// One tick of homing. Returns its end, or the alarm that ends it.
    pub(super) fn homing_tick(
        &mut self,
        table: &Table,
        plant: &Plant,
        limits: Limits,
    ) -> Option<Result<(), &'static str>> {
        let closed = if Self::homes_upwards(table) { limits.far } else { limits.home };
        let (leg, run) = (self.homing?, self.run.as_mut()?);
        if closed && matches!(leg, Leg::Seek | Leg::Locate) {
            self.begin_leg(if leg == Leg::Seek { Leg::BackOff } else { Leg::PullOff }, table);
            return None;
        }
        if run.tick() {
            self.steps += if self.outwards { 1 } else { -1 };
            plant.step(if self.outwards { Way::Out } else { Way::Home });
        }
        if !run.finished() {
            return None;
        }
        match leg {
            Leg::Seek | Leg::Locate => Some(Err("ALARM:9")),
            _ if closed => Some(Err("ALARM:8")),
            Leg::BackOff => {
                self.begin_leg(Leg::Locate, table);
                None
            }
            Leg::PullOff => {
                self.halt();
                let home_mm = |axis: u8| {
                    let upwards = table.get(23) as u8 >> axis & 1 == 0;
                    if upwards { -table.get(27) } else { table.get(27) - table.get(130 + axis) }
                };
                self.steps = steps_of(table, home_mm(0));
                self.others_mm = [home_mm(0), home_mm(1), home_mm(2)];
                Some(Ok(()))
            }
        }
    }
}
