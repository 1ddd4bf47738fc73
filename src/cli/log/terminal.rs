//! The log on the terminal.

use std::fmt;
use std::time::Instant;

use tracing::{Event, Subscriber};
use tracing_subscriber::fmt::format::Writer;
use tracing_subscriber::fmt::{FmtContext, FormatEvent, FormatFields, FormattedFields};
use tracing_subscriber::registry::LookupSpan;

use crate::cli::progress::tell;

/// Prints a line; it shares the terminal with the progress bar.
pub(super) fn put(line: &[u8]) {
    // Text of a device may contain line breaks, which are replaced.
    tell(&String::from_utf8_lossy(line).trim_end().replace('\n', "\u{fffd}"));
}

/// An event as a line: seconds since the start, level, spans, message and fields, and the module that a
/// filter names. The span of the verb is left out.
pub(super) struct Line {
    /// When the program started.
    pub(super) began: Instant,
}

impl<S, N> FormatEvent<S, N> for Line
where
    S: Subscriber + for<'a> LookupSpan<'a>,
    N: for<'a> FormatFields<'a> + 'static,
{
    fn format_event(
        &self,
        context: &FmtContext<'_, S, N>,
        mut to: Writer<'_>,
        event: &Event<'_>,
    ) -> fmt::Result {
        let metadata = event.metadata();
        write!(to, "{:8.3} {:>5} ", self.began.elapsed().as_secs_f64(), metadata.level())?;
        for span in context.event_scope().into_iter().flat_map(|scope| scope.from_root().skip(1)) {
            to.write_str(span.name())?;
            if let Some(fields) = span.extensions().get::<FormattedFields<N>>()
                && !fields.is_empty()
            {
                write!(to, "{{{fields}}}")?;
            }
            to.write_str(": ")?;
        }
        context.format_fields(to.by_ref(), event)?;
        writeln!(to, " [{}]", metadata.target())
    }
}
