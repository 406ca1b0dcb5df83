//! Which candidates a robot offers, and what a candidate's card says of it.

use crate::candidate::{Candidate, Range};
use crate::card::{Grid, Part, Place, Turned};
use crate::kind::Kind;
use gapscope_dynamics::{JointKind, Model};

impl Place {
    /// The joints of each place where a robot can have a kind.
    fn of(self, model: &Model) -> Vec<Vec<usize>> {
        let is_leaf = |j: &usize| model.joints().iter().all(|child| child.parent != Some(*j));
        let each = 0..model.dof();
        match self {
            Place::Joint | Place::Link => each.map(|j| vec![j]).collect(),
            Place::Leaf => each.filter(is_leaf).map(|j| vec![j]).collect(),
            Place::Robot => vec![Vec::new()],
            Place::Pair => each
                .filter_map(|b| Some(vec![model.joints()[b].parent?, b]))
                .filter(|pair| {
                    // A shared drive element needs the same unit on both sides.
                    let slides = |j: usize| model.joints()[j].kind == JointKind::Prismatic;
                    slides(pair[0]) == slides(pair[1])
                })
                .collect(),
        }
    }
}

impl Candidate {
    fn at(kind: Kind, joints: Vec<usize>, shape: f64) -> Candidate {
        Candidate { shape, ..Candidate::new(kind, joints) }
    }

    /// The rotor of a joint.
    pub fn rotor(joint: usize) -> Candidate {
        Candidate::new(Kind::Armature, vec![joint])
    }

    /// Every candidate without a knob to turn that a robot offers: each kind at each joint, payloads at each leaf, couplings
    /// of each joint with its parent. A leaf's own error and a payload on it are the same ten numbers: what is plausible tells
    /// them apart.
    pub fn all(model: &Model) -> Vec<Candidate> {
        let mut all = Vec::new();
        for place in [Place::Joint, Place::Leaf, Place::Link, Place::Robot, Place::Pair] {
            for kind in Kind::ALL.into_iter().filter(|kind| kind.card().place == place) {
                let card = kind.card();
                let shapes = match card.knob.map(|knob| (knob.turned, knob.grid)) {
                    None => vec![0.0],
                    Some((Turned::Not, Grid::Fixed(choices))) => choices(),
                    Some(_) => Vec::new(),
                };
                if card.turning.is_none() && !card.of_its_log() {
                    let at = |joints: Vec<usize>| {
                        shapes.iter().map(move |&shape| Candidate::at(kind, joints.clone(), shape))
                    };
                    all.extend(place.of(model).into_iter().flat_map(at));
                }
            }
        }
        all
    }

    /// Candidates on a grid of their knob, those aside of which a first look leaves a few; `ranges` has one entry a joint.
    pub fn knobs(ranges: &[Range]) -> Vec<Candidate> {
        let turned = || {
            Kind::ALL
                .into_iter()
                .filter_map(|kind| Some((kind, kind.card().knob?)))
                .filter(|(_, knob)| knob.turned != Turned::Not)
        };
        let mut all = Vec::new();
        for (j, range) in ranges.iter().enumerate() {
            for (kind, knob) in turned() {
                if let Grid::OfJoint(grid) = knob.grid {
                    all.extend(grid(range).into_iter().map(|shape| Candidate::at(kind, vec![j], shape)));
                }
            }
        }
        for (kind, knob) in turned() {
            if let Grid::Fixed(grid) = knob.grid {
                all.extend(grid().into_iter().map(|shape| Candidate::at(kind, Vec::new(), shape)));
            }
        }
        all.retain(|c| c.shape.is_finite() && c.shape > 0.0);
        all
    }

    /// Candidates of one kind at a joint on a grid so fine that a first look leaves a few of them.
    pub fn scanned(kind: Kind, joint: usize, range: &Range) -> Vec<Candidate> {
        match kind.card().knob.map(|knob| knob.grid) {
            Some(Grid::Scanned(grid)) => {
                grid(range).into_iter().map(|shape| Candidate::at(kind, vec![joint], shape)).collect()
            }
            _ => Vec::new(),
        }
    }

    /// Laws outside the catalogue where the joints do this, those aside of which a first look leaves a few.
    pub fn outside(model: &Model, ranges: &[Range]) -> Vec<Candidate> {
        let mut all = Vec::new();
        for kind in Kind::OUTSIDE {
            let grid = kind.card().knob.map(|knob| knob.grid);
            for joints in kind.card().place.of(model) {
                let shapes = match grid {
                    None => vec![0.0],
                    Some(Grid::Fixed(grid)) => grid(),
                    Some(Grid::OfJoint(grid)) => joints.iter().flat_map(|&j| grid(&ranges[j])).collect(),
                    Some(Grid::Scanned(_)) => Vec::new(),
                };
                all.extend(shapes.into_iter().map(|shape| Candidate::at(kind, joints.clone(), shape)));
            }
        }
        all.retain(|c| c.shape.is_finite());
        all
    }

    /// What acts for some of the time at each of its places, for motions that know when.
    pub fn contacts(model: &Model) -> Vec<Candidate> {
        let kinds = Kind::ALL.into_iter().filter(|kind| kind.card().of_its_log());
        let at = |kind: Kind| kind.card().place.of(model).into_iter().map(move |joints| Candidate::new(kind, joints));
        kinds.flat_map(at).collect()
    }

    /// A signal, `dt` s from sample to sample, as a law that acts late passes it on; as it is for any other.
    pub fn passed_on(&self, signal: &[f64], dt: f64) -> Vec<f64> {
        self.kind.card().late.map_or_else(|| signal.to_vec(), |late| (late.passes)(signal, self.shape, dt))
    }

    /// Whether it is a drive that turns on its own: a spring or play.
    pub fn turns(&self) -> bool {
        self.kind.card().turning.is_some()
    }

    /// Standard errors of its knob by which a drive that turns on its own is off a rigid one: of its gap, or of the compliance,
    /// which goes with the square of its period.
    pub fn errors_from_rigid(&self) -> f64 {
        let power = self.kind.card().turning.map_or(1.0, |turning| 1.0 / turning.power.abs());
        self.shape / (power * self.knob_error)
    }

    /// The link whose ten inertial parameters the coefficients add to.
    pub fn link(&self) -> Option<usize> {
        if self.kind.card().body { self.joints.first().copied() } else { None }
    }

    /// Puts the columns of a product about a factor that was found: the leverage of a force that pushes is as great as the force.
    pub fn stand_about(&mut self, coefficients: &[f64]) {
        if let (Some(_), Some(force)) = (self.kind.card().pushes, coefficients.first_chunk())
            && self.force != [0.0; 3]
        {
            self.force = *force;
        }
    }

    /// The knob at which coefficients would put a signature that is a secant: a fit with the knob there comes nearer.
    /// `None` for kinds whose knob is no part of their coefficients.
    pub fn secant(&self, coefficients: &[f64]) -> Option<f64> {
        let (Turned::ToCoefficient(low, high), &[late]) = (self.kind.card().knob?.turned, coefficients) else {
            return None;
        };
        let next = late.clamp(low, high);
        next.is_finite().then_some(next)
    }
}

impl Kind {
    /// Whether it is calibration: bodies, friction, rotor and bias, which are a little off on every used robot.
    pub fn is_calibration(self) -> bool {
        self.card().part == Part::Calibration
    }

    /// Whether the catalogue does not have it.
    pub fn is_outside(self) -> bool {
        self.card().part == Part::Outside
    }

    /// Whether two kinds at the same joints are two accounts of the same force.
    pub fn excludes(self, other: Kind) -> bool {
        let (own, others) = (self.card(), other.card());
        self == other
            || own.force.is_some() && own.force == others.force
            || own.excludes.contains(&other)
            || others.excludes.contains(&self)
    }
}
