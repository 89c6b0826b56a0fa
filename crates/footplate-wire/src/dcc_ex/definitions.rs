//! The turnouts that the session defines on the board for itself, because a board confirms what it does with a definition, and nothing
//! that is written to a decoder's address. It keeps definitions in memory until it is reset.

use alloc::collections::BTreeMap;

use footplate_core::TurnoutId;

use super::definition_number::number_of;
use super::outstanding::Awaited;
use super::request::Request;

/// After so many questions about definitions in a row that none answered, over a line that is clean, the firmware does not know them: it
/// refuses to define a turnout, or says nothing.
const UNANSWERED: u8 = 5;

/// After so many answers the owner of the board has defined something else: a single one may be garbled.
const FOREIGN: u8 = 3;

/// What the board has under the number of a definition.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Definition {
    /// Nothing, or what is left of a request that was garbled.
    Missing,
    Own,
    /// Its owner has defined something else there, by so many answers.
    Foreign(u8),
}

/// What is known of the definitions on the board.
#[derive(Debug, Clone, Default)]
pub(super) struct Definitions {
    known: BTreeMap<TurnoutId, Definition>,
    /// The questions since the board last showed a definition.
    unanswered: u8,
}

impl Definitions {
    /// The board was reset: it has forgotten them.
    pub(super) fn clear(&mut self) {
        *self = Self::default();
    }

    /// Whether the board knows definitions, as far as it was asked.
    const fn are_possible(&self) -> bool {
        self.unanswered < UNANSWERED
    }

    /// Whether every turnout that is known is defined or can be.
    pub(super) fn are_all_own(&self) -> bool {
        let is_foreign = |known: &Definition| *known == Definition::Foreign(FOREIGN);
        self.are_possible() && !self.known.values().any(is_foreign)
    }

    /// Returns the request that throws a turnout, or one that has to be answered before, and the answer.
    pub(super) fn throw(&self, turnout: TurnoutId, curved: bool) -> (Request, Option<Awaited>) {
        let id = number_of(turnout);
        let question = match self.known.get(&turnout) {
            Some(Definition::Own) => {
                return (Request::Turnout { id, thrown: curved }, Some(Awaited::Thrown(turnout, curved)));
            }
            _ if !self.are_possible() => return by_address(turnout, curved),
            Some(Definition::Foreign(FOREIGN)) => return by_address(turnout, curved),
            None | Some(Definition::Foreign(_)) => Request::Examine { id },
            Some(Definition::Missing) => Request::Define { id, address: turnout.0 },
        };
        (question, Some(Awaited::Definition(turnout)))
    }

    /// A request was written.
    pub(super) fn sent(&mut self, awaited: Awaited, is_noisy: bool) {
        if matches!(awaited, Awaited::Definition(_)) && !is_noisy {
            self.unanswered = self.unanswered.saturating_add(1);
        }
    }

    /// The board says what decoder output a definition throws; `None` for another kind.
    pub(super) fn heard(&mut self, turnout: TurnoutId, address: Option<u16>) {
        let known = match self.known.get(&turnout) {
            _ if address == Some(turnout.0) => Definition::Own,
            Some(Definition::Missing | Definition::Own) => Definition::Missing,
            Some(Definition::Foreign(times)) => Definition::Foreign(FOREIGN.min(times.saturating_add(1))),
            None => Definition::Foreign(1),
        };
        self.known.insert(turnout, known);
        self.unanswered = 0;
    }

    /// The board has no such definition, or refuses to make it.
    pub(super) fn missing(&mut self, turnout: TurnoutId) {
        self.known.insert(turnout, Definition::Missing);
    }

    /// The board refused to throw a turnout: it may have lost the definition.
    pub(super) fn forget(&mut self, turnout: TurnoutId) {
        self.known.remove(&turnout);
    }
}

/// Returns the request that throws a turnout without a definition; nothing answers it.
pub(super) const fn by_address(turnout: TurnoutId, curved: bool) -> (Request, Option<Awaited>) {
    (Request::Accessory { address: turnout.0, on: curved }, None)
}

/// Returns what is written behind a request, so that the board says what it has then, whether the request has changed that or not.
pub(super) fn question_after(awaited: Awaited, request: Request) -> Option<Request> {
    let (Awaited::Definition(turnout) | Awaited::Thrown(turnout, _)) = awaited else { return None };
    let question = Request::Examine { id: number_of(turnout) };
    (question != request).then_some(question)
}
