//! What makes a measured figure say less than it seems to.

use std::fs;
use std::path::Path;

/// Values beyond the 99.99 % that make that percentile worth printing; assumed, because with fewer one of them moves it.
const BEYOND: u64 = 10;

/// Of a percentile from so few cycles.
pub fn of_length(cycles: u64) -> Option<String> {
    (cycles / 10_000 < BEYOND).then(|| {
        format!("{cycles} cycles: of less than 100000 the 99.99 % rest on fewer than {BEYOND} values, and the maximum is not yet rare")
    })
}

/// Of figures from the emulator.
pub fn of_emulator() -> Vec<String> {
    vec![
        "emulator: time is counted in instructions of 64 ns each; no cache, flash wait state, bus contention or interrupt entry of a \
         real core is in it. Instruction counts are exact, microseconds are not those of silicon"
            .into(),
    ]
}

/// Of figures from this machine: looks at what Linux says of itself under `root` ("/" but for tests).
pub fn of_machine(root: &Path) -> Vec<String> {
    let read = |path: &str| {
        let text = fs::read_to_string(root.join(path)).ok()?;
        Some(text.trim().to_string())
    };
    let mut caveats = Vec::new();
    if read("proc/cpuinfo").is_some_and(|text| text.lines().any(is_hypervised)) {
        caveats.push("virtual machine: the hypervisor may stop all of it at any time, unseen from inside".to_string());
    }
    let version = read("proc/version").unwrap_or_default();
    if read("sys/kernel/realtime").as_deref() != Some("1") && !version.contains("PREEMPT_RT") {
        caveats.push(
            "kernel without PREEMPT_RT: drivers and interrupts delay a real-time thread without bound".to_string(),
        );
    }
    match read("sys/devices/system/cpu/cpu0/cpufreq/scaling_governor") {
        Some(governor) if governor != "performance" => caveats.push(format!(
            "frequency governor {governor}: the clock changes with the load; take performance"
        )),
        Some(_) => {}
        None => {
            caveats.push("no frequency governor to be seen: whoever owns the machine may change its clock".to_string())
        }
    }
    if read("sys/devices/system/cpu/isolated").is_none_or(|list| list.is_empty()) {
        caveats.push("shared core: no processor is isolated (isolcpus) for the real-time thread".to_string());
    }
    if let Some(quota) = read("sys/fs/cgroup/cpu.max").filter(|quota| !quota.starts_with("max")) {
        caveats.push(format!("processor time is limited by a cgroup ({quota} µs)"));
    }
    if let Some(source) = read("sys/devices/system/clocksource/clocksource0/current_clocksource")
        && !["tsc", "arch_sys_counter"].contains(&source.as_str())
    {
        caveats.push(format!("clock source {source}: reading the time takes a detour"));
    }
    caveats
}

fn is_hypervised(line: &str) -> bool {
    line.starts_with("flags") && line.split_whitespace().any(|flag| flag == "hypervisor")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::whole_file::tests::folder;

    /// The caveats of a root folder with these files in it.
    fn machine(name: &str, files: &[(&str, &str)]) -> Vec<String> {
        let root = folder(name);
        for (path, text) in files {
            let path = root.join(path);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(path, text).unwrap();
        }
        of_machine(&root)
    }

    #[test]
    fn a_machine_set_up_for_real_time_has_none() {
        let files = [
            ("proc/cpuinfo", "flags : fpu sse2 tsc\n"),
            ("sys/kernel/realtime", "1\n"),
            ("sys/devices/system/cpu/cpu0/cpufreq/scaling_governor", "performance\n"),
            ("sys/devices/system/cpu/isolated", "3\n"),
            ("sys/fs/cgroup/cpu.max", "max 100000\n"),
            (
                "sys/devices/system/clocksource/clocksource0/current_clocksource",
                "tsc\n",
            ),
        ];
        assert_eq!(machine("machine-good", &files), [""; 0]);
    }

    #[test]
    fn a_shared_virtual_machine_with_a_lazy_clock_is_told_in_six_ways() {
        let files = [
            ("proc/cpuinfo", "flags : fpu hypervisor tsc\n"),
            ("proc/version", "Linux version 6.1 #1 SMP PREEMPT_DYNAMIC\n"),
            ("sys/devices/system/cpu/cpu0/cpufreq/scaling_governor", "powersave\n"),
            ("sys/devices/system/cpu/isolated", "\n"),
            ("sys/fs/cgroup/cpu.max", "50000 100000\n"),
            (
                "sys/devices/system/clocksource/clocksource0/current_clocksource",
                "hpet\n",
            ),
        ];
        let caveats = machine("machine-poor", &files);
        let begin: Vec<&str> = caveats.iter().filter_map(|line| line.split(':').next()).collect();
        assert_eq!(begin.len(), 6, "{begin:?}");
        assert!(caveats[2].contains("powersave") && caveats[5].contains("hpet"));
    }

    #[test]
    fn a_percentile_needs_a_hundred_thousand_cycles() {
        assert!(of_length(99_999).is_some());
        assert_eq!(of_length(100_000), None);
    }
}
