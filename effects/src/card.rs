//! What is true of a kind, whatever robot and logs: each file of the catalogue states it of its own.

use crate::candidate::{EncoderSide, Range};
use crate::kind::Kind;

/// All that is true of a kind. Code outside the catalogue asks the card and never which kind it is.
#[derive(Debug, Clone, Copy)]
pub struct Card {
    /// Its name in words.
    pub words: &'static str,
    /// What the real robot does that the model does not, in one clause.
    pub meaning: &'static str,
    /// How usual it is.
    pub part: Part,
    /// Where a robot can have it.
    pub place: Place,
    /// What of it no fit of coefficients finds.
    pub knob: Option<Knob>,
    /// The force that it accounts for: a joint has one account of it.
    pub force: Option<Force>,
    /// How late the effort acts, where it says so.
    pub late: Option<Late>,
    /// Other kinds that it cannot stand beside at the same joints.
    pub excludes: &'static [Kind],
    /// Whether it is looked for only in the place of all that was found at its joint beyond calibration: a law outside the catalogue
    /// that bends to nearly any torque of a position would take what others leave.
    pub only_instead: bool,
    /// What is asked for as its least size that logs would have shown.
    pub size: Size,
    /// What its curve is drawn over.
    pub axis: Axis,
    /// What tells it apart from another kind where no motion does.
    pub apart: Apart,
    /// What sampling, integration and the law itself leave of any of its parameters, as a part of it; no number of rows
    /// averages that out.
    pub exact_to: f64,
    /// The same of a time, in samples of the log.
    pub exact_to_samples: f64,
    /// Whether its torque bends with its own parameters or with those of others.
    pub bends: bool,
    /// Whether its columns hang on what else was found: the torque that loads the gears or that the motion takes, the gain and
    /// bias of a drive, or what the joints carry.
    pub reads_found: bool,
    /// Whether it changes the effort before it acts. It is told by the torque that the motion takes.
    pub on_effort: bool,
    /// What stands between its torque and the effort that is logged.
    pub behind: Behind,
    /// How its motor turns on its own.
    pub turning: Option<Turning>,
    /// Whether it is the inertia of a motor, which then turns on its own.
    pub rotor: bool,
    /// Whether its coefficients are the ten inertial parameters of a body on a link.
    pub body: bool,
    /// Whether the robot's description states it, with a spread. It stays where logs do not determine it, and it is off at one
    /// place or at all: some places and not others are unlikely.
    pub described: bool,
    /// Whether what all such kinds leave says what a row counts.
    pub weighs: bool,
    /// Whether it is so common that a look for pushes from outside takes it into account.
    pub common: bool,
    /// How something outside pushes: it is of one log alone, at the times that the log shows.
    pub pushes: Option<Pushes>,
    /// Whether its coefficient is one wherever its knob is known.
    pub unit_coefficient: bool,
    /// Whether it is the same law where one of its coefficients is nothing.
    pub optional_parts: bool,
    /// The kind that takes its place where a joint bears more at rest than this one holds.
    pub sticks_as: Option<Kind>,
    /// What rests tell of it that motion does not.
    pub rests: Option<Rests>,
}

/// How usual a kind is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Part {
    /// A little off on every used robot.
    Calibration,
    /// What an owner looks for.
    Further,
    /// What a servo can have against the drive that was given. It acts on set points.
    Servo,
    /// A law that the catalogue does not have: what its effects are held against.
    Outside,
}

/// What stands between the torque of a law and the effort that is logged: by it a newton metre more of the law takes more or less
/// than one of the effort.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Behind {
    /// A gear, whose friction may rise with the load, and a drive with its gain.
    Gear,
    /// A drive with its gain.
    Drive,
    /// Nothing: its columns are of the logged effort.
    Nothing,
}

/// Where a robot can have a kind.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Place {
    /// At each joint.
    Joint,
    /// On each link at the end of a chain.
    Leaf,
    /// On each link, by the joint that moves it.
    Link,
    /// Once for the whole robot.
    Robot,
    /// At each joint together with its parent.
    Pair,
}

/// Effort that acts late, and what tells two such laws apart.
#[derive(Debug, Clone, Copy)]
pub struct Late {
    /// What passes a signal on: its samples, how late, and the time from sample to sample, both s.
    pub passes: fn(&[f64], f64, f64) -> Vec<f64>,
    /// Nats, at most, by which the size of what two such laws leave speaks for one of them: noise is in it, and turns the balance
    /// at best.
    pub hint: f64,
    /// Part of its square that noise may have of the torque by which they are told apart: a servo answers to the noise of the
    /// position, and that answer is in what is left as well.
    pub noise_in_instrument: f64,
    /// A servo's answer to the noise of the position, over the torque that this noise makes of the motion: up to so many times,
    /// as standard deviation of what it may do to what tells them apart. Measured: 8 to 19.
    pub servo_answers: f64,
}

impl Late {
    /// A law that a log of a servo tells from another.
    pub(crate) const fn told(passes: fn(&[f64], f64, f64) -> Vec<f64>) -> Late {
        Late { passes, hint: 1.0, noise_in_instrument: 0.01, servo_answers: 10.0 }
    }
}

/// What pushes from outside.
#[derive(Debug, Clone, Copy)]
pub struct Pushes {
    /// What stands out for longer than this part of the logs is no push.
    pub longest: f64,
    /// Standard error of the part of a force that is there from which on a row says nothing of it.
    pub unclear: f64,
}

/// Friction that holds more at rest than in motion.
#[derive(Debug, Clone, Copy)]
pub struct Rests {
    /// Its parameter of sliding.
    pub sliding: &'static str,
    /// Its parameter of rest.
    pub at_rest: &'static str,
    /// Part of the logs that a joint must rest for its rests to tell: the blows of other joints would outweigh few of them.
    pub least: f64,
    /// Part of the rests that end well below the break-away torque, ...
    pub well_below: f64,
    /// ... and by so many times what the others differ, it may lie higher: a rest that ends in a moment is averaged with what
    /// comes before.
    pub spreads: f64,
}

/// A force that several kinds account for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Force {
    /// Dry friction.
    Dry,
    /// A constant torque: a spring's rest position is a bias.
    Constant,
    /// Effort that acts late.
    Late,
}

/// A number that no coefficient is linear in.
#[derive(Debug, Clone, Copy)]
pub struct Knob {
    /// What it is, with its unit.
    pub what: &'static str,
    /// Where it is looked for.
    pub grid: Grid,
    /// How it is turned to where it fits best.
    pub turned: Turned,
}

/// Values of a knob that are tried first.
#[derive(Debug, Clone, Copy)]
pub enum Grid {
    /// The same on every robot.
    Fixed(fn() -> Vec<f64>),
    /// From what the joint does in the logs.
    OfJoint(fn(&Range) -> Vec<f64>),
    /// The same, so many that a first look leaves the best of each joint.
    Scanned(fn(&Range) -> Vec<f64>),
}

/// How a knob goes from its grid to where it fits best.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Turned {
    /// It stays: a choice.
    Not,
    /// By the tangent of its columns, and from this to that part of where it began: beyond them it is another law.
    ByTangent(f64, f64),
    /// To its own coefficient, as far as that lies between these: the columns are a secant.
    ToCoefficient(f64, f64),
}

/// A motor that turns on its own behind a spring or play. Its knob is found by simulation: a resonance, or a gap.
#[derive(Debug, Clone, Copy)]
pub struct Turning {
    /// Knobs that are tried first.
    pub first: &'static [f64],
    /// The least and the greatest knob that somebody would build and that logs could show; at their edge something else is there.
    pub possible: (f64, f64),
    /// A knob beyond this is no drive's: it would be mended before anybody logged it.
    pub widest: f64,
    /// Power of the knob's own size in which what it leaves is nearly linear: a gap, or a compliance.
    pub power: f64,
    /// Knobs among which the least that shows is looked for: the first, the last, and from one to the next.
    pub ladder: (f64, f64, f64),
    /// Encoder side on which noise drowns it, so that it is looked for through a filter as well.
    pub filtered: Option<EncoderSide>,
    /// Whether a contact is left of it where its knob is nothing.
    pub closes: bool,
    /// Whether the effort as measured says when it is crossed, and a crossing a moment early jolts all joints.
    pub jolts: bool,
    /// The parameter that is its size, with its unit on a revolute and on a prismatic joint.
    pub parameter: (&'static str, [&'static str; 2]),
}

/// What is asked for as the least size of a kind.
#[derive(Debug, Clone, Copy)]
pub enum Size {
    /// Nothing: when it is there is not known before.
    Unasked,
    /// Multiples of directions of its coefficients.
    Along(&'static [Gauge<'static>]),
    /// The mass of a point at its link's centre of mass, under this parameter.
    PointMass(&'static str),
    /// The knob itself, where it is the greater the less it does: parameter, and unit on a revolute and on a prismatic joint.
    Knob(&'static str, [&'static str; 2]),
}

/// One size of a kind, and what of it is measured.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gauge<'a> {
    /// The parameter.
    pub parameter: &'static str,
    /// Its value without the effect.
    pub nothing: f64,
    /// Coefficients of a unit.
    pub direction: &'a [f64],
    /// Whether the other coefficients may take any value beside, so that only what none of them can do counts.
    pub beside_others: bool,
}

impl Gauge<'static> {
    /// A size that is nothing without the effect.
    pub(crate) const fn along(parameter: &'static str, direction: &'static [f64]) -> Gauge<'static> {
        Gauge { parameter, nothing: 0.0, direction, beside_others: false }
    }
}

/// What a kind's curve is drawn over.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Axis {
    /// Velocity.
    Speed,
    /// Acceleration.
    Acceleration,
    /// Position.
    Position,
    /// Logged effort.
    Effort,
    /// Its own prediction: it hangs on many things.
    Prediction,
}

/// What tells a kind apart from another where no motion does: what a person can do.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Apart {
    /// Nothing of its own.
    Unknown,
    /// From any other kind; of several the one with the greatest number is told.
    By(u8, &'static str),
    /// From one kind.
    From(Kind, &'static str),
}

/// What sampling and integration leave of a parameter, as a part of it.
const EXACT_TO: f64 = 3e-3;
/// The same of friction: near rest, where simulators soften it and robots creep, no law is the law.
pub(crate) const FRICTION_EXACT_TO: f64 = 1e-2;

/// A knob that a tangent turns by five times at most.
pub(crate) const FIVEFOLD: Turned = Turned::ByTangent(0.2, 5.0);

/// The knob of a late effort.
pub(crate) const LATE: Knob = Knob {
    what: "time, s",
    grid: Grid::Fixed(|| vec![0.002, 0.006, 0.012, 0.025]),
    turned: Turned::ToCoefficient(1e-5, 0.5),
};
/// When an effort acts within its sample, loggers and simulators do not say to better than this part of a sample.
pub(crate) const LATE_EXACT_TO: f64 = 0.2;
/// Plausible time by which an effort is late, s: a standard deviation.
pub(crate) const LATE_SPREAD: f64 = 0.01;

impl Card {
    /// A card without a word: what a kind does not state of itself.
    pub(crate) const BLANK: Card = Card {
        words: "",
        meaning: "",
        part: Part::Further,
        place: Place::Joint,
        knob: None,
        force: None,
        late: None,
        excludes: &[],
        only_instead: false,
        size: Size::Unasked,
        axis: Axis::Prediction,
        apart: Apart::Unknown,
        exact_to: EXACT_TO,
        exact_to_samples: 0.0,
        bends: false,
        reads_found: false,
        on_effort: false,
        behind: Behind::Gear,
        turning: None,
        rotor: false,
        body: false,
        described: false,
        weighs: false,
        common: false,
        pushes: None,
        unit_coefficient: false,
        optional_parts: false,
        sticks_as: None,
        rests: None,
    };

    /// Whether the law filters what was measured, so that its noise comes out larger or smaller.
    pub fn filters(&self) -> bool {
        self.turning.is_some() || self.on_effort
    }

    /// Whether it is of one log alone: no other log has it.
    pub fn of_its_log(&self) -> bool {
        self.pushes.is_some()
    }

    /// Whether it says how late the effort acts.
    pub fn is_late(&self) -> bool {
        self.late.is_some()
    }

    /// Whether its knob is a choice, where it has one: it stays as it is.
    pub fn is_chosen(&self) -> bool {
        self.knob.is_some_and(|knob| knob.turned == Turned::Not)
    }

    /// How far its knob is turned by a tangent, as parts of where it began.
    pub fn turned_by_tangent(&self) -> Option<(f64, f64)> {
        match self.knob?.turned {
            Turned::ByTangent(low, high) => Some((low, high)),
            _ => None,
        }
    }
}
