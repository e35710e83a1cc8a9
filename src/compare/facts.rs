//! Where and when a comparison was made, and with what: for those who read its numbers elsewhere.

use super::method::Methods;
use super::subject::program;
use crate::check::reference;
use crate::process::line_of;
use serde_json::{Value, json};
use std::path::Path;
use std::sync::OnceLock;
use std::time::{SystemTime, UNIX_EPOCH};

/// The facts.
#[derive(Clone, Debug, Default)]
pub struct Facts {
    /// The command that repeats the comparison.
    pub command: String,
    /// The methods, as a file.
    pub methods: String,
    /// Name and value of everything else.
    pub list: Vec<(&'static str, String)>,
}

impl Facts {
    /// Gathers them.
    pub fn gather(command: String, methods: &Methods, scene: &Path) -> Self {
        let mut list = vec![
            (
                "program",
                format!("Lucerna {}, build {}", env!("CARGO_PKG_VERSION"), &program()[..12.min(program().len())]),
            ),
            ("started", utc(SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |d| d.as_secs()))),
            ("processor", processor().to_owned()),
            ("processors", std::thread::available_parallelism().map_or_else(|_| "?".to_owned(), |n| n.to_string())),
            ("threads", rayon::current_num_threads().to_string()),
        ];
        let memory =
            line_of("/proc/meminfo", "MemTotal:").and_then(|text| text.trim_end_matches("kB").trim().parse().ok());
        list.extend(memory.map(|kib: f64| ("memory", format!("{:.1} GiB", kib / 1_048_576.0))));
        let release = std::fs::read_to_string("/proc/sys/kernel/osrelease").unwrap_or_default();
        list.push(("system", format!("{} {}", std::env::consts::OS, release.trim()).trim().to_owned()));
        let load = std::fs::read_to_string("/proc/loadavg").ok();
        let load = load.and_then(|text| Some(text.split_whitespace().next()?.to_owned()));
        list.extend(load.map(|load| ("load before", format!("{load} (mean of a minute; 0 is an idle machine)"))));
        if methods.list.iter().any(|method| method.variant.is_some()) {
            list.extend(reference::version(scene).ok().map(|version| ("mitsuba", version)));
        }
        Facts { command, methods: methods.to_toml(), list }
    }

    /// As a document.
    pub fn to_json(&self) -> Value {
        self.list.iter().map(|(name, value)| (name.replace(' ', "_"), json!(value))).collect()
    }

    /// One of them, or nothing.
    pub fn get(&self, name: &str) -> &str {
        self.list.iter().find(|(known, _)| *known == name).map_or("", |(_, value)| value)
    }
}

/// The processor, as the system calls it.
pub fn processor() -> &'static str {
    static NAME: OnceLock<String> = OnceLock::new();
    NAME.get_or_init(|| {
        let line = line_of("/proc/cpuinfo", "model name");
        line.map_or_else(|| std::env::consts::ARCH.to_owned(), |name| name.trim_start_matches(':').trim().to_owned())
    })
}

/// Date and time of seconds since 1970, with the calendar's cycle of 146 097 days (400 years).
fn utc(seconds: u64) -> String {
    let (days, rest) = (seconds / 86_400, seconds % 86_400);
    // Days since 1 March of the year 0; a year that begins in March has its leap day at the end.
    let day = days + 719_468;
    let (cycle, of_cycle) = (day / 146_097, day % 146_097);
    let year = (of_cycle - of_cycle / 1_460 + of_cycle / 36_524 - of_cycle / 146_096) / 365;
    let of_year = of_cycle - (365 * year + year / 4 - year / 100);
    let month = (5 * of_year + 2) / 153;
    let date = of_year - (153 * month + 2) / 5 + 1;
    let month = if month < 10 { month + 3 } else { month - 9 };
    let year = 400 * cycle + year + u64::from(month <= 2);
    format!("{year}-{month:02}-{date:02} {:02}:{:02} UTC", rest / 3600, rest % 3600 / 60)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dates() {
        let found = [0, 951_782_400, 1_709_251_199, 4_102_444_800].map(utc);
        let expected = ["1970-01-01 00:00 UTC", "2000-02-29 00:00 UTC", "2024-02-29 23:59 UTC", "2100-01-01 00:00 UTC"];
        assert_eq!(found, expected);
    }
}
