//! What `gapscope compare` reads: parameters with intervals of a diagnosis, or values of a corrected model.

use super::Row;
use anyhow::{Context, Result, bail};
use gapscope_diagnosis::schema::{self, Parameter, Power, Quantity};
use gapscope_effects::{Effect, Kind};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::Path;

/// What results tell of a parameter.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Told {
    /// Its value; where the effect was not found the one that changes nothing.
    pub value: f64,
    /// Half of its 95 % interval; where the effect was not found, its least size that the logs would have revealed.
    pub half: Option<f64>,
    /// Whether the effect was found.
    pub found: bool,
    /// The effect that it was found under, where that is another account of the same force.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub under: Option<String>,
}

/// Which parameter.
#[derive(Debug, Clone, PartialEq)]
pub struct Key {
    pub kind: String,
    pub parameter: String,
    pub joint: Option<String>,
    pub component: Option<usize>,
}

impl Key {
    /// Whether a row is that of this parameter, or of the same one in another account of its force.
    pub fn is(&self, row: &Row) -> bool {
        (self.kind == row.kind || one_force(&self.kind, &row.kind))
            && (&self.parameter, &self.joint, self.component) == (&row.parameter, &row.joint, row.component)
    }
}

/// Whether two kinds account for the same force, of which a joint has one account.
fn one_force(a: &str, b: &str) -> bool {
    let force = |name: &str| Kind::named(name).and_then(|kind| kind.card().force);
    force(a).is_some() && force(a) == force(b)
}

/// What a file holds.
#[derive(Debug, Clone)]
pub struct Results {
    /// Name of the robot.
    pub robot: String,
    numbers: Vec<(Key, Told, String)>,
    power: Vec<Power>,
}

/// A diagnosis, as far as it is compared; those of arms without torque have the same.
#[derive(Deserialize)]
struct Diagnosis {
    robot: String,
    effects: Vec<Found>,
    #[serde(default)]
    power: Vec<Power>,
}

#[derive(Deserialize)]
struct Found {
    kind: String,
    joints: Vec<String>,
    parameters: BTreeMap<String, Parameter>,
}

/// A corrected model, as far as it is compared.
#[derive(Deserialize)]
struct Corrected {
    robot: String,
    effects: Vec<Effect>,
}

#[derive(Deserialize)]
struct Schema {
    #[serde(default)]
    schema: String,
}

/// Reads results: a folder with diagnosis.json, that file, or a corrected.json.
///
/// # Errors
/// A file that cannot be read or is neither.
pub fn read(path: &Path) -> Result<Results> {
    let file = if path.is_dir() { path.join("diagnosis.json") } else { path.to_owned() };
    let name = file.display();
    let text = std::fs::read_to_string(&file).with_context(|| format!("cannot read {name}"))?;
    let wrong =
        || format!("{name} is not what `gapscope diagnose` writes; give its folder, diagnosis.json or corrected.json");
    let schema: Schema = serde_json::from_str(&text).with_context(wrong)?;
    match schema.schema.split('/').next() {
        Some("gapscope.diagnosis") => Ok(of_diagnosis(serde_json::from_str(&text).with_context(wrong)?)),
        Some("gapscope.model") => Ok(of_corrected(&serde_json::from_str(&text).with_context(wrong)?)),
        _ => bail!("{}", wrong()),
    }
}

/// What a diagnosis in memory tells.
pub fn of(diagnosis: &schema::Diagnosis) -> Results {
    let found = |effect: &schema::FoundEffect| Found {
        kind: effect.kind.clone(),
        joints: effect.joints.clone(),
        parameters: effect.parameters.clone(),
    };
    of_diagnosis(Diagnosis {
        robot: diagnosis.robot.clone(),
        effects: diagnosis.effects.iter().map(found).collect(),
        power: diagnosis.power.clone(),
    })
}

fn of_diagnosis(diagnosis: Diagnosis) -> Results {
    let mut numbers = Vec::new();
    for effect in diagnosis.effects {
        let of_link = if let [joint] = &effect.joints[..] { Some(joint.clone()) } else { None };
        for (parameter, told) in &effect.parameters {
            let estimates = match told {
                Parameter::Single(one) => vec![(of_link.clone(), one)],
                Parameter::PerJoint(map) => map.iter().map(|(joint, one)| (Some(joint.clone()), one)).collect(),
            };
            for (joint, one) in estimates {
                let [low, high] = &one.ci95;
                for (((component, value), (_, low)), (_, high)) in list(&one.value).zip(list(low)).zip(list(high)) {
                    let (kind, parameter) = (effect.kind.clone(), parameter.clone());
                    let key = Key { kind, parameter, joint: joint.clone(), component };
                    let half = Some(0.5 * (high - low));
                    numbers.push((key, Told { value, half, found: true, under: None }, one.unit.clone()));
                }
            }
        }
    }
    Results { robot: diagnosis.robot, numbers, power: diagnosis.power }
}

fn of_corrected(corrected: &Corrected) -> Results {
    let mut numbers = Vec::new();
    for law in corrected.effects.iter().map(Effect::law) {
        let of_link = if let [joint] = &law.joints()[..] { Some(joint.clone()) } else { None };
        for value in law.parameters() {
            for (i, number) in value.value.iter().enumerate() {
                let key = Key {
                    kind: law.kind().name().to_owned(),
                    parameter: value.name.to_owned(),
                    joint: value.joint.clone().or_else(|| of_link.clone()),
                    component: (value.value.len() > 1).then_some(i),
                };
                numbers.push((
                    key,
                    Told { value: *number, half: None, found: true, under: None },
                    value.unit.to_owned(),
                ));
            }
        }
    }
    Results { robot: corrected.robot.clone(), numbers, power: Vec::new() }
}

/// Numbers with their place in a vector.
fn list(quantity: &Quantity) -> Box<dyn Iterator<Item = (Option<usize>, f64)> + '_> {
    match quantity {
        Quantity::Scalar(one) => Box::new(std::iter::once((None, *one))),
        Quantity::Vector(many) => Box::new(many.iter().enumerate().map(|(i, x)| (Some(i), *x))),
    }
}

impl Results {
    /// The parameters that were found, with their units.
    pub fn parameters(&self) -> impl Iterator<Item = (Key, String)> + '_ {
        self.numbers.iter().map(|(key, _, unit)| (key.clone(), unit.clone()))
    }

    /// What is told of a parameter. One that was not found changes nothing, to within what the logs would have revealed: but
    /// for one whose force another effect accounts for.
    pub fn told(&self, key: &Key) -> Option<Told> {
        if let Some((_, told, _)) = self.numbers.iter().find(|(own, ..)| own == key) {
            return Some(told.clone());
        }
        let instead = |own: &Key| own.joint == key.joint && one_force(&own.kind, &key.kind);
        let same = |own: &Key| (&own.parameter, own.component) == (&key.parameter, key.component);
        if let Some((own, told, _)) = self.numbers.iter().find(|(own, ..)| instead(own) && same(own)) {
            return Some(Told { under: Some(own.kind.clone()), ..told.clone() });
        }
        if self.numbers.iter().any(|(own, ..)| instead(own)) {
            return None;
        }
        let of_joint = |power: &&Power| match &key.joint {
            Some(joint) => power.joints.contains(joint),
            None => power.joints.is_empty(),
        };
        let same = |power: &&Power| power.kind == key.kind && power.parameter == key.parameter && of_joint(power);
        // Of an elastic drive and of a limit the power is the greatest value, and none is infinite.
        let endless = matches!(key.kind.as_str(), "joint_elasticity" | "torque_saturation");
        let power = self.power.iter().filter(same).find(|_| key.component.is_none() && !endless)?;
        let neutral = if key.parameter == "gain" { 1.0 } else { 0.0 };
        Some(Told { value: neutral, half: power.size, found: false, under: None })
    }
}
