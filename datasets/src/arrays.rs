//! Named arrays of a file (NumPy, MATLAB, HDF5) made a recording: which of them is the time, which a quantity of all
//! joints.

use crate::channel_names;
use crate::episode::Channel;
use crate::error::{LogError, LogErrorKind};
use crate::joint_names::UNNAMED;
use crate::recording::Recording;
use crate::request::Request;

/// Most numbers that one array may hold: a day at 1 kHz of one quantity of 20 joints is 1.7e9, an hour 7.2e7.
pub(crate) const MOST_NUMBERS: u64 = 1 << 28;

/// An array of numbers, or of texts.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Array {
    /// Its name; of one in a structure or group, with those of these before it and a dot between.
    pub name: String,
    /// Lengths along its axes.
    pub shape: Vec<usize>,
    /// Numbers, last axis fastest; empty where it holds texts.
    pub values: Vec<f64>,
    /// Texts; empty where it holds numbers.
    pub texts: Vec<String>,
}

impl Array {
    /// Numbers under a name.
    pub fn numbers(name: impl Into<String>, shape: Vec<usize>, values: Vec<f64>) -> Self {
        Self { name: name.into(), shape, values, texts: Vec::new() }
    }

    /// Texts under a name.
    pub fn texts(name: impl Into<String>, texts: Vec<String>) -> Self {
        Self { name: name.into(), shape: vec![texts.len()], values: Vec::new(), texts }
    }

    /// The last part of the name.
    fn own_name(&self) -> &str {
        self.name.rsplit('.').next().unwrap_or(&self.name)
    }

    /// The shape without axes of length one.
    fn lengths(&self) -> Vec<usize> {
        self.shape.iter().copied().filter(|&length| length != 1).collect()
    }
}

/// The run that arrays of a file hold. Without a time, `rate` in Hz makes one.
pub(crate) fn recording(arrays: Vec<Array>, rate: Option<f64>, request: &Request) -> Result<Recording, LogError> {
    let mut recording = Recording::default();
    let count = samples(&arrays, request)?;
    if count == 0 {
        return Err(LogError::new(LogErrorKind::Empty, "the run holds not one sample")
            .hint("Check whether the logger ran; a log has one row per sample"));
    }
    let names = joint_names(&arrays);
    add_time(&arrays, count, rate, request, &mut recording)?;
    let held: Vec<String> = arrays.iter().map(|array| format!("{} {:?}", array.name, array.shape)).collect();
    let mut channels = Vec::new();
    let mut passed_over = Vec::new();
    let mut unfit = None;
    for array in arrays.into_iter().filter(|array| !array.values.is_empty()) {
        let (name, is_time, scalar) = (array.name.clone(), is_time(&array), array.values.len() == 1);
        let channel = channel_names::channel(array.own_name()).filter(|_| !is_time);
        let shape = array.shape.clone();
        let Some(columns) = columns(array, count) else {
            if channel == Some(Channel::Effort) && !scalar {
                unfit = unfit.or_else(|| Some((name.clone(), shape)));
            }
            passed_over.extend((!scalar).then_some(name));
            continue;
        };
        if request.by_own_names() {
            for (at, values) in columns.iter().enumerate() {
                let own = if columns.len() == 1 { name.clone() } else { format!("{name}[{at}]") };
                recording.add(own, values.clone());
            }
        }
        let Some(channel) = channel.filter(|_| !request.look) else { continue };
        if channels.contains(&channel) {
            recording.notes.push(format!("`{name}` is not read: another array is the {} already", channel.name()));
            continue;
        }
        channels.push(channel);
        for (at, values) in columns.into_iter().enumerate() {
            let joint = match &names {
                Some(names) if names.len() > at => names[at].clone(),
                _ => format!("{UNNAMED}{}", at + 1),
            };
            recording.add(format!("{}.{joint}", channel.name()), values);
        }
    }
    if names.is_none() && !channels.is_empty() {
        recording.notes.push("the file does not name its joints: they are taken in the robot's order".to_owned());
    }
    require(&channels, &held, request)?;
    // Without its effort a log is answered as one of a servo: that is no way to read an array that is cut off.
    if let Some((name, shape)) =
        unfit.filter(|_| !request.look && !request.by_own_names() && !channels.contains(&Channel::Effort))
    {
        return Err(LogError::new(
            LogErrorKind::RaggedRow,
            format!("it has the shape {shape:?}, the log {count} samples"),
        )
        .column(name)
        .hint("Give one row per sample, or leave the array out of the log"));
    }
    if !passed_over.is_empty() {
        passed_over.truncate(8);
        recording.notes.push(format!("arrays that are not read: {}", passed_over.join(", ")));
    }
    Ok(recording)
}

/// The run that arrays hold as columns named natively (`position.<joint>`), or else as whole quantities.
pub(crate) fn columns_or_whole(held: Vec<Array>, request: &Request) -> Result<Recording, LogError> {
    let native = |array: &Array| {
        array.name.split_once('.').is_some_and(|(channel, _)| Channel::from_name(channel).is_some())
            && array.shape.len() == 1
    };
    if !held.iter().any(native) {
        return recording(held, None, request);
    }
    let flat = held.into_iter().filter(|array| array.shape.len() == 1 && array.texts.is_empty());
    Ok(Recording { columns: flat.map(|array| (array.name, array.values)).collect(), ..Recording::default() })
}

/// An error where the arrays that no log can do without are missing among `held`, and no map says where they are.
fn require(channels: &[Channel], held: &[String], request: &Request) -> Result<(), LogError> {
    if request.by_own_names() {
        return Ok(());
    }
    let drives = |channel: &Channel| match request.options.without_effort {
        true => channel.drives() || *channel == Channel::EffortLink,
        false => matches!(channel, Channel::Effort | Channel::EffortLink),
    };
    let lacks = match () {
        () if !channels.contains(&Channel::Position) => Channel::Position,
        () if !channels.iter().any(drives) => Channel::Effort,
        () => return Ok(()),
    };
    if held.iter().any(|name| name.starts_with("observation.")) {
        return Err(LogError::new(LogErrorKind::MissingColumn, "this is a part of a LeRobot dataset")
            .hint("Give the dataset's folder, with meta/info.json in it; --episodes chooses"));
    }
    let what = match lacks {
        Channel::Effort if request.options.without_effort => {
            "effort of the joints, nor what stands for it (command, current, voltage)"
        }
        Channel::Effort => "effort of the joints",
        _ => "position of the joints",
    };
    let shown = held[..held.len().min(12)].join(", ");
    let joint = request.joints.first().map_or("joint1", String::as_str);
    Err(LogError::new(LogErrorKind::MissingColumn, format!("no array holds the {what}; the file holds {shown}")).hint(
        format!(
            "Name it `{0}`, of shape samples × joints, or map its columns: --map \"{0}.{joint}=<array>[0]\"",
            lacks.name()
        ),
    ))
}

fn is_time(array: &Array) -> bool {
    array.lengths().len() == 1 && channel_names::time_unit(array.own_name()).is_some()
}

/// The number of samples: that of the time, or else of the positions.
fn samples(arrays: &[Array], request: &Request) -> Result<usize, LogError> {
    if let Some(time) = arrays.iter().find(|array| is_time(array)) {
        return Ok(time.values.len());
    }
    let of_position = arrays
        .iter()
        .find(|array| channel_names::channel(array.own_name()) == Some(Channel::Position) && !array.values.is_empty());
    let length = match of_position.map(Array::lengths).as_deref() {
        Some([samples]) => Some(*samples),
        // Samples × joints, or joints × samples: there are more samples than joints.
        Some([a, b]) => Some(if *a == request.joints.len() && b > a { *b } else { *a }),
        _ => None,
    };
    // Nothing is known by its name: there are more samples than of anything else.
    let longest = || arrays.iter().filter(|array| array.texts.is_empty()).flat_map(Array::lengths).max();
    length.or_else(|| longest().filter(|_| request.by_own_names())).ok_or_else(|| {
        let names: Vec<&str> = arrays.iter().take(12).map(|array| array.name.as_str()).collect();
        LogError::new(
            LogErrorKind::MissingColumn,
            format!("no array is the time or the positions of the joints; the file holds {}", names.join(", ")),
        )
        .hint("Name them `time`, of one number a sample, and `position`, of shape samples × joints")
    })
}

/// The columns of an array with one number, or one row, a sample; joint by joint.
fn columns(array: Array, count: usize) -> Option<Vec<Vec<f64>>> {
    let lengths = array.lengths();
    let values = array.values;
    match lengths.as_slice() {
        [samples] if *samples == count => Some(vec![values]),
        [samples, width] if *samples == count => {
            Some((0..*width).map(|j| values.iter().skip(j).step_by(*width).copied().collect()).collect())
        }
        [width, samples] if *samples == count => {
            Some((0..*width).map(|j| values[j * samples..(j + 1) * samples].to_vec()).collect())
        }
        _ => None,
    }
}

fn joint_names(arrays: &[Array]) -> Option<Vec<String>> {
    let is_names = |array: &&Array| {
        let name: String = array.own_name().chars().filter(|c| c.is_alphanumeric()).collect();
        !array.texts.is_empty()
            && ["jointnames", "names", "joints", "name", "joint"].contains(&name.to_lowercase().as_str())
    };
    arrays.iter().find(is_names).map(|array| array.texts.clone())
}

fn add_time(
    arrays: &[Array],
    count: usize,
    rate: Option<f64>,
    request: &Request,
    recording: &mut Recording,
) -> Result<(), LogError> {
    if let Some(time) = arrays.iter().find(|array| is_time(array)) {
        if !request.by_own_names() {
            recording.add(time.own_name(), time.values.clone());
        }
        return Ok(());
    }
    if request.options.map.time().is_some() {
        return Ok(());
    }
    let named = arrays.iter().filter(|array| array.values.len() == 1).find_map(|array| {
        let value = array.values[0];
        channel_names::is_rate(array.own_name()).map(|is_rate| (array, if is_rate { value } else { 1.0 / value }))
    });
    let (rate, why) = match (named, rate) {
        (Some((array, rate)), _) => (rate, format!("from `{}`", array.name)),
        (None, Some(rate)) => (rate, "which such files usually have".to_owned()),
        (None, None) if request.look => return Ok(()),
        (None, None) => {
            return Err(LogError::new(LogErrorKind::MissingColumn, "no array holds the time")
                .column("time")
                .hint("Add an array `time` in seconds, or a number `rate` in Hz or `dt` in seconds"));
        }
    };
    if !(rate.is_finite() && rate > 0.0) {
        return Err(LogError::new(LogErrorKind::MissingColumn, format!("the sampling rate is {rate} Hz"))
            .hint("A rate is a positive number; add an array `time` in seconds"));
    }
    recording.notes.push(format!("has no time: made from {rate} Hz, {why}"));
    recording.add("time", (0..count).map(|sample| sample as f64 / rate).collect());
    Ok(())
}
