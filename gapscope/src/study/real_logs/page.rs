//! One page of documentation for one log.

use super::published::{KnownFit, Log};
use crate::report::effort::Effort;
use crate::report::plain::answer;
use crate::report::{
    NONE, Printed, capital, effect, estimate, figure, implied_unit, joint_list, motion_unit, outstanding, parameter,
    percent, percent_interval, plain, probability_figure, regime_phrase, sentence_of_the_rest, with_unit,
};
use gapscope_diagnosis::Outcome;
use gapscope_diagnosis::schema::{Change, Diagnosis, Estimate, FoundEffect, Parameter, Quantity, Series};
use std::fmt::Write;

/// Regimes listed of what is left.
const LISTED: usize = 6;

/// Another log of the robot with the change of its torque gap by the corrected model.
pub struct Other {
    pub log: &'static str,
    pub change: Change,
}

/// The page; `pictures` are the files of torque over time and of what is left, where there is one.
pub fn markdown(log: &Log, outcome: &Outcome, others: &[Other], pictures: [Option<&str>; 2]) -> String {
    let diagnosis = &outcome.diagnosis;
    let answer = answer(diagnosis).map(|sentence| format!("> {sentence}")).join("\n>\n");
    let mut text = format!(
        "# {}\n\n{}\n\n```\ngapscope diagnose {set}/robot.urdf {set}/{}\n```\n\n**{}.** The answer:\n\n{answer}\n\n",
        log.title,
        log.about,
        log.log,
        capital(crate::report::verdict(diagnosis.verdict)),
        set = log.set,
    );
    // Writing to a string cannot fail.
    let _ =
        writeln!(text, "## What was found, beside what was published\n\n{}\n\n{}", log.source, found(log, diagnosis));
    if let Some(known) = &log.known {
        text.push_str(&explained(known, &outcome.evidence.torque));
    }
    if let Some(picture) = pictures[0] {
        let _ = writeln!(
            text,
            "## Torque over time\n\nBelow {} Hz; every stretch is modelled by a fit that has not seen it.\n\n![Torque, and what the models leave of it]({picture})\n",
            plain(diagnosis.data.band)
        );
    }
    let _ = writeln!(text, "## How far the gap shrinks\n\n{}", shrink(diagnosis));
    if !others.is_empty() {
        text.push_str("The corrected model on other logs of the same robot, of which the diagnosis has seen nothing:\n\n| log | torque gap before | after | shrinks by | 95 % |\n|---|--:|--:|--:|--:|\n");
        for other in others {
            text.push_str(&change_row(other.log, &other.change));
        }
        text.push('\n');
    }
    let _ = writeln!(text, "## What stays unexplained\n\n{}\n", sentence_of_the_rest(diagnosis));
    let marked = outstanding(&diagnosis.unexplained.regimes);
    if !marked.is_empty() {
        text.push_str("| joint | where | part of what is left there | part of the samples |\n|---|---|--:|--:|\n");
        for regime in marked.iter().take(LISTED) {
            let (share, samples) = (percent(regime.share), percent(regime.samples));
            let _ = writeln!(text, "| {} | {} | {share} | {samples} |", regime.joint, regime_phrase(regime));
        }
        text.push('\n');
    }
    if let Some(picture) = pictures[1] {
        let _ = writeln!(text, "![What is left, by joint and regime]({picture})\n");
    }
    text.push_str("This page and its pictures are made by `gapscope study real-logs --data DIR --force`.\n");
    Effort::of(&diagnosis.gap.regimes).say(&text).replace('\u{202f}', "\u{a0}")
}

/// What the models explain of each joint's effort, beside what another program does.
fn explained(known: &KnownFit, torque: &[Series]) -> String {
    let mut text = format!(
        "## What is explained of each joint’s torque\n\nR², 1 − squares left over squares about the mean. Figures here are of what was held out of \
         each fit, those of another program of all of the log. Its corrected model has {}.\n\n\
         | joint | as described | the same, another program | with the effects, held out | corrected by another program |\n|---|--:|--:|--:|--:|\n",
        known.with
    );
    for (j, series) in torque.iter().enumerate() {
        // Three decimals: three digits would print 0.9996 as 1.
        let own = |model: &Vec<f64>| {
            r_squared(&series.measured, model).map_or(NONE.into(), |r| format!("{r:.3}").replace('-', "−"))
        };
        let other = |all: &[f64]| all.get(j).map_or(NONE.into(), |r| plain(*r));
        let cells =
            [own(&series.nominal), other(known.nominal), own(&series.corrected), other(known.corrected)].join(" | ");
        let _ = writeln!(text, "| {} | {cells} |", series.joint);
    }
    text.push('\n');
    text
}

/// 1 − squares left over squares about the mean; `None` without a model of each sample, or where nothing varies.
fn r_squared(measured: &[f64], model: &[f64]) -> Option<f64> {
    if model.len() != measured.len() {
        return None;
    }
    let mean = measured.iter().sum::<f64>() / measured.len() as f64;
    let about: f64 = measured.iter().map(|m| (m - mean).powi(2)).sum();
    let left: f64 = measured.iter().zip(model).map(|(m, p)| (m - p).powi(2)).sum();
    (about > 0.0).then(|| 1.0 - left / about)
}

/// Every parameter found, and those published that were not.
fn found(log: &Log, diagnosis: &Diagnosis) -> String {
    let mut text = String::from(
        "| effect | joint | parameter | found | 95 % interval | published | off by |\n|---|---|---|--:|---|--:|--:|\n",
    );
    for one in &diagnosis.effects {
        for (name, value) in &one.parameters {
            let estimates: Vec<(&str, &Estimate)> = match value {
                Parameter::Single(estimate) => vec![("", estimate)],
                // In the order of the robot's joints.
                Parameter::PerJoint(map) => {
                    diagnosis.joints.iter().filter_map(|joint| Some((joint.as_str(), map.get(joint)?))).collect()
                }
            };
            for (joint, value) in estimates {
                let published = published(log, &one.kind, name, joint);
                let place =
                    if joint.is_empty() { joint_list(&one.joints, &diagnosis.joints) } else { joint.to_owned() };
                let Printed { value: printed, interval, unit, .. } = estimate(value);
                let off = published.zip(scalar(value)).map(|(p, value)| percent((value / p - 1.0).abs()));
                let cells = [
                    effect(&one.kind),
                    place,
                    parameter(name),
                    with_unit(&printed, &unit),
                    interval.join(" "),
                    published.map_or(NONE.into(), figure),
                    off.unwrap_or(NONE.into()),
                ];
                let _ = writeln!(text, "| {} |", cells.join(" | "));
            }
        }
    }
    for missing in log.published {
        for (joint, value) in
            missing.values.iter().filter(|(joint, _)| !is_found(diagnosis, missing.kind, missing.parameter, joint))
        {
            let _ = writeln!(
                text,
                "| {} | {joint} | {} | not found | | {} | |",
                effect(missing.kind),
                parameter(missing.parameter),
                figure(*value)
            );
        }
    }
    text.push('\n');
    for one in &diagnosis.effects {
        text.push_str(&confidence(one));
    }
    text
}

fn confidence(one: &FoundEffect) -> String {
    let ties: Vec<String> = one.indistinguishable_from.iter().map(|kind| effect(kind)).collect();
    let ties = if ties.is_empty() { String::new() } else { format!(" Not to be told from {}.", ties.join(", ")) };
    let interval = |[low, high]: [f64; 2]| match low < 0.0 && high > 0.0 {
        true => format!(" ({} less to {} more)", percent(high), percent(-low)),
        false => format!(" ({})", percent_interval([low.abs().min(high.abs()), low.abs().max(high.abs())])),
    };
    let interval = one.shrink.ci95.map_or(String::new(), interval);
    let alone = one.shrink.torque.map_or(String::new(), |part| {
        let verb = if part < 0.0 { "grows" } else { "shrinks" };
        format!(" Alone it {verb} the torque gap by {}{interval}.", percent(part.abs()))
    });
    format!("- {}: confidence {} %.{alone}{ties}\n", capital(&effect(&one.kind)), probability_figure(one.confidence))
}

fn published(log: &Log, kind: &str, parameter: &str, joint: &str) -> Option<f64> {
    let known = log.published.iter().find(|p| p.kind == kind && p.parameter == parameter)?;
    known.values.iter().find(|(of, _)| *of == joint).map(|(_, value)| *value)
}

fn is_found(diagnosis: &Diagnosis, kind: &str, parameter: &str, joint: &str) -> bool {
    let parameters = diagnosis.effects.iter().filter(|e| e.kind == kind).filter_map(|e| e.parameters.get(parameter));
    parameters.into_iter().any(|p| match p {
        Parameter::Single(_) => joint.is_empty(),
        Parameter::PerJoint(map) => map.contains_key(joint),
    })
}

fn scalar(estimate: &Estimate) -> Option<f64> {
    match estimate.value {
        Quantity::Scalar(value) => Some(value),
        Quantity::Vector(_) => None,
    }
}

fn shrink(diagnosis: &Diagnosis) -> String {
    let (shrink, regimes) = (&diagnosis.shrink, &diagnosis.gap.regimes);
    let (position, velocity) = (motion_unit(regimes, false), motion_unit(regimes, true));
    let mut text = String::from(
        "Held-out data, rms over the joints.\n\n| gap in | before | after | shrinks by | 95 % |\n|---|--:|--:|--:|--:|\n",
    );
    text.push_str(&change_row("torque, of effort std", &shrink.torque));
    text.push_str(&change_row(&format!("one step, {velocity}"), &shrink.one_step));
    for h in &shrink.rollout {
        text.push_str(&change_row(&format!("rollout of {} s, {position}", plain(h.horizon)), &h.change));
    }
    let of = |value: Option<f64>| value.map_or(NONE.into(), figure);
    let reference = &shrink.reference;
    let _ = writeln!(
        text,
        "\nIn the measure of the first row the noise floor is {}. A residual network on the nominal model leaves {}, a network alone {}.\n",
        figure(reference.noise_floor),
        of(reference.residual_network),
        of(reference.pure_network)
    );
    text.push_str("| joint | torque gap, rms | 95 % | noise floor |\n|---|--:|--:|--:|\n");
    let torque = &diagnosis.gap.torque;
    for joint in &diagnosis.joints {
        let Some(rms) = torque.rms.get(joint) else { continue };
        let ends =
            torque.ci95.get(joint).map_or(NONE.into(), |[from, to]| format!("{}–{}", figure(*from), figure(*to)));
        let floor = of(torque.floor.get(joint).copied());
        let _ = writeln!(text, "| {joint} | {} {} | {ends} | {floor} |", figure(*rms), implied_unit(joint, regimes));
    }
    text
}

fn change_row(name: &str, change: &Change) -> String {
    let [before, after] = change.gaps().map(figure);
    let shrink = match (change.before, change.shrink) {
        (_, Some(part)) => percent(part),
        // A model that cannot be simulated there has no error to compare with.
        (None, None) => NONE.into(),
        (Some(_), None) => "at the floor".into(),
    };
    format!("| {name} | {before} | {after} | {shrink} | {} |\n", change.ci95.map_or(NONE.into(), percent_interval))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn r_squared_is_a_part_of_the_variance() {
        let measured = [1.0, 2.0, 3.0, 6.0];
        assert_eq!(r_squared(&measured, &measured), Some(1.0));
        assert_eq!(r_squared(&measured, &[3.0; 4]), Some(0.0));
        assert!((r_squared(&measured, &[1.0, 2.0, 3.0, 13.0]).unwrap() - (1.0 - 49.0 / 14.0)).abs() < 1e-12);
        assert_eq!(
            (r_squared(&measured, &[]), r_squared(&[2.0; 3], &[1.0; 3]), r_squared(&[], &[])),
            (None, None, None)
        );
    }

    #[test]
    fn what_another_program_explains_stands_beside() {
        let series = |joint: &str, model: f64| Series {
            joint: joint.into(),
            measured: vec![0.0, 2.0],
            nominal: vec![model; 2],
            ..Series::default()
        };
        let known = KnownFit { nominal: &[0.5, -9.0], corrected: &[0.9, 0.8], with: "all" };
        let text = explained(&known, &[series("a", 1.0), series("b", 2.0)]);
        assert!(
            text.contains("| a | 0.000 | 0.5 | – | 0.9 |") && text.contains("| b | −1.000 | −9 | – | 0.8 |"),
            "{text}"
        );
    }
}
