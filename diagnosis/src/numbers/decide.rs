//! The numbers that decide an answer. Grids, tolerances and limits of loops stand where they are used; what is true of one
//! kind of effect stands on its card.

// What a kind must bring.

/// Nats of twenty to one. A kind beyond calibration must bring as much, as about one arm in twenty has it; a rival that is less
/// likely by no more is a tie; an effect that is likelier than none by as much is called seen.
pub const TWENTY_TO_ONE: f64 = 3.0;

/// Nats that a law outside the catalogue must bring: it is to be rarer than any effect.
pub const PRICE_OF_OUTSIDE: f64 = 5.0;

/// Nats against some links being off while others are right: one may have been wrong in the URDF, or all are a little.
pub const PRICE_OF_SOME_LINKS: f64 = 20.0;

/// Nats that a spring or play must bring beside its rotor: as rare as any kind, on either side of the gear, a knob that the
/// logs know to a twentieth of its range, and what the best of some hundred tries finds in noise.
pub const PRICE_OF_TURNING: f64 = 3.0 + 0.7 + 3.0 + 9.0;

/// Part of a joint's effort by which a kind must move it, beside all that the others could do instead: no drive's torque is
/// known to better.
pub const MATERIAL: f64 = 0.003;

/// Nats that the logs lose where something is missed: what comes in its place must explain as much.
pub const MISSED: f64 = 20.0;

/// A kind without which the logs are less likely by no more than this, nats, is looked at again: what was chosen around it
/// may have been chosen because of it.
pub const DOUBTFUL: f64 = 60.0;

// What noise does.

/// Standard deviations up to which what is left is noise (Huber 1964): rows beyond count less, and so does what is borne at
/// rest.
pub const OUTLIER: f64 = 3.0;

/// Beyond this multiple of that, the weight of a row falls with the square.
pub const FAR_OUT: f64 = 2.0;

/// Degrees of freedom of what is left: so heavy are its tails that neither a glitch nor a blow decides.
pub const FREEDOM: f64 = 4.0;

/// No law is exact to better than this part of the torque that it explains.
pub const LAW_EXACT_TO: f64 = 0.003;

/// Part of a joint's effort that is nobody's concern: what sampling and integration leave.
pub const UNNOTICED: f64 = 1e-3;

/// Part of a joint's effort that the gap is taken for, at least, where coefficients are given their spread by it.
pub const LEAST_GAP: f64 = 0.01;

/// What the divergence of a link from the URDF counts, nats: so little that it moves what logs determine by nothing, enough
/// that what they do not determine stays a body.
pub const BODIES_PULL: f64 = 0.01;

/// What a law makes of noise is known to this part: how much of it is the position's and how much the effort's, how white.
pub const FILTER_KNOWN_TO: f64 = 0.15;

/// No drive is a delay or a lag exactly: standard error, at least, of the part of their difference that is left.
pub const LATE_KNOWN_TO: f64 = 0.15;

/// Nats, at most, by which what a delay and a lag leave speaks for one of them: noise is in it, and turns the balance at best.
pub const HINT: f64 = 1.0;

/// Part of its square that noise may have of the torque by which a delay is told from a lag: a servo answers to the noise of
/// the position, and that answer is in what is left as well.
pub const NOISE_IN_INSTRUMENT: f64 = 0.01;

/// A servo's answer to the noise of the position, over the torque that this noise makes of the motion: up to so many times, as
/// standard deviation of what it may do to the part of the difference between a delay and a lag. Measured: 8 to 19.
pub const SERVO_ANSWERS: f64 = 10.0;

/// A torque this many times its noise is no artefact of it: a limit of a drive may cut it.
pub const CLEAR_OF_NOISE: f64 = 8.0;

// Motors that turn on their own.

/// What is left of a joint is more than noise from this multiple of its floor on: its drive is worth a look.
pub const WORTH_A_LOOK: f64 = 1.3;

/// A drive is not rigid where over the blocks of time that tell, the logarithm of what an account of it leaves is less by so
/// many standard errors (a burst of chatter is one block, and counts no more than its logarithm), ...
pub const NOT_RIGID: f64 = 1.0;

/// ... and this part of the mean square, or less.
pub const NOT_RIGID_LEAVES: f64 = 0.85;

/// Part of the noise below which what is left of a block of time is as good as nothing: play may show in few of them.
pub const BLOCK_OF_NOISE: f64 = 0.25;

/// So many blocks of time must show something at all: a joint that its load holds on one side may cross its play once or twice.
pub const BLOCKS_THAT_TELL: usize = 2;

/// A rotor lighter than this part of what it turns would not show.
pub const LIGHTEST_ROTOR: f64 = 0.05;

/// Standard errors from a rigid drive up to which the drive may be rigid: what the best of the hundred tries at each joint
/// finds in noise, and what [`PRICE_OF_TURNING`] asks before any log is seen, k²/2 = 13 nats.
pub const MAY_BE_RIGID: f64 = 5.0;

// Pushes and rests.

/// A row stands out if the rest, over the spread of the calm half of all rows, has this root mean square over the joints.
pub const STANDS_OUT: f64 = 5.0;

/// What stands out for longer than this part of the logs is no incident.
pub const NO_INCIDENT: f64 = 0.6;

/// Standard error of the part of a force that is there from which on a row says nothing of it.
pub const UNCLEAR: f64 = 0.25;

/// Part of a fold that a joint must rest for its rests to tell: the blows of other joints would outweigh few of them.
pub const RESTS: f64 = 0.1;

// What to say.

/// Fewer rows than this tell nothing.
pub const LEAST_ROWS: usize = 50;

/// A gap under this multiple of the noise floor is noise, as far as the estimate of the floor can tell.
pub const NEAR_FLOOR: f64 = 1.5;

/// A gap under this part of the effort's variation is nobody's concern.
pub const IMMATERIAL_GAP: f64 = 0.01;

/// A gap over this part of the effort's variation matters, however much larger it was before.
pub const MATERIAL_GAP: f64 = 0.1;

/// Effects explain the gap if they leave less than this part of its square above the floor: about a twentieth of the gap.
pub const EXPLAINED: f64 = 0.003;

/// One joint alone leaves more than noise at this multiple of its floor: any of them may, by chance or by what smoothing makes
/// of a law, ...
pub const ALONE: f64 = 3.0;

/// ... and this part of its effort: the torque of one drive is hardly known to better than half of that.
pub const ALONE_GAP: f64 = 0.02;

/// A network predicts less of noise than this part of its square, held out: what it predicts of noise by chance, several times.
pub const PREDICTED: f64 = 0.05;

/// Spread of the mean squares of seconds over what noise of the same correlation has. Of a minute it is 1 ± 0.2; a spot that
/// rubs, chatter and the edges of friction have 4 to 10.
pub const UNEVEN: f64 = 2.0;

/// Rows that noise is correlated over, at most, as squares: 0.4 s at the usual cut-off. Drift is remembered longer.
pub const REMEMBERED: f64 = 10.0;

/// A gap below this multiple of the floor is at the floor: below one, because the floor is an estimate itself.
pub const AT_FLOOR: f64 = 0.8;

/// A rival as likely as this is named beside the choice.
pub const WORTH_NAMING: f64 = 0.01;

/// Power of the explained part of the gap by which confidence falls: what leaves much of the gap may be the nearest thing
/// that the catalogue has to a cause that it has not.
pub const MISFIT: i32 = 4;

/// Effects that are there, of those named beside a rest so large that nothing speaks for them, and of those named beyond
/// doubt, measured on withheld cases: laws that nobody has thought of look like those in the catalogue at times.
pub const THERE: (f64, f64) = (0.45, 0.98);

/// Confidence of an effect that a fault of the data would explain as well: it could be.
pub const COULD_BE: f64 = 0.45;

/// Logs determine a sum of bodies whose interval is narrower than this part of the one that it had before them.
pub const DETERMINED: f64 = 0.5;

/// Accounts that lie fewer standard errors apart than this may still be confused.
pub const SEPARATED: f64 = 6.0;
