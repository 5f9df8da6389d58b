//! The machine that a measurement was made on.

use serde::Serialize;
use std::fs;
use std::num::NonZeroUsize;

/// What decides how long things take, and what is worth telling of it.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Machine {
    /// Model of the processor, or its architecture where the system does not say.
    pub processor: String,
    /// Cores that the system gives to the process.
    pub cores: usize,
    /// Threads that the measurement used.
    pub threads: usize,
    /// Operating system.
    pub system: String,
}

impl Machine {
    /// This machine, asked from within the thread pool of the measurement.
    pub fn this() -> Self {
        let system = file_value("/etc/os-release", "PRETTY_NAME", '=')
            .unwrap_or_else(|| std::env::consts::OS.to_owned());
        let kernel = fs::read_to_string("/proc/sys/kernel/osrelease");
        Self {
            processor: file_value("/proc/cpuinfo", "model name", ':')
                .unwrap_or_else(|| std::env::consts::ARCH.to_owned()),
            cores: std::thread::available_parallelism().map_or(1, NonZeroUsize::get),
            threads: rayon::current_num_threads(),
            system: match kernel {
                Ok(release) => format!("{system}, kernel {}", release.trim()),
                Err(_) => system,
            },
        }
    }
}

/// The value of the first line `key separator value` of a text file.
fn file_value(path: &str, key: &str, separator: char) -> Option<String> {
    let text = fs::read_to_string(path).ok()?;
    value(&text, key, separator)
}

fn value(text: &str, key: &str, separator: char) -> Option<String> {
    text.lines()
        .filter_map(|line| line.split_once(separator))
        .find(|(name, _)| name.trim() == key)
        .map(|(_, value)| value.trim().trim_matches('"').to_owned())
        .filter(|value| !value.is_empty())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_found_by_their_key() {
        let text = "processor\t: 0\nmodel name\t: Fast CPU @ 3 GHz\nmodel name : other\n";
        assert_eq!(
            value(text, "model name", ':').as_deref(),
            Some("Fast CPU @ 3 GHz")
        );
        assert_eq!(
            value("NAME=\"An OS\"\n", "NAME", '=').as_deref(),
            Some("An OS")
        );
        assert_eq!(value(text, "bogomips", ':'), None);
    }

    #[test]
    fn this_machine_has_a_name_and_a_core() {
        let machine = Machine::this();
        assert!(machine.cores > 0 && machine.threads > 0);
        assert!(!machine.processor.is_empty() && !machine.system.is_empty());
    }
}
