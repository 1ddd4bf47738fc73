//! The time of records, whatever the system's clock says.

use std::time::{Duration, SystemTime, UNIX_EPOCH};

use jiff::Timestamp;
use uuid::{NoContext, Uuid};

/// The year 0, before which RFC 3339 has no dates, in s from 1970.
const YEAR_0: i64 = -62_167_219_200;

/// The time by the system's clock. A clock that is set to no year of 0 to 9999 gives the nearest time within
/// them.
pub fn time() -> Timestamp {
    within(SystemTime::now())
}

/// The same, as in RFC 3339.
pub fn now() -> String {
    time().to_string()
}

/// A fresh name for a sequence: no two are the same.
pub(super) fn new_uid() -> String {
    uid_at(SystemTime::now())
}

fn within(time: SystemTime) -> Timestamp {
    let first = Timestamp::from_second(YEAR_0).unwrap_or(Timestamp::UNIX_EPOCH);
    let nearest = if time < UNIX_EPOCH { first } else { Timestamp::MAX };
    Timestamp::try_from(time).unwrap_or(nearest).max(first)
}

/// Its first 48 bits are the time in ms since 1970; the others are random.
fn uid_at(time: SystemTime) -> String {
    let since = time.duration_since(UNIX_EPOCH).unwrap_or(Duration::ZERO);
    Uuid::new_v7(uuid::Timestamp::from_unix(NoContext, since.as_secs(), since.subsec_nanos())).to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The furthest times that the system has, and those at the ends of what dates can say.
    fn times() -> Vec<SystemTime> {
        let mut times = vec![UNIX_EPOCH];
        for direction in [SystemTime::checked_add, SystemTime::checked_sub] {
            // As far as it goes, in halves of the step.
            let mut at = UNIX_EPOCH;
            for bit in (0..64).rev() {
                at = direction(&at, Duration::from_secs(1 << bit)).unwrap_or(at);
            }
            times.push(at);
            let seconds = [1, YEAR_0.unsigned_abs(), 253_402_300_800, 10_000_000_000_000];
            times.extend(seconds.iter().filter_map(|s| direction(&UNIX_EPOCH, Duration::from_secs(*s))));
        }
        times
    }

    #[test]
    fn every_clock_gives_a_date_and_a_uid() {
        for at in times() {
            let date = within(at).to_string();
            let year: i32 = date.split('-').next().unwrap().parse().unwrap_or_else(|_| panic!("{date}"));
            assert!((0..=9999).contains(&year), "{date}");
            assert_eq!(date.parse::<Timestamp>().unwrap(), within(at));
            assert_eq!(Uuid::parse_str(&uid_at(at)).unwrap().get_version_num(), 7);
            assert_ne!(uid_at(at), uid_at(at));
        }
        let moon_landing = UNIX_EPOCH - Duration::from_secs(14_182_940);
        assert_eq!(within(moon_landing).to_string(), "1969-07-20T20:17:40Z");
    }
}
