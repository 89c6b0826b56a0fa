//! The address of a 6050 or 6051: `marklin-serial:DEVICE` or `marklin-serial:tcp://HOST:PORT`, with
//! `[?pace=careful&cts=no&modules=5&speed=20]`.

use super::parameters::{number, times};
use super::port::Port;

pub(super) const SERIAL: &str = "marklin-serial:";
/// The port that a served simulated 6051 is written with in examples.
const EXAMPLE_PORT: u16 = 2400;

/// A 6050 or 6051.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct SerialAddress {
    /// Where it is.
    pub(crate) port: Port,
    /// The pace without its hand-shake line; if left out, the hand-shake line sets it where there is one.
    pub(crate) pace: Option<PaceChoice>,
    /// Whether to use its hand-shake line; if left out, where it can be read.
    pub(crate) cts: Option<bool>,
    /// S88 modules on its bus; if left out, as many as the layout's sensors need.
    pub(crate) modules: Option<u8>,
    /// How many times faster than real time it runs; 1 for a real station.
    pub(crate) speed: f64,
}

/// The gaps that are left without a hand-shake.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum PaceChoice {
    /// Long gaps, which suit every interface.
    Careful,
    /// Short gaps, for a fast interface or adapter.
    Fast,
}

impl SerialAddress {
    pub(super) fn of(port: &str) -> Result<Self, String> {
        let port = Port::named(SERIAL, port, "/dev/ttyUSB0", EXAMPLE_PORT)?;
        Ok(Self { port, pace: None, cts: None, modules: None, speed: 1.0 })
    }

    pub(super) fn set(&mut self, key: &str, value: &str) -> Result<(), String> {
        match (key, value) {
            ("pace", "careful") => self.pace = Some(PaceChoice::Careful),
            ("pace", "fast") => self.pace = Some(PaceChoice::Fast),
            ("pace", _) => return Err(format!("`{value}` is not a pace: use pace=careful or pace=fast")),
            ("cts", "yes") => self.cts = Some(true),
            ("cts", "no") => self.cts = Some(false),
            ("cts", _) => return Err(format!("`{value}` is not a value of cts: use cts=yes or cts=no")),
            ("modules", _) => {
                let modules: u8 = number(key, value, "5")?;
                if !(1..=31).contains(&modules) {
                    return Err(format!("{modules} sensor modules; the bus has 1 to 31"));
                }
                self.modules = Some(modules);
            }
            ("speed", _) => self.speed = times(value)?,
            _ => {
                return Err(format!("a serial link has no `{key}`; it has pace, cts, modules and speed"));
            }
        }
        Ok(())
    }
}
