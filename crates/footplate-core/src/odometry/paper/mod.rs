//! The published algorithm, preset `paper`: federated filters with information shares, and a virtual sensor while both
//! wheelsets slip.

mod covariance;
mod current_statistical;
mod federated_filter;
mod local_filter;
mod manoeuvre;
mod motion_step;
mod published;
mod published_flags;
mod sharing;
mod virtual_sensor;

pub use covariance::Covariance;
pub use current_statistical::CurrentStatistical;
pub use federated_filter::{FederatedFilter, Fusion};
pub use local_filter::{Innovation, LocalFilter, MeasuredSpeed};
pub use manoeuvre::{ErrorGrowth, Liveliness, Manoeuvre, ManoeuvreSettings};
pub use motion_step::MotionStep;
pub(in crate::odometry) use published::Published;
pub use published_flags::Reading;
pub use sharing::Sharing;
