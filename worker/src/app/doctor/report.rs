//! The lines that the doctor prints.

use std::time::Duration;

use rayfarm_text::printable_within;

/// Longest detail of a line, in bytes. Details contain texts of the master.
const MAX_DETAIL_BYTES: usize = 500;

/// Results of the checks so far. Each is printed to standard output at once.
#[derive(Debug, Default)]
pub(in crate::app) struct Report {
    failures: usize,
}

impl Report {
    /// Whether no check has failed.
    pub(in crate::app) fn has_passed(&self) -> bool {
        self.failures == 0
    }

    pub(super) fn ok(&mut self, check: &str, detail: &str) {
        println!("{}", line(check, "ok", detail));
    }

    /// Prints a failure and what to do about it.
    pub(super) fn failed(&mut self, check: &str, detail: &str, advice: &str) {
        self.failures += 1;
        println!("{}", line(check, "FAILED", detail));
        println!("{}", line("", "", advice));
    }

    /// Prints something that is neither a success nor a failure.
    pub(super) fn note(&mut self, check: &str, detail: &str) {
        println!("{}", line(check, "-", detail));
    }
}

fn line(check: &str, result: &str, detail: &str) -> String {
    format!("{check:<14} {result:<7} {}", printable_within(detail, MAX_DETAIL_BYTES))
}

/// The median of some times; zero for none.
pub(super) fn median(times: &mut [Duration]) -> Duration {
    times.sort();
    times.get(times.len() / 2).copied().unwrap_or_default()
}

/// A time in milliseconds with two decimals.
pub(super) fn millis(time: Duration) -> String {
    format!("{:.2} ms", time.as_secs_f64() * 1e3)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texts_of_a_master_are_printable_and_short() {
        let text = line("port", "FAILED", &format!("\u{1b}]0;x\u{7}{}", "y".repeat(5000)));
        assert!(!text.contains(char::is_control) && text.len() < 600, "{text:?}");
    }

    #[test]
    fn one_failure_fails_the_report() {
        let mut report = Report::default();
        report.ok("name", "");
        report.note("clock", "");
        assert!(report.has_passed());
        report.failed("port", "refused", "start it");
        assert!(!report.has_passed());
    }

    #[test]
    fn the_median_is_the_middle_time() {
        let ms = Duration::from_millis;
        assert_eq!(median(&mut [ms(9), ms(1), ms(3)]), ms(3));
        assert_eq!(median(&mut []), Duration::ZERO);
    }
}
