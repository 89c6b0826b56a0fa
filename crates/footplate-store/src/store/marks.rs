//! Marks on events: a person excludes or restores an event, with a reason and a date.

use footplate_core::Timestamp;
use rusqlite::types::{FromSql, FromSqlError, FromSqlResult, ToSql, ToSqlOutput, ValueRef};
use rusqlite::{OptionalExtension, Transaction};

use super::checksum;
use super::error::StoreError;
use super::file::Store;
use super::keys::EventKey;

/// A mark on an event.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Mark {
    /// The event.
    pub event: EventKey,
    /// Excluded or restored.
    pub kind: MarkKind,
    /// Why.
    pub reason: String,
    /// When.
    pub made_at: Timestamp,
}

/// The effect of a mark.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MarkKind {
    /// Later calibrations do not use the event.
    Excluded,
    /// Later calibrations use it again.
    Restored,
}

impl MarkKind {
    const fn name(self) -> &'static str {
        match self {
            Self::Excluded => "exclude",
            Self::Restored => "restore",
        }
    }
}

impl FromSql for MarkKind {
    fn column_result(value: ValueRef<'_>) -> FromSqlResult<Self> {
        match value.as_str()? {
            "exclude" => Ok(Self::Excluded),
            "restore" => Ok(Self::Restored),
            _ => Err(FromSqlError::InvalidType),
        }
    }
}

impl ToSql for MarkKind {
    fn to_sql(&self) -> rusqlite::Result<ToSqlOutput<'_>> {
        Ok(self.name().into())
    }
}

impl Store {
    /// Excludes events from later calibrations: all of them, or none if one cannot be excluded.
    pub fn exclude(&mut self, events: &[EventKey], reason: &str, now: Timestamp) -> Result<(), StoreError> {
        self.mark(events, MarkKind::Excluded, reason, now)
    }

    /// Restores excluded events: all of them, or none if one cannot be restored.
    pub fn restore(&mut self, events: &[EventKey], reason: &str, now: Timestamp) -> Result<(), StoreError> {
        self.mark(events, MarkKind::Restored, reason, now)
    }

    fn mark(
        &mut self,
        events: &[EventKey],
        kind: MarkKind,
        reason: &str,
        now: Timestamp,
    ) -> Result<(), StoreError> {
        let reason = reason.trim();
        if reason.is_empty() {
            return Err(StoreError::NoReason);
        }
        let path = self.path().to_owned();
        let error = |source| StoreError::of(&path, source);
        let transaction = self.write()?;
        for event in events {
            if let Some(objection) = objection(&transaction, *event, kind).map_err(error)? {
                return Err(objection);
            }
            let columns = ["event", "mark", "reason", "made_at_ns"];
            checksum::append(&transaction, "marks", &columns, &[&event.0, &kind, &reason, &now.as_ns()])
                .map_err(error)?;
        }
        transaction.commit().map_err(error)
    }
}

/// The reason why an event cannot have a mark; `None` if it can.
fn objection(
    transaction: &Transaction<'_>,
    event: EventKey,
    kind: MarkKind,
) -> rusqlite::Result<Option<StoreError>> {
    let known = transaction.prepare_cached("SELECT 1 FROM events WHERE id = ?1")?.exists([event.0])?;
    if !known {
        return Ok(Some(StoreError::NoEvent(event)));
    }
    let newest = transaction
        .prepare_cached("SELECT mark, reason FROM marks WHERE event = ?1 ORDER BY id DESC LIMIT 1")?
        .query_row([event.0], |row| Ok((row.get::<_, MarkKind>(0)?, row.get(1)?)))
        .optional()?;
    Ok(match newest {
        Some((now, reason)) if now == kind => {
            Some(StoreError::MarkedAlready { event, excluded: kind == MarkKind::Excluded, reason })
        }
        None if kind == MarkKind::Restored => Some(StoreError::NeverExcluded(event)),
        _ => None,
    })
}
