//! The terminal text: its size, its words, and nothing that steers the terminal.

use super::*;
use crate::report::sample;
use crate::report::terminal::WIDTH;

fn summary(diagnosis: &Diagnosis, out: Option<&Path>, color: bool) -> String {
    super::summary(diagnosis, None, out, &Paint { terminal: color, color, width: WIDTH })
}

#[test]
fn fits_the_terminal() {
    for (name, diagnosis, _) in sample::all() {
        let text = summary(&diagnosis, Some(Path::new("/tmp/log.gapscope/report.html")), false);
        // Where no terminal shows them, all findings are there.
        assert!(
            text.lines().count() <= 34 + 2 * diagnosis.data.findings.len(),
            "{name}: {} lines\n{text}",
            text.lines().count()
        );
        for line in text.lines() {
            assert!(line.chars().count() <= WIDTH, "{name}: {} columns: {line}", line.chars().count());
        }
        assert!(!text.contains("NaN") && !text.contains("inf ") && !text.contains('\u{1b}'), "{name}\n{text}");
        assert!(text.contains(&verdict(diagnosis.verdict).to_uppercase()) && text.contains("report.html"));
    }
}

#[test]
fn fits_with_long_names_and_odd_changes() {
    let (_, diagnosis, _) = sample::explained();
    let text = serde_json::to_string(&diagnosis).unwrap_or_default();
    let long = text.replace("panda_joint", "left_arm_shoulder_or_wrist_roll_joint_");
    let Ok(mut diagnosis) = serde_json::from_str::<Diagnosis>(&long) else { unreachable!("renaming keeps the schema") };
    diagnosis.shrink.torque.shrink = Some(-1.69);
    diagnosis.shrink.torque.ci95 = Some([-3.15, -0.8]);
    diagnosis.shrink.one_step.ci95 = Some([-0.28, 0.06]);
    diagnosis.shrink.rollout[0].change.shrink = Some(0.99998);
    diagnosis.shrink.rollout[0].change.ci95 = Some([0.99997, 0.99999]);
    for regime in &mut diagnosis.gap.regimes {
        regime.regime = regime.regime.replace("reversal", "high_acceleration");
    }
    let text = summary(&diagnosis, None, false);
    for line in text.lines() {
        assert!(line.chars().count() <= WIDTH, "{} columns: {line}", line.chars().count());
    }
    for part in ["+169 % (80–315 %)", "(−6 % to +28 %)", "−99.9 %  ", "left_arm_shoulder_or_wrist_roll_joint_"] {
        assert!(text.contains(part), "{part}\n{text}");
    }
}

#[test]
fn names_what_it_found() {
    let (_, diagnosis, _) = sample::explained();
    let text = summary(&diagnosis, None, false);
    for part in ["Coulomb friction", "joints 1–7", "Payload", "1.21 ± 0.060", "rollout"] {
        assert!(text.contains(part), "{part}\n{text}");
    }
    assert!(summary(&diagnosis, None, true).contains("\u{1b}[1;32mEXPLAINED"));
}

#[test]
fn begins_with_the_answer_and_says_what_could_make_it_wrong_before_any_figure() {
    for (name, diagnosis, _) in sample::all() {
        let text = summary(&diagnosis, None, false);
        let first = crate::report::plain::answer(&diagnosis).join(" ").replace(['\u{a0}', '\u{202f}'], " ");
        let begun: String =
            text.split("\n\n").next().unwrap_or_default().split_whitespace().collect::<Vec<_>>().join(" ");
        assert_eq!(begun, clean(&first).split_whitespace().collect::<Vec<_>>().join(" "), "{name}");
        if let (Some(tie), Some(figures)) = (text.find("\nTies "), text.find("\nWhich ")) {
            assert!(tie < figures, "{name}\n{text}");
        }
    }
}

#[test]
fn a_narrow_terminal_gets_narrow_lines_and_every_word() {
    let (_, mut diagnosis, _) = sample::explained();
    diagnosis.data.findings =
        vec!["the clock of the second log jumps by three seconds at sample 400, and once more later".into()];
    let wide = super::summary(&diagnosis, None, None, &Paint { terminal: true, color: false, width: 100 });
    let narrow = super::summary(&diagnosis, None, None, &Paint { terminal: true, color: false, width: 60 });
    assert!(narrow.lines().all(|line| line.chars().count() <= 60), "{narrow}");
    let words = |text: &str| text.split_whitespace().map(str::to_owned).collect::<Vec<_>>();
    assert_eq!(words(&wide), words(&narrow));
}

#[test]
fn says_what_to_change_in_the_robots_own_description() {
    let (_, diagnosis, _) = sample::explained();
    let more = (2..=9).map(|j| format!("joint{j}: <dynamics damping=\"0.{j}\" friction=\"1.5\"/>"));
    let paste = std::iter::once("joint1: <dynamics damping=\"0\" friction=\"2.5\"/>".into()).chain(more).collect();
    let ledger = TargetLedger {
        target: "urdf".into(),
        file: "robot.urdf".into(),
        shrink: None,
        shrink_here: None,
        effects: vec![],
        paste,
        notes: vec![],
    };
    let text = super::summary(&diagnosis, Some(&ledger), None, &Paint::plain());
    let told = text.split("\nChange").nth(1).unwrap().split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(told.starts_with("in the URDF: joint1 friction 2.5; joint2 damping 0.2, friction 1.5"), "{told}");
    assert!(told.contains("joint7 damping") && told.contains("; and 2 more in the report"), "{told}");
    let none = TargetLedger { paste: vec![], ..ledger };
    assert!(!super::summary(&diagnosis, Some(&none), None, &Paint::plain()).contains("Change"));
}

#[test]
fn control_characters_stay_out() {
    let (_, mut diagnosis, _) = sample::explained();
    diagnosis.robot = "arm\u{1b}[31m\n".into();
    diagnosis.data.findings = vec!["a\u{1b}]0;title\u{7}".into()];
    assert!(!summary(&diagnosis, None, false).contains('\u{1b}'));
}

#[test]
fn evaluation_in_lines() {
    let text = evaluation_summary(&sample::evaluation(true));
    assert!(text.contains("→") && text.contains("run_07.csv"), "{text}");
    assert!(text.lines().all(|line| line.chars().count() <= WIDTH), "{text}");
    assert!(!evaluation_summary(&sample::evaluation(false)).contains('→'));
}
