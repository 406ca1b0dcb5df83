//! Machines with several logs, or with one that is long enough to be halved.

/// A machine.
pub struct Machine {
    /// What the page calls it.
    pub name: &'static str,
    /// Folder of the robot and its logs.
    pub set: &'static str,
    /// The logs, each diagnosed alone.
    pub logs: &'static [Source],
    /// Whether its figures are held to the targets.
    pub judged: bool,
}

/// A log, or half of one.
#[derive(Debug, Clone, Copy)]
pub struct Source {
    /// Name of the file.
    pub file: &'static str,
    /// Which half; `None` for all of it.
    pub half: Option<Half>,
}

/// Half of a log, by samples.
#[derive(Debug, Clone, Copy)]
pub enum Half {
    /// The first.
    First,
    /// The second.
    Second,
}

impl Source {
    /// Name of the log on the page.
    pub fn label(&self) -> String {
        let name = self.file.split('.').next().unwrap_or(self.file);
        match self.half {
            None => name.to_owned(),
            Some(Half::First) => format!("{name}, first half"),
            Some(Half::Second) => format!("{name}, second half"),
        }
    }
}

const fn whole(file: &'static str) -> Source {
    Source { file, half: None }
}

const fn half(file: &'static str, half: Half) -> Source {
    Source { file, half: Some(half) }
}

/// The machines in the order of the page. Kinova's logs of 1.9 and 4.7 s are too short to be judged.
pub const MACHINES: [Machine; 5] = [
    Machine {
        name: "KUKA LWR4+",
        set: "kuka_lwr4",
        logs: &[whole("run_1.csv.gz"), whole("run_2.csv.gz"), whole("run_3.csv.gz")],
        judged: true,
    },
    Machine {
        name: "TX40",
        set: "tx40",
        logs: &[half("exciting.csv.gz", Half::First), half("exciting.csv.gz", Half::Second)],
        judged: true,
    },
    Machine {
        name: "double pendulum",
        set: "double_pendulum",
        logs: &[half("slow_74s.csv.gz", Half::First), half("slow_74s.csv.gz", Half::Second)],
        judged: true,
    },
    Machine {
        name: "EMPS",
        set: "emps",
        logs: &[whole("record_1.csv.gz"), whole("record_2_pulses.csv.gz")],
        judged: true,
    },
    Machine {
        name: "Kinova Gen3",
        set: "kinova_gen3",
        logs: &[whole("opti_traj_testing1.csv.gz"), whole("RunTrajectory1.csv.gz")],
        judged: false,
    },
];
