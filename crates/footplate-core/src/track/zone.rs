//! Speed restrictions: zones of rail in which no part of a train may exceed a limit.

use alloc::string::String;

use crate::ids::{EdgeId, StretchId};
use crate::track::{Layout, LayoutError, MAX_NAME_CHARACTERS};
use crate::units::Speed;

/// Highest plausible limit: about eight times 200 km/h at 1:87. A higher value is in another unit, or no restriction.
pub const MAX_ZONE_LIMIT: Speed = Speed::from_mm_per_s(5_000.0);
/// Lowest limit: below the slowest speed of any train it would close the track.
pub const MIN_ZONE_LIMIT: Speed = Speed::from_mm_per_s(1.0);

/// A speed restriction.
#[derive(Debug, Clone, PartialEq)]
pub struct Zone {
    /// Its name.
    pub name: String,
    /// The speed that no part of a train in the zone may exceed.
    pub limit: Speed,
}

impl Layout {
    /// The speed restrictions, in the order of the plan.
    pub fn zones(&self) -> &[Zone] {
        &self.zones
    }

    /// The speed restriction of an edge, if it has one.
    #[inline]
    pub fn zone(&self, edge: EdgeId) -> Option<&Zone> {
        self.zones.get(*self.restricted.get(&edge.stretch())?)
    }

    /// Restricts the speed on some stretches, in both directions. A stretch is in one zone at most.
    ///
    /// # Errors
    /// The invalid name, limit or stretch of the zone.
    pub fn with_zone(
        mut self,
        zone: Zone,
        stretches: impl IntoIterator<Item = StretchId>,
    ) -> Result<Self, LayoutError> {
        let number = self.zones.len();
        let Zone { name, limit } = &zone;
        let is_name = (1..=MAX_NAME_CHARACTERS).contains(&name.chars().count())
            && !name.chars().any(char::is_control)
            && name.trim() == name;
        if !is_name {
            return Err(LayoutError::IllegalZoneName { zone: number, name: name.clone() });
        }
        if self.zones.iter().any(|known| known.name == *name) {
            return Err(LayoutError::DuplicateZone { zone: number, name: name.clone() });
        }
        // NaN is not within the limits either.
        if !(*limit >= MIN_ZONE_LIMIT && *limit <= MAX_ZONE_LIMIT) {
            return Err(LayoutError::IllegalZoneLimit { zone: number, found: *limit });
        }
        let count = self.stretch_count();
        let mut is_empty = true;
        for stretch in stretches.into_iter().filter(|stretch| usize::from(stretch.0) < count) {
            is_empty = false;
            let first = self.restricted.insert(stretch, number).filter(|first| *first != number);
            if let Some(first) = first.and_then(|first| self.zones.get(first)) {
                let [first, second] = [first, &zone].map(|zone| zone.name.clone());
                return Err(LayoutError::RestrictedTwice { zone: number, first, second });
            }
        }
        if is_empty {
            return Err(LayoutError::ZoneWithoutEdges { zone: number, name: name.clone() });
        }
        self.zones.push(zone);
        Ok(self)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ids::NodeId;
    use crate::track::PlanEntry;
    use crate::track::example::oval;
    use std::string::ToString;
    use std::vec::Vec;

    fn zone(name: &str, mm_s: f64) -> Zone {
        Zone { name: name.into(), limit: Speed::from_mm_per_s(mm_s) }
    }

    fn edge(layout: &Layout, from: &str, to: &str) -> EdgeId {
        let node = |name: &str| -> NodeId { layout.node_named(name).unwrap() };
        layout.edge_between(node(from), node(to)).unwrap()
    }

    #[test]
    fn a_zone_restricts_its_stretches_in_both_directions() {
        let plain = oval();
        let (siding, neck) = (edge(&plain, "BR1", "C1"), edge(&plain, "A1", "BR1"));
        let layout = plain
            .with_zone(zone("siding", 150.0), [siding.stretch()])
            .and_then(|layout| layout.with_zone(zone("neck", 200.0), [neck.stretch()]))
            .unwrap();
        let limit = |edge| layout.zone(edge).map(|zone| zone.limit.as_mm_per_s());
        assert_eq!([siding, neck.twin()].map(limit), [Some(150.0), Some(200.0)]);
        assert_eq!(limit(edge(&layout, "D1", "A1")), None);
        assert_eq!(layout.zone(siding.twin()).unwrap().name, "siding");
        assert_eq!(
            layout.zones().iter().map(|zone| zone.name.as_str()).collect::<Vec<_>>(),
            ["siding", "neck"]
        );
    }

    #[test]
    fn the_error_for_a_zone_names_its_fault() {
        let restricted = || oval().with_zone(zone("siding", 150.0), [StretchId(2)]).unwrap();
        let refusal = |wrong: Zone, stretches: &[u16]| {
            let stretches = stretches.iter().copied().map(StretchId);
            let error = restricted().with_zone(wrong, stretches).unwrap_err();
            assert_eq!(error.entry(), PlanEntry::Zone(1));
            error.to_string()
        };
        for name in ["", " neck", "a\nb", &"x".repeat(MAX_NAME_CHARACTERS + 1)] {
            assert!(refusal(zone(name, 100.0), &[0]).ends_with("is not 1 to 32 characters on one line"));
        }
        assert_eq!(
            refusal(zone("siding", 100.0), &[0]),
            "there is a zone `siding` already; every zone needs its own name"
        );
        for (limit, text) in [(0.0, "0"), (-3.0, "-3"), (9_000.0, "9000"), (f64::NAN, "NaN")] {
            let expected = std::format!(
                "a limit of {text} mm/s is not between 1 and 5000 mm/s (is it in millimetres a second?)"
            );
            assert_eq!(refusal(zone("neck", limit), &[0]), expected);
        }
        assert_eq!(
            refusal(zone("neck", 100.0), &[0, 2]),
            "an edge is in zone `siding` and in zone `neck`; each edge is in one at most"
        );
        let nothing = "no edge is in zone `neck`: write `zone = \"neck\"` on the edges it restricts";
        assert_eq!(refusal(zone("neck", 100.0), &[]), nothing);
        assert_eq!(refusal(zone("neck", 100.0), &[999]), nothing);
    }
}
