//! Estimates of the duration and the size of a scan.

use std::time::Duration;

use super::CapturePlan;
use super::scan::below;

/// Frame times from a stop to the first counted frame: the frame being exposed when the stage comes to rest,
/// and a neighbour for comparison. The averaged frames follow.
const BEFORE_THE_FIRST: f64 = 2.0;

/// Duration and size of a scan.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Estimate {
    /// Time of the stage's moves without homing; `None` if its velocity is unknown.
    pub moving: Option<Duration>,
    /// Time of mechanical settling.
    pub settling: Duration,
    /// Time of waiting for frames; `None` if the frame rate is unknown.
    pub exposing: Option<Duration>,
    /// Bytes of all frames without compression; `None` if their size is unknown.
    pub bytes: Option<u64>,
}

impl Estimate {
    /// The total time, if all parts are known.
    pub fn total(&self) -> Option<Duration> {
        Some(self.moving?.saturating_add(self.settling).saturating_add(self.exposing?))
    }
}

impl CapturePlan {
    /// The estimate for this plan: frames of `frame_bytes` every `interval`, on a stage whose moves take
    /// `duration` of a distance in mm.
    pub fn estimate(
        &self,
        frame_bytes: Option<u64>,
        interval: Option<Duration>,
        duration: impl Fn(f64) -> Option<Duration>,
    ) -> Estimate {
        let stops = self.positions_mm.len();
        let moves = self.moves_mm().into_iter().map(duration);
        let moving = moves.reduce(|sum, next| Some(sum?.saturating_add(next?))).flatten();
        // The first frame is taken again at the end.
        let (stops_and_closing, others) = ((stops + 1) as f64, self.calibration_frames());
        let averaged = self.section.average as f64;
        let frame_times = stops_and_closing * (BEFORE_THE_FIRST + averaged) + others as f64 * averaged;
        let times = |time: Duration, count: f64| {
            Duration::try_from_secs_f64(time.as_secs_f64() * count).unwrap_or(Duration::MAX)
        };
        Estimate {
            moving,
            settling: times(self.section.settle, stops_and_closing),
            exposing: interval.map(|interval| times(interval, frame_times)),
            bytes: frame_bytes.map(|bytes| bytes.saturating_mul((stops + others) as u64)),
        }
    }

    /// The lengths of all moves, in mm: from home through all stops; at the end to the first stop, and home.
    fn moves_mm(&self) -> Vec<f64> {
        let Some(&first_mm) = self.positions_mm.first() else { return Vec::new() };
        let (mut at_mm, mut moves) = (0.0, Vec::new());
        for &position_mm in self.positions_mm.iter().chain([&first_mm]) {
            for place_mm in below(at_mm, position_mm).into_iter().chain([position_mm]) {
                moves.push((place_mm - at_mm).abs());
                at_mm = place_mm;
            }
        }
        moves.push(at_mm);
        moves
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::profile::PlanProfile;

    #[test]
    fn a_scan_takes_the_sum_of_its_parts() {
        let settle = Duration::from_millis(200);
        let section = PlanProfile { settle, average: 4, dark: 2, ..PlanProfile::default() };
        let plan = CapturePlan { section, ..CapturePlan::at(vec![10.0, 12.0, 14.0]) };
        // A stage of 1 mm/s without ramps.
        let estimate = plan
            .estimate(Some(1000), Some(Duration::from_millis(10)), |mm| Some(Duration::from_secs_f64(mm)));
        // 10 to the first, 2 + 2 steps; back to 1 below the first, and up to it; 10 home.
        assert_eq!(estimate.moving, Some(Duration::from_secs(30)));
        assert_eq!(estimate.settling, Duration::from_millis(800));
        // Four stops of 2 + 4 frame times, and two dark frames of 4.
        assert_eq!(estimate.exposing, Some(Duration::from_millis(320)));
        assert_eq!(estimate.bytes, Some(5000));
        assert_eq!(estimate.total(), Some(Duration::from_millis(31_120)));
        assert_eq!(plan.estimate(None, None, |_| None).total(), None);
        let endless = plan.estimate(Some(u64::MAX), Some(Duration::MAX), |_| Some(Duration::MAX));
        assert_eq!((endless.total(), endless.bytes), (Some(Duration::MAX), Some(u64::MAX)));
    }
}
