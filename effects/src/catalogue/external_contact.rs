//! An outside force for some of the time.
//!
//! M q̈ + C q̇ + g = τ + Jᵀ F inside the intervals, J the Jacobian of the point of the link at which the force acts. Where
//! that is nobody knows to a centimetre, nor where the centre of mass of a used link is.
//! Source: Siciliano et al., Robotics: Modelling, Planning and Control (2009), section 7.2 (contact forces in joint space).

use crate::card::{Apart, Card, Place, Pushes};
use crate::law::{Law, Listed, Signature, Value, check};
use crate::plant::Contact;
use crate::{Candidate, Column, EffectError, Kind, Motion, Plant};
use gapscope_dynamics::{Data, Model};
use glam::DVec3;
use nalgebra::DMatrix;
use serde::{Deserialize, Serialize};

/// A constant force on a link during some intervals.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ExternalContact {
    /// The link, by the name of its URDF link or of the joint that moves it.
    pub link: String,
    /// From and to, s since the start of the episode.
    pub intervals: Vec<[f64; 2]>,
    /// N, in the world frame.
    pub force: [f64; 3],
    /// Where the force acts, m from the centre of mass of the link as the model describes it, along the axes of the link's frame.
    #[serde(default, skip_serializing_if = "is_nothing")]
    pub offset: [f64; 3],
}

/// Standard deviation that an offset has before any log is seen, m.
const OFFSET_SPREAD: f64 = 0.02;

fn is_nothing(offset: &[f64; 3]) -> bool {
    *offset == [0.0; 3]
}

impl Law for ExternalContact {
    fn kind(&self) -> Kind {
        Kind::ExternalContact
    }

    fn joints(&self) -> Vec<String> {
        Vec::new()
    }

    fn parameters(&self) -> Vec<Value> {
        let value = |name, value, unit| Value { name, joint: None, value, unit, unit_prismatic: unit };
        let mut values =
            vec![value("intervals", self.intervals.concat(), "s"), value("force", self.force.to_vec(), "N")];
        if !is_nothing(&self.offset) {
            values.push(value("offset", self.offset.to_vec(), "m"));
        }
        values
    }

    fn install(&self, plant: &mut Plant) -> Result<(), EffectError> {
        for (name, values) in [("force", self.force), ("offset", self.offset)] {
            for value in values {
                check(self.kind(), name, value, true, "a finite number")?;
            }
        }
        for &[from, to] in &self.intervals {
            check(self.kind(), "intervals", from, true, "a finite number")?;
            check(self.kind(), "intervals", to, to >= from, "no less than where the interval begins")?;
        }
        let named = plant.model().joints().iter().position(|joint| joint.link == self.link);
        let link = named.map_or_else(|| plant.joint(self.kind(), &self.link), Ok)?;
        plant.contacts.push(Contact {
            link,
            force: DVec3::from_array(self.force),
            point: plant.centers[link] + DVec3::from_array(self.offset),
            intervals: self.intervals.clone(),
        });
        Ok(())
    }
}

impl Signature for ExternalContact {
    const CARD: Card = Card {
        words: "external contact",
        meaning: "an outside force for some of the time",
        place: Place::Leaf,
        apart: Apart::By(4, "log again with nothing touching the robot"),
        weighs: true,
        pushes: Some(Pushes { longest: 0.6, unclear: 0.25 }),
        ..Card::BLANK
    };

    fn columns(candidate: &Candidate, motion: &Motion) -> Vec<Column> {
        candidate.joint().map_or_else(Vec::new, |j| signature(motion, j, candidate.force))
    }

    fn scales(candidate: &Candidate, _model: &Model) -> Option<Vec<f64>> {
        let offset = (!is_nothing(&candidate.force)).then_some([OFFSET_SPREAD; 3]);
        Some([f64::INFINITY; 3].into_iter().chain(offset.into_iter().flatten()).collect())
    }
}

impl Listed for ExternalContact {
    fn from_coefficients(candidate: &Candidate, model: &Model, coefficients: &[f64]) -> Option<ExternalContact> {
        let (&[x, y, z], offset) = coefficients.split_first_chunk()?;
        let offset = offset.try_into().unwrap_or_default();
        let link = candidate.joints.first().map(|&j| model.joints()[j].name.clone()).unwrap_or_default();
        Some(ExternalContact { link, intervals: Vec::new(), force: [x, y, z], offset })
    }
}

/// Three columns: what a unit force along x, y and z of the world at the link's centre of mass adds while it pushes, on
/// every joint. Coefficients: the force. Where that is known about, three more: what a force adds for each metre along x, y and z
/// of the link that it acts off the centre of mass.
fn signature(motion: &Motion, link: usize, force: [f64; 3]) -> Vec<Column> {
    let n = motion.model.dof();
    let mut data = Data::new(motion.model);
    let mut jacobian = DMatrix::zeros(6, n);
    let center = motion.model.joints()[link].inertia.center_of_mass().unwrap_or_default();
    let mut q = vec![0.0; n];
    let offsets = if is_nothing(&force) { &[][..] } else { &DVec3::AXES[..] };
    let mut columns: Vec<Column> = (0..3 + offsets.len())
        .map(|_| Column {
            rows: (0..n).map(|j| (j, vec![0.0; motion.len()])).collect(),
            at_least: f64::NEG_INFINITY,
            at_most: f64::INFINITY,
        })
        .collect();
    for k in 0..motion.len() {
        let time = motion.start + k as f64 * motion.dt;
        if !motion.pushed.iter().any(|[from, to]| (*from..*to).contains(&time)) {
            continue;
        }
        (0..n).for_each(|j| q[j] = motion.q[j][k]);
        motion.model.jacobian(&mut data, &q, link, center, &mut jacobian);
        let along = |jacobian: &DMatrix<f64>, j: usize| (0..3).map(|i| jacobian[(i, j)] * force[i]).sum::<f64>();
        let at_center: Vec<f64> = (0..n).map(|j| along(&jacobian, j)).collect();
        let (forces, points) = columns.split_at_mut(3);
        for (i, column) in forces.iter_mut().enumerate() {
            for (j, row) in &mut column.rows {
                row[k] = -jacobian[(i, *j)];
            }
        }
        // The Jacobian is linear in the point.
        for (offset, column) in offsets.iter().zip(points) {
            motion.model.jacobian(&mut data, &q, link, center + *offset, &mut jacobian);
            for (j, row) in &mut column.rows {
                row[k] = at_center[*j] - along(&jacobian, *j);
            }
        }
    }
    columns
}
