//! Logs of real machines that are open to all, and what was published about them.

/// A log with what is known about its robot.
pub struct Log {
    /// File name of the page without ending.
    pub name: &'static str,
    /// Title of the page.
    pub title: &'static str,
    /// Folder of the robot and its logs.
    pub set: &'static str,
    /// The log that is diagnosed.
    pub log: &'static str,
    /// Other logs of the robot, on which the corrected model is tried.
    pub others: &'static [&'static str],
    /// What the machine and the log are, in a sentence or two.
    pub about: &'static str,
    /// Where log and published values come from, and what to bear in mind when comparing.
    pub source: &'static str,
    /// Published parameters.
    pub published: &'static [Published],
    /// What another program explains of each joint's effort; `None` where nobody has told.
    pub known: Option<KnownFit>,
}

/// R² of the effort of each joint in the robot's order, of another program, on all of the log.
pub struct KnownFit {
    /// Of the model as described; empty where nobody has told.
    pub nominal: &'static [f64],
    /// Of the corrected one.
    pub corrected: &'static [f64],
    /// What the corrected one has, in words.
    pub with: &'static str,
}

/// A published parameter of an effect, a value for each joint that has one.
pub struct Published {
    /// Public name of the effect.
    pub kind: &'static str,
    /// Public name of the parameter.
    pub parameter: &'static str,
    /// Joint and value; an empty joint for a parameter that is not a joint's.
    pub values: &'static [(&'static str, f64)],
}

const fn of(kind: &'static str, parameter: &'static str, values: &'static [(&'static str, f64)]) -> Published {
    Published { kind, parameter, values }
}

/// The logs in the order of the pages.
pub const LOGS: [Log; 5] = [
    Log {
        name: "emps",
        title: "EMPS: a drive on a slide",
        set: "emps",
        log: "record_1.csv.gz",
        others: &["record_2_pulses.csv.gz"],
        about: "One prismatic axis, an electro-mechanical positioning system, to and fro for 24.8 s at 1 kHz: position and drive force. \
                The nominal model has the mass and no friction. Record 2 was run with pulses that the controller injected.",
        source: "Log and values: A. Janot, M. Gautier, M. Brunot, “Data Set and Reference Models of EMPS”, Workshop on Nonlinear System \
                 Identification Benchmarks, 2019. The offset was published in the sense of friction, −3.165 N; here it counts as effort, \
                 with the other sign. By itself record 2 gives a viscous friction of 211 to 214 N s/m.",
        published: &[
            of("coulomb_friction", "coulomb", &[("slider", 20.394)]),
            of("viscous_friction", "viscous", &[("slider", 203.50)]),
            of("torque_bias", "bias", &[("slider", 3.165)]),
        ],
        known: Some(KnownFit {
            nominal: &[],
            corrected: &[0.998],
            with: "least squares on mass, viscous and Coulomb friction and offset",
        }),
    },
    Log {
        name: "tx40",
        title: "TX40: an industrial arm",
        set: "tx40",
        log: "exciting.csv.gz",
        others: &[],
        about: "A Stäubli TX40, 6 joints, on an exciting motion of 9 s at 5 kHz: position, and joint torque from motor current. Joints 5 and \
                6 are coupled in the wrist. The last second is at rest.",
        source: "Log: the data set of the IDIM papers of M. Gautier, A. Janot and P.-O. Vandanjon, as `thanhndv212/figaroh-examples` holds it, with the \
                 values identified there. Joints 5 and 6: a coupling acts on the sum of both speeds; the own viscous friction of 1.244 and 0.034 \
                 N m s/rad is what the published 1.86 and 0.65 leave beside its 0.616. Rotor inertia is left out: the URDF carries part of it. Offsets \
                 were published in the sense of friction; as effort they count with the other sign.",
        published: &[
            of(
                "viscous_friction",
                "viscous",
                &[
                    ("joint_1", 8.05),
                    ("joint_2", 5.53),
                    ("joint_3", 1.97),
                    ("joint_4", 1.11),
                    ("joint_5", 1.244),
                    ("joint_6", 0.034),
                ],
            ),
            of(
                "coulomb_friction",
                "coulomb",
                &[
                    ("joint_1", 7.14),
                    ("joint_2", 8.26),
                    ("joint_3", 6.34),
                    ("joint_4", 2.48),
                    ("joint_5", 3.03),
                    ("joint_6", 0.282),
                ],
            ),
            of("joint_coupling", "coulomb", &[("", 1.95)]),
            of("joint_coupling", "viscous", &[("", 0.616)]),
            of("joint_coupling", "armature", &[("", 0.00964)]),
            of(
                "torque_bias",
                "bias",
                &[
                    ("joint_1", -0.392),
                    ("joint_2", -1.37),
                    ("joint_3", -0.326),
                    ("joint_4", 0.102),
                    ("joint_5", 0.0288),
                    ("joint_6", -0.127),
                ],
            ),
        ],
        known: Some(KnownFit {
            nominal: &[0.21, 0.46, 0.17, 0.02, 0.00, -0.01],
            corrected: &[0.983, 0.986, 0.989, 0.989, 0.979, 0.964],
            with: "the published friction, inertia, offset and coupling",
        }),
    },
    Log {
        name: "kinova",
        title: "Kinova Gen3: a light 7-joint arm",
        set: "kinova_gen3",
        log: "opti_traj_testing1.csv.gz",
        others: &["RunTrajectory1.csv.gz"],
        about: "A Kinova Gen3, 7 joints, on an exciting motion of 4.7 s at 1 kHz: position, and motor torque from current.",
        source: "Log: `wissem01chiha/dynamic-identification`. No identification of this robot was published with it: nothing is held against \
                 published figures here.",
        published: &[],
        known: None,
    },
    Log {
        name: "double-pendulum",
        title: "Double pendulum: quasi-direct drives",
        set: "double_pendulum",
        log: "slow_74s.csv.gz",
        others: &["run_055640.csv.gz", "run_060143.csv.gz", "run_060245.csv.gz"],
        about: "The DFKI double pendulum, design A.0, 2 joints, 75 s at about 300 Hz: position, measured velocity and motor torque.",
        source: "Log and values: `dfki-ric-underactuated-lab/double_pendulum`, with F. Wiebe et al., “Open-Source Dual-Purpose Acrobot and Pendubot \
                 Platform”, IEEE Robotics & Automation Magazine 31(2), 2024. Its Coulomb friction of 0.146 and 0.123 N m multiplies an arctangent of the speed: the amplitude \
                 is π/2 times that, 0.229 and 0.193 N m. Viscous friction was published as nearly none.",
        published: &[
            of("coulomb_friction", "coulomb", &[("Joint1", 0.229), ("Joint2", 0.193)]),
            of("armature", "armature", &[("Joint1", 0.00276), ("Joint2", 0.00276)]),
        ],
        known: Some(KnownFit { nominal: &[0.974, 0.922], corrected: &[0.993, 0.975], with: "everything fitted anew" }),
    },
    Log {
        name: "kuka-lwr4",
        title: "KUKA LWR4+: torque behind the gear",
        set: "kuka_lwr4",
        log: "run_1.csv.gz",
        others: &["run_2.csv.gz", "run_3.csv.gz"],
        about: "A KUKA LWR4+, 7 joints, on an exciting motion of 25 s at 200 Hz: position, velocity, and torque from sensors behind the gears. The \
                motor’s side of the gear does not show there: no rotor is to be found, and little friction. The log calls that torque `effort`, so that \
                nothing says to the diagnosis where it was measured.",
        source: "Log: test data of `kjyv/FloBaRoID`, LGPL-3.0. No parameters were published with it. In its URDF the inertia of the last joints is \
                 wrong: the torque that it asks of them misses the measured by more than that varies. The URDF has two `<origin>` in one fixed joint; \
                 the first counts, as in ROS.",
        published: &[],
        known: Some(KnownFit {
            nominal: &[-0.9, 0.995, 0.94, 0.995, -1.1, -9.0, -0.3],
            corrected: &[0.96, 0.999, 0.994, 0.998, 0.89, 0.79, 0.81],
            with: "everything fitted anew",
        }),
    },
];
