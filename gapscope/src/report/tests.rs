//! The page as a whole: well formed, escaped, finite, small, and the same every time.

#[path = "../../tests/all/browser.rs"]
pub mod browser;

use super::*;
use gapscope_diagnosis::schema::FoundEffect;
use gapscope_diagnosis::schema::Parameter;
use gapscope_effects::Kind;

/// Elements that HTML closes by itself.
const VOID: [&str; 5] = ["meta", "input", "br", "link", "wbr"];

/// The page without what stands inside its scripts.
fn without_scripts(page: &str) -> String {
    let mut text = String::new();
    let mut rest = page;
    while let Some(start) = rest.find("<script") {
        let inside = start + rest[start..].find('>').unwrap() + 1;
        text += &rest[..inside];
        rest = &rest[inside + rest[inside..].find("</script>").unwrap()..];
        text += "</script>";
        rest = &rest["</script>".len()..];
    }
    text + rest
}

/// Fails where an element is not closed or an attribute is not quoted.
fn check_balance(name: &str, page: &str) {
    let page = &without_scripts(page);
    assert!(page.starts_with("<!DOCTYPE html>") && page.ends_with('>'), "{name}");
    let body = page.strip_prefix("<!DOCTYPE html>").unwrap_or_default();
    let mut open: Vec<&str> = vec![];
    let mut rest = body;
    while let Some(start) = rest.find('<') {
        let tag = &rest[start + 1..];
        let end = tag.find('>').unwrap_or(tag.len() - 1);
        let inside = &tag[..end];
        assert_eq!(inside.matches('"').count() % 2, 0, "{name}: quotes in <{inside}>");
        assert!(!inside.contains('<'), "{name}: < in <{inside}>");
        if let Some(closing) = inside.strip_prefix('/') {
            assert_eq!(open.pop(), Some(closing), "{name}: </{closing}>");
        } else {
            let element = inside.split_whitespace().next().unwrap_or_default();
            if !VOID.contains(&element) {
                open.push(element);
            }
        }
        rest = &tag[end + 1..];
    }
    assert!(open.is_empty(), "{name}: left open {open:?}");
}

#[test]
fn every_verdict_is_well_formed_finite_small_and_repeatable() {
    for (name, diagnosis, evidence) in sample::all() {
        let page = html(&diagnosis, &evidence, &Setting::default());
        check_balance(name, &page);
        for word in ["NaN", "inf<", ">inf", " inf ", "\"inf", "undefined", "None<", "Some("] {
            assert!(!without_scripts(&page).contains(word), "{name}: {word}");
        }
        assert!(page.len() < 2_000_000, "{name}: {} bytes", page.len());
        assert_eq!(page, html(&diagnosis, &evidence, &Setting::default()), "{name}");
        assert!(
            page.contains(words::verdict(diagnosis.verdict))
                && plain::answer(&diagnosis)
                    .iter()
                    .all(|line| page.contains(&maud::html! { (unbroken(line)) }.into_string()))
        );
        let of_bodies = page.contains("Mass of panda_link7 and all it carries");
        assert_eq!(of_bodies, !diagnosis.combinations.is_empty(), "{name}");
        let words = without_scripts(&page);
        for word in ["http://", "https://", " src=", "@import", "url("] {
            assert!(!words.contains(word), "{name}: {word} would reach out");
        }
        for word in ["fetch(", "XMLHttpRequest", "import(", "importScripts", "WebSocket", "sendBeacon"] {
            assert!(!page.contains(word), "{name}: {word} would reach out");
        }
        if let Ok(folder) = std::env::var("GAPSCOPE_SAMPLE_REPORTS") {
            std::fs::write(std::path::Path::new(&folder).join(format!("{name}.html")), &page).ok();
        }
    }
}

#[test]
fn holds_every_effect_of_the_catalogue() {
    let kinds: Vec<&str> =
        Kind::ALL.iter().chain(&Kind::SERVO).map(|kind| kind.name()).chain(["from_a_later_version"]).collect();
    let (_, mut diagnosis, evidence) = sample::explained();
    let pattern = diagnosis.effects[0].clone();
    diagnosis.effects = kinds.iter().map(|kind| FoundEffect { kind: (*kind).into(), ..pattern.clone() }).collect();
    let page = html(&diagnosis, &evidence, &Setting::default());
    check_balance("catalogue", &page);
    for kind in &kinds {
        assert!(page.contains(&format!("<code>{kind}</code>")), "{kind}");
        assert!(page.contains(&words::capital(&words::effect(kind))), "{kind}");
        assert!(*kind == "from_a_later_version" || !words::meaning(kind).is_empty(), "{kind}");
    }
}

#[test]
fn slides_have_forces_and_a_robot_of_both_kinds_has_efforts() {
    for (sliding, word, other) in [(7, "force", "torque"), (3, "effort", "torque")] {
        let (_, mut diagnosis, mut evidence) = sample::explained();
        let slides: Vec<String> = diagnosis.joints[..sliding].to_vec();
        for regime in diagnosis.gap.regimes.iter_mut().filter(|r| slides.contains(&r.joint)) {
            regime.bounds.unit = "m/s".into();
        }
        evidence.torque.iter_mut().filter(|s| slides.contains(&s.joint)).for_each(|s| s.unit = "N".into());
        diagnosis.effects[0].kind = "torque_bias".into();
        let page = html(&diagnosis, &evidence, &Setting::default());
        let capital = words::capital(word);
        for part in [
            format!("<h2 id=\"joints-title\">{capital} gap by joint"),
            format!("<h2 id=\"over-time-title\">{capital} over time"),
            format!("{capital} bias <code>torque_bias</code>"),
            format!("With them the {word} gap falls"),
            format!("\"what\":\"{word}\""),
        ] {
            assert!(page.contains(&part), "{part}");
        }
        let said = without_scripts(&page);
        let said = said.split("</style>").nth(1).unwrap().replace("torque_", "");
        let at = said.to_lowercase().find(other).map(|at| said[at.saturating_sub(60)..at + 20].to_owned());
        assert_eq!(at, None, "the other word is nowhere");
    }
}

#[test]
fn escapes_names() {
    let (_, diagnosis, evidence) = sample::no_gap();
    let page = html(&diagnosis, &evidence, &Setting::default());
    assert!(page.contains("&lt;script&gt;alert(1)&lt;/script&gt;"));
    assert!(page.contains("arm &lt;b&gt;&amp;amp; &quot;co&quot;&lt;/b&gt;"));
    let (_, mut diagnosis, mut evidence) = sample::explained();
    let bad = "a\"><script>alert(1)</script>'&";
    diagnosis.data.findings.push(bad.into());
    diagnosis.effects[0].kind = bad.into();
    diagnosis.gap.regimes[0].regime = bad.into();
    diagnosis.gap.regimes[1].bounds.unit = bad.into();
    evidence.curves[0].x_label = bad.into();
    evidence.torque[0].unit = bad.into();
    evidence.logs.push(bad.into());
    let page = html(&diagnosis, &evidence, &Setting::default());
    check_balance("bad names", &page);
    assert!(!page.contains("<script>alert"), "a name stays a name, in the data of the scripts too");
}

#[test]
fn shows_units_and_intervals() {
    let (_, diagnosis, evidence) = sample::explained();
    let page = html(&diagnosis, &evidence, &Setting::default());
    for part in [
        "<b>1.51</b>\u{a0}N\u{a0}m",
        "[1.47,\u{a0}1.55]",
        "<b>4.20</b>",
        "speed, rad/s",
        "torque, N m",
        "horizon, s",
        "time, s",
    ] {
        assert!(page.contains(part), "{part}");
    }
    let (_, diagnosis, evidence) = sample::prismatic();
    let page = html(&diagnosis, &evidence, &Setting::default());
    assert!(page.contains("force, N<") && !page.contains("N\u{a0}m") && !page.contains("rad/s"));
}

#[test]
fn bad_figures_print_as_dashes() {
    let (_, mut diagnosis, mut evidence) = sample::explained();
    diagnosis.gap.torque.rms.insert("panda_joint1".into(), f64::NAN);
    diagnosis.gap.torque.ci95.insert("panda_joint2".into(), [f64::NEG_INFINITY, f64::NAN]);
    diagnosis.gap.regimes[0].share = f64::NAN;
    diagnosis.shrink.torque.shrink = Some(f64::NAN);
    diagnosis.shrink.rollout[0].change.before = Some(f64::INFINITY);
    diagnosis.effects[0].confidence = f64::NAN;
    if let Some(Parameter::PerJoint(map)) = diagnosis.effects[0].parameters.get_mut("coulomb") {
        map.values_mut().for_each(|e| e.value = gapscope_diagnosis::schema::Quantity::Vector(vec![]));
    }
    evidence.torque[0].measured[5] = f64::NAN;
    evidence.curves[0].data[3] = [f64::NAN, f64::INFINITY];
    evidence.curves[1].law.clear();
    let page = html(&diagnosis, &evidence, &Setting::default());
    check_balance("bad figures", &page);
    let page = without_scripts(&page);
    assert!(!page.contains("NaN") && !page.contains("inf%") && !page.contains("\"inf"));
}

#[test]
fn very_long_logs_stay_small() {
    let (_, diagnosis, mut evidence) = sample::explained();
    for series in &mut evidence.torque {
        let long = |values: &Vec<f64>| values.iter().copied().cycle().take(200_000).collect::<Vec<f64>>();
        series.measured = long(&series.measured);
        series.nominal = long(&series.nominal);
        series.corrected = long(&series.corrected);
        series.time = (0..200_000).map(|i| i as f64 * 0.002).collect();
        series.breaks = (1..200).map(|i| 1000 * i).collect();
    }
    let page = html(&diagnosis, &evidence, &Setting::default());
    assert!(page.len() < 2_000_000, "{} bytes", page.len());
}

#[test]
fn the_page_of_a_score_is_well_formed_and_finite() {
    use gapscope_withheld::{Answer, CaseScore, Group, Score, Truth, judge};
    let golden: serde_json::Value =
        serde_json::from_str(include_str!("../../../withheld/golden/judgements.json")).unwrap();
    let cases = golden["cases"].as_array().unwrap().iter().map(|case| {
        let truth: Truth = serde_json::from_value(case["truth"].clone()).unwrap();
        let answer: Option<Answer> = serde_json::from_value(case["diagnosis"].clone()).unwrap();
        let judgement = judge(&truth, answer.as_ref(), Some(&case["evaluation"]));
        let error = answer.is_none().then(|| "no <answer>".to_owned());
        CaseScore::new(["sample", case["case"].as_str().unwrap()], &truth, judgement, 0.5, error)
    });
    for score in [Score::new(cases.collect()), Score::new(vec![])] {
        let page = score::html(&score);
        check_balance("score", &page);
        let markdown = score::markdown::page(&score, "call", ["a.svg", "b.svg", "c.svg"]);
        use score::pictures::{calibration, confusion, size};
        for text in [&page, &markdown, &confusion(&score), &calibration(&score), &size(&score)] {
            for word in ["NaN", "inf<", " inf ", "None<", "Some(", "<script", "https://", "<answer>"] {
                assert!(!text.contains(word) || word == "<answer>" && text == &markdown, "{word}");
            }
        }
        let rows = markdown.lines().filter(|line| line.starts_with("| sample/")).count();
        let missed = score.cases.iter().filter(|c| !c.judgement.exact && c.group != Group::Undetectable).count();
        assert_eq!(rows, missed);
        let (_, counts) = score.confusion_matrix();
        let marked: usize = counts.iter().flatten().filter(|n| **n > 0).count();
        assert!(confusion(&score).matches("named").count() > marked, "every count has its tip");
        assert_eq!(calibration(&score).matches("<circle").count(), score.calibration.len());
        assert_eq!(size(&score).matches("<circle").count(), score.visibility.len());
    }
}

#[test]
fn thirty_joints_with_long_names_and_a_thousand_episodes_have_a_page_that_works() {
    let ((name, diagnosis, evidence), setting) = sample::large();
    let page = html(&diagnosis, &evidence, &setting);
    check_balance(name, &page);
    assert!(page.len() < 2_000_000, "{} bytes", page.len());
    // A command that names a thousand logs is none that a person copies.
    assert!(page.contains(">LOG...</span>") && page.contains("stands for the 1000 logs above"));
    let dir = tempfile::tempdir().unwrap();
    let file = dir.path().join("report.html");
    std::fs::write(&file, &page).unwrap();
    if let Ok(folder) = std::env::var("GAPSCOPE_SAMPLE_REPORTS") {
        std::fs::write(std::path::Path::new(&folder).join("large.html"), &page).ok();
    }
    look(&[&file], &[]);
}

#[test]
fn the_page_of_every_verdict_works_in_a_browser() {
    let dir = tempfile::tempdir().unwrap();
    let write = |(name, diagnosis, evidence): (&str, Diagnosis, Evidence)| {
        let file = dir.path().join(name).join("report.html");
        crate::output::write(&file, &html(&diagnosis, &evidence, &Setting::default())).unwrap();
        file
    };
    let files: Vec<_> = sample::all().into_iter().map(write).collect();
    look(&files.iter().map(|file| file.as_path()).collect::<Vec<_>>(), &[]);
}
