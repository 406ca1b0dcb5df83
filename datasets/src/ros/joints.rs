//! What a message says of joints.

use super::cdr::{Broken, Value, decode};
use super::definition::{self, Layout};
use crate::episode::Channel;

/// Names of the message types that are read, `package/Name`.
pub(super) const TYPES: [&str; 3] =
    ["sensor_msgs/JointState", "control_msgs/JointTrajectoryControllerState", "control_msgs/DynamicJointState"];

/// What one message says: numbers of each joint, by channel; NaN where it says nothing.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Sample {
    /// Stamp of the header, ns.
    pub stamp: i64,
    /// The joints.
    pub names: Vec<String>,
    /// A channel with one number a joint.
    pub channels: Vec<(Channel, Vec<f64>)>,
}

/// Reads messages of one type.
pub(super) struct Messages {
    name: String,
    /// Layouts that the type has had; those of the bag itself alone where it holds one.
    layouts: Vec<Layout>,
}

impl Messages {
    /// For a type, with the definition that the bag holds, if any; `None` for a type that says nothing of joints.
    pub fn new(name: &str, definition: Option<&str>) -> Option<Self> {
        let name = definition::short(name);
        if !TYPES.contains(&name.as_str()) {
            return None;
        }
        let layouts = match definition.and_then(|text| definition::layout(&name, text)) {
            Some(layout) => vec![layout],
            None => {
                let former = name.replace('/', "/Former");
                [name.as_str(), &former].into_iter().filter_map(definition::known).collect()
            }
        };
        Some(Self { name, layouts })
    }

    /// What the bytes of a message say.
    pub fn read(&self, bytes: &[u8]) -> Result<Sample, Broken> {
        let mut first = Broken::Bytes;
        for layout in &self.layouts {
            match decode(layout, bytes) {
                Ok(values) => return self.sample(&Fields { layout, values: &values }).ok_or(Broken::Bytes),
                Err(broken) => first = broken,
            }
        }
        Err(first)
    }

    fn sample(&self, message: &Fields) -> Option<Sample> {
        let stamp = message.message("header")?.message("stamp")?;
        let seconds = stamp.numbers("sec")?.first().copied()?;
        let nanoseconds = stamp.numbers("nanosec").or_else(|| stamp.numbers("nsec"))?.first().copied()?;
        let stamp = (seconds as i64).saturating_mul(1_000_000_000).saturating_add(nanoseconds as i64);
        let mut sample = Sample { stamp, ..Sample::default() };
        let mut add = |channel: Channel, numbers: Option<&[f64]>| {
            if let Some(numbers) = numbers.filter(|numbers| !numbers.is_empty()) {
                sample.channels.push((channel, numbers.to_vec()));
            }
        };
        match self.name.as_str() {
            "sensor_msgs/JointState" => {
                add(Channel::Position, message.numbers("position"));
                add(Channel::Velocity, message.numbers("velocity"));
                add(Channel::Effort, message.numbers("effort"));
                sample.names = message.texts("name")?.to_vec();
            }
            "control_msgs/JointTrajectoryControllerState" => {
                let measured = message.message("feedback").or_else(|| message.message("actual"))?;
                let wanted = message.message("reference").or_else(|| message.message("desired"));
                let output = message.message("output");
                let effort = measured.numbers("effort").filter(|effort| !effort.is_empty());
                add(Channel::Position, measured.numbers("positions"));
                add(Channel::Velocity, measured.numbers("velocities"));
                add(Channel::Effort, effort.or_else(|| output.as_ref()?.numbers("effort")));
                add(Channel::Command, wanted.as_ref().and_then(|wanted| wanted.numbers("positions")));
                sample.names = message.texts("joint_names")?.to_vec();
            }
            _ => {
                sample.names = message.texts("joint_names")?.to_vec();
                let Some(Value::Messages(all)) = message.field("interface_values") else { return None };
                if all.len() != sample.names.len() {
                    return None;
                }
                for (joint, values) in all.iter().enumerate() {
                    let [Value::Texts(names), Value::Numbers(numbers)] = values.as_slice() else { return None };
                    for (name, number) in names.iter().zip(numbers) {
                        let Some(channel) = Channel::from_name(name) else { continue };
                        let at = match sample.channels.iter().position(|(known, _)| *known == channel) {
                            Some(at) => at,
                            None => {
                                sample.channels.push((channel, vec![f64::NAN; sample.names.len()]));
                                sample.channels.len() - 1
                            }
                        };
                        sample.channels[at].1[joint] = *number;
                    }
                }
            }
        }
        let joints = sample.names.len();
        sample.channels.iter().all(|(_, numbers)| numbers.len() == joints).then_some(sample)
    }
}

/// A message's fields by name.
struct Fields<'a> {
    layout: &'a Layout,
    values: &'a [Value],
}

impl<'a> Fields<'a> {
    fn field(&self, name: &str) -> Option<&'a Value> {
        self.values.get(self.layout.0.iter().position(|(field, ..)| field == name)?)
    }

    fn numbers(&self, name: &str) -> Option<&'a [f64]> {
        match self.field(name)? {
            Value::Numbers(numbers) => Some(numbers),
            _ => None,
        }
    }

    fn texts(&self, name: &str) -> Option<&'a [String]> {
        match self.field(name)? {
            Value::Texts(texts) => Some(texts),
            _ => None,
        }
    }

    fn message(&self, name: &str) -> Option<Fields<'a>> {
        let (_, kind, _) = self.layout.0.iter().find(|(field, ..)| field == name)?;
        match (kind, self.field(name)?) {
            (definition::Kind::Message(layout), Value::Messages(messages)) => {
                Some(Fields { layout, values: messages.first()? })
            }
            _ => None,
        }
    }
}
