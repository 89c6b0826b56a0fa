//! Schedules that the owner of a layout saved: the newest of each name counts, and all of them stay.

use footplate_core::Timestamp;
use rusqlite::Row;
use rusqlite::types::Type;
use serde::{Deserialize, Serialize};

use super::checksum;
use super::error::StoreError;
use super::file::Store;

/// A script that is saved under a name.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Schedule {
    /// Its name, one of its layout.
    pub name: String,
    /// Its lines in the syntax of the prompt.
    pub lines: Vec<String>,
    /// How often it runs; `None` until it is ended.
    #[serde(default = "once")]
    pub rounds: Option<u32>,
    /// Whether the pages show it as a button beside the track.
    #[serde(default)]
    pub is_button: bool,
}

#[expect(clippy::unnecessary_wraps, reason = "the default of an optional field")]
const fn once() -> Option<u32> {
    Some(1)
}

impl Store {
    /// Keeps a schedule of a layout as the one of its name from now on.
    pub fn keep_schedule(
        &mut self,
        layout: &str,
        schedule: &Schedule,
        now: Timestamp,
    ) -> Result<(), StoreError> {
        self.add_schedule(layout, &schedule.name, Some(schedule), now)
    }

    /// Withdraws the schedule of this name.
    pub fn withdraw_schedule(&mut self, layout: &str, name: &str, now: Timestamp) -> Result<(), StoreError> {
        self.add_schedule(layout, name, None, now)
    }

    fn add_schedule(
        &mut self,
        layout: &str,
        name: &str,
        schedule: Option<&Schedule>,
        now: Timestamp,
    ) -> Result<(), StoreError> {
        // Text and whole numbers always have a form in JSON.
        let body = schedule.and_then(|schedule| serde_json::to_string(schedule).ok());
        let columns = ["layout", "name", "stored_at_ns", "body"];
        checksum::append(&self.connection, "schedules", &columns, &[&layout, &name, &now.as_ns(), &body])
            .map_err(|error| self.error(error))
    }

    /// The schedules of a layout, by name.
    pub fn schedules(&self, layout: &str) -> Result<Vec<Schedule>, StoreError> {
        let sql = "SELECT body FROM schedules WHERE id IN \
             (SELECT max(id) FROM schedules WHERE layout = ?1 GROUP BY name) AND body IS NOT NULL ORDER BY name";
        let read = |row: &Row<'_>| {
            let body: String = row.get(0)?;
            serde_json::from_str(&body)
                .map_err(|error| rusqlite::Error::FromSqlConversionFailure(0, Type::Text, Box::new(error)))
        };
        self.rows(sql, (layout,), read)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_newest_of_a_name_counts_until_it_is_withdrawn() {
        let folder = tempfile::tempdir().expect("a folder");
        let mut store = Store::open_or_create(&folder.path().join("railway.db")).expect("a store");
        let schedule = |name: &str, line: &str| Schedule {
            name: name.to_owned(),
            lines: vec![line.to_owned()],
            rounds: None,
            is_button: false,
        };
        let at = Timestamp::from_s;
        store.keep_schedule("track-a", &schedule("evening", "wait 1s"), at(1.0)).expect("kept");
        store.keep_schedule("track-a", &schedule("evening", "wait 2s"), at(2.0)).expect("kept");
        store.keep_schedule("track-a", &schedule("depot", "wait 3s"), at(3.0)).expect("kept");
        store.keep_schedule("track-b", &schedule("evening", "wait 4s"), at(4.0)).expect("kept");
        let lines = |store: &Store| -> Vec<String> {
            store.schedules("track-a").expect("read").into_iter().flat_map(|one| one.lines).collect()
        };
        assert_eq!(lines(&store), ["wait 3s", "wait 2s"]);
        store.withdraw_schedule("track-a", "evening", at(5.0)).expect("kept");
        assert_eq!(lines(&store), ["wait 3s"]);
        store.keep_schedule("track-a", &schedule("evening", "wait 6s"), at(6.0)).expect("kept");
        assert_eq!(lines(&store), ["wait 3s", "wait 6s"]);
    }
}
