//! Many sequences: what is below a folder, what was measured of each, and whether that is steady.

mod characteristics;
mod control_chart;
mod entry;
mod listing;
mod measure;
mod standard;
mod thumbnail;
mod trend;
mod trend_picture;

pub use characteristics::{ChangedQuantity, Characteristics, RepeatedQuantity};
pub use control_chart::{Change, ChartPoint, ControlChart, Pattern};
pub use entry::{SequenceState, SeriesEntry};
pub use listing::{Series, SortKey};
pub use measure::Measure;
pub use standard::{NoStandard, Standard};
pub use thumbnail::thumbnail;
pub use trend::{Trend, TrendValue, Trends};
