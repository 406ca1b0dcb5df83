//! Messages of ROS 2 about joints: their definitions, their bytes, and the run that topics of a bag hold.

mod cdr;
mod definition;
mod group;
mod joints;
mod topics;

pub(crate) use topics::Topics;
