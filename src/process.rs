//! What the system tells of this process (Linux).

use std::path::Path;

/// The most memory that it has had at a time, in MiB.
pub(crate) fn peak_memory() -> Option<f64> {
    let text = line_of("/proc/self/status", "VmHWM:")?;
    Some(text.split_whitespace().next()?.parse::<f64>().ok()? / 1024.0)
}

/// Seconds that the processors have spent on it, to the nanosecond.
pub(crate) fn processor_seconds() -> Option<f64> {
    let mut nanoseconds = 0_u64;
    for task in std::fs::read_dir("/proc/self/task").ok()? {
        // A thread may end meanwhile.
        let Ok(text) = std::fs::read_to_string(task.ok()?.path().join("schedstat")) else { continue };
        nanoseconds += text.split_whitespace().next()?.parse::<u64>().ok()?;
    }
    (nanoseconds > 0).then_some(nanoseconds as f64 * 1e-9)
}

/// What follows a word at the start of a line of a file.
pub(crate) fn line_of(file: impl AsRef<Path>, word: &str) -> Option<String> {
    let text = std::fs::read_to_string(file).ok()?;
    text.lines().find_map(|line| Some(line.strip_prefix(word)?.trim().to_owned()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn work_takes_processor_time() {
        let Some(before) = processor_seconds() else { return };
        let began = std::time::Instant::now();
        let mut sum = 0.0_f64;
        while began.elapsed().as_millis() < 30 {
            sum += (0..1000).map(|i| f64::from(i).sqrt()).sum::<f64>();
        }
        assert!(processor_seconds().unwrap() > before && sum > 0.0);
        assert!(peak_memory().unwrap() > 1.0);
    }
}
