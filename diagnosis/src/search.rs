//! Which account of the logs is likeliest.

pub mod chance;
pub mod choose;
pub mod chosen;
pub mod climb;
pub mod contact;
pub mod converge;
pub mod drive;
pub mod first;
pub mod held_back;
pub mod late;
pub mod limits;
pub mod needed;
pub mod noise;
pub mod odds;
pub mod pushes;
pub mod rivals;
pub mod screen;
pub mod sticking;
pub mod unbent;
