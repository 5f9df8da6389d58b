//! Amounts of memory: as options, in words, and what the process has held.

use std::fmt;
use std::num::NonZeroUsize;

/// The units of an amount, powers of 1024, by what they begin with.
const UNITS: [(char, i32); 4] = [('k', 10), ('m', 20), ('g', 30), ('t', 40)];

/// An amount of memory that may not be passed, in bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct MemoryLimit(pub(super) NonZeroUsize);

/// Reads bytes, or a number with a unit.
pub(super) fn parse_memory(text: &str) -> Result<MemoryLimit, String> {
    let help = || {
        "an amount of memory above 0 is needed: bytes, or a number with K, M, G or T (powers of 1024), such as 4G \
         or 512MiB"
            .to_owned()
    };
    let split = text.find(|c: char| c.is_ascii_alphabetic());
    let (number, unit) = text.split_at(split.unwrap_or(text.len()));
    let unit = unit.to_ascii_lowercase();
    let prefix = ["ib", "b"].iter().find_map(|end| unit.strip_suffix(end));
    let power = match prefix.unwrap_or(&unit) {
        "" if !unit.starts_with('i') => 0,
        name => UNITS
            .iter()
            .find(|(letter, _)| name == letter.to_string())
            .map(|&(_, power)| power)
            .ok_or_else(help)?,
    };
    let number: f64 = number.trim_end().parse().map_err(|_| help())?;
    let bytes = number * 2f64.powi(power);
    // Beyond 2⁵³ the number would not be that which was written; no machine has as much.
    if !(1.0..=2f64.powi(53)).contains(&bytes) {
        return Err(help());
    }
    NonZeroUsize::new(bytes as usize)
        .map(MemoryLimit)
        .ok_or_else(help)
}

/// An amount of memory for people.
pub(super) struct Bytes(pub(super) usize);

impl fmt::Display for Bytes {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let bytes = self.0 as f64;
        let unit = UNITS.iter().rev().find(|unit| bytes >= 2f64.powi(unit.1));
        let Some((letter, power)) = unit else {
            return write!(f, "{} B", self.0);
        };
        let value = bytes / 2f64.powi(*power);
        let digits = usize::from(value < 10.0);
        write!(f, "{value:.digits$} {}iB", letter.to_ascii_uppercase())
    }
}

/// Memory as an option that allows so much: rounded up to whole MiB.
pub(super) fn as_option(bytes: usize) -> String {
    format!("{}M", bytes.div_ceil(1 << 20))
}

/// The largest resident set that this process has had, in bytes; `None` where the system does not tell.
pub(super) fn peak() -> Option<u64> {
    // Linux. Elsewhere there is no such file.
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status
        .lines()
        .find_map(|line| line.strip_prefix("VmHWM:"))?;
    let kilobytes: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(kilobytes * 1024)
}

/// The peak for people, to be appended to a summary; nothing where the system does not tell.
pub(super) fn peak_in_words() -> String {
    peak().map_or(String::new(), |peak| {
        format!("; {} of memory", Bytes(peak as usize))
    })
}

/// Adds the peak to results, where the system tells it.
pub(super) fn add_peak(json: &mut serde_json::Value) {
    if let Some(peak) = peak() {
        json["memory"] = serde_json::json!({ "peak": peak });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn amounts_are_bytes_or_have_a_unit() {
        let read = |text| parse_memory(text).map(|limit| limit.0.get());
        for (text, bytes) in [
            ("1", 1),
            ("123456", 123_456),
            ("100B", 100),
            ("4G", 4 << 30),
            ("4g", 4 << 30),
            ("512M", 512 << 20),
            ("800MiB", 800 << 20),
            ("800 MB", 800 << 20),
            ("1.5K", 1536),
            ("2T", 2 << 40),
        ] {
            assert_eq!(read(text), Ok(bytes), "{text}");
        }
        for bad in [
            "", "0", "0G", "0.1", "-1G", "G", "4X", "4GG", "4iB", "4Gi", "1e99", "NaN", "infG",
            "4 G 1", "1G2",
        ] {
            let error = read(bad).expect_err(bad);
            assert!(error.contains("such as 4G"), "{bad}: {error}");
        }
    }

    #[test]
    fn amounts_are_read_as_they_are_told() {
        assert_eq!(Bytes(700).to_string(), "700 B");
        assert_eq!(Bytes(1536).to_string(), "1.5 KiB");
        assert_eq!(Bytes(800 << 20).to_string(), "800 MiB");
        assert_eq!(as_option((5 << 20) + 1), "6M");
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn the_peak_holds_what_was_held() {
        let many = vec![1_u8; 200 << 20];
        assert!(peak().expect("Linux tells") > many.iter().map(|&x| u64::from(x)).sum());
    }
}
