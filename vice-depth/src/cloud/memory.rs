//! How much memory a scan may take.

use std::fs::read_to_string;
use std::path::Path;

/// Where nothing tells how much memory is free.
const FALLBACK_BYTES: u64 = 8 << 30;

/// Bytes that may be taken: 80 % of what is free, so that the machine stays usable.
pub(super) fn available_bytes() -> u64 {
    let system = read_to_string("/proc/meminfo").ok().and_then(|text| meminfo_available(&text));
    let group = control_group(Path::new("/sys/fs/cgroup"));
    let free = match (system, group) {
        (Some(a), Some(b)) => a.min(b),
        (Some(a), None) | (None, Some(a)) => a,
        (None, None) => FALLBACK_BYTES,
    };
    free / 5 * 4
}

/// `MemAvailable` of Linux's `/proc/meminfo`, bytes.
fn meminfo_available(text: &str) -> Option<u64> {
    let line = text.lines().find_map(|l| l.strip_prefix("MemAvailable:"))?;
    let kib: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    kib.checked_mul(1024)
}

/// What a container's limit leaves, bytes; `None` without a limit.
fn control_group(folder: &Path) -> Option<u64> {
    let number = |name: &str| read_to_string(folder.join(name)).ok()?.trim().parse::<u64>().ok();
    Some(number("memory.max")?.saturating_sub(number("memory.current")?))
}

/// Bytes for people.
pub(super) fn shown(bytes: u64) -> String {
    match bytes {
        0..10_000_000 => format!("{:.1} MB", bytes as f64 / 1e6),
        10_000_000..10_000_000_000 => format!("{:.0} MB", bytes as f64 / 1e6),
        _ => format!("{:.1} GB", bytes as f64 / 1e9),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_free_is_read_or_guessed() {
        let text = "MemTotal:       24000000 kB\nMemFree:        1 kB\nMemAvailable:   23000000 kB\n";
        assert_eq!(meminfo_available(text), Some(23_000_000 * 1024));
        assert_eq!(meminfo_available("MemTotal: 1 kB"), None);
        assert_eq!(meminfo_available("MemAvailable: lots"), None);
        assert!(available_bytes() > 0);
        let folder = tempfile::tempdir().unwrap();
        assert_eq!(control_group(folder.path()), None);
        std::fs::write(folder.path().join("memory.max"), "max\n").unwrap();
        std::fs::write(folder.path().join("memory.current"), "100\n").unwrap();
        assert_eq!(control_group(folder.path()), None, "a group without a limit");
        std::fs::write(folder.path().join("memory.max"), "1000\n").unwrap();
        assert_eq!(control_group(folder.path()), Some(900));
        assert_eq!((shown(2_500_000).as_str(), shown(12_000_000_000).as_str()), ("2.5 MB", "12.0 GB"));
    }
}
