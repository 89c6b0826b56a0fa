//! What the bytes of a line tell of its rhythm: how often sensors are asked for, and how soon the answer begins.

use footplate_core::{TimeSpan, Timestamp};
use footplate_wire::dcc_ex::{self, Framing, Reply};
use footplate_wire::marklin_serial::{BYTE_TIME, Message};
use footplate_wire::{jmri, loconet, marklin_can, z21};
use serde::Serialize;

/// Reads a line's bytes as they pass.
#[derive(Debug, Default)]
pub(crate) struct Rhythm {
    said: Vec<u8>,
    /// The last poll, and how many other messages were written since.
    request: Option<(Timestamp, usize)>,
    is_awaited: bool,
    power: Option<PowerCommand>,
    /// Whether sensors were polled after that.
    asked_since: bool,
    /// Messages from a DCC-EX board, once something was written to one.
    replies: Option<Framing>,
    /// Frames from Märklin's CAN bus, once something was written to it.
    frames: Option<marklin_can::Framing>,
    /// Lines from a LocoNet server, once something was written to one.
    lines: Option<loconet::Lines>,
    /// Messages from JMRI, once something was written to it.
    messages: Option<jmri::Lines>,
}

/// What the station was commanded last of the power, and what was heard of it since.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub(crate) struct PowerCommand {
    /// On, or off.
    is_on: bool,
    /// Whether the station has confirmed it since; of one that does not report the power: whether it has answered a poll since.
    has_answered: bool,
    /// Whether a station of this kind reports the power; a 6051 does not.
    reports_power: bool,
    /// Whether the track has power, as the station reported last since the command.
    reported: Option<bool>,
}

impl PowerCommand {
    pub(crate) const fn is_on(self) -> bool {
        self.is_on
    }
}

/// Sensors were asked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Request {
    /// Time since the poll before, and how many other messages were written between them.
    pub(crate) after: Option<(TimeSpan, usize)>,
}

impl Rhythm {
    /// Takes a byte that was written; returns the poll that it completes.
    pub(crate) fn written(&mut self, at: Timestamp, byte: u8) -> Option<Request> {
        self.said.push(byte);
        let (message, _) = Message::decode(&self.said)?;
        let is_request = !message.modules_read().is_empty();
        if let Message::Stop | Message::Go = message {
            self.commanded(message == Message::Go, false);
            self.asked_since = false;
        }
        self.said.clear();
        if !is_request {
            self.request = self.request.map(|(asked, others)| (asked, others + 1));
            return None;
        }
        let before = self.request.replace((at, 0));
        self.is_awaited = true;
        self.asked_since = true;
        Some(Request { after: before.map(|(asked, others)| (at - asked, others)) })
    }

    /// A message to a DCC-EX board was written.
    pub(crate) fn wrote_message(&mut self, text: &[u8]) {
        self.replies.get_or_insert_default();
        let mut framing = Framing::default();
        let request = text.iter().find_map(|byte| framing.push(*byte).and_then(dcc_ex::Request::read));
        if let Some(dcc_ex::Request::Power { on, .. }) = request {
            self.commanded(on, true);
        }
    }

    /// A frame for Märklin's CAN bus was written.
    pub(crate) fn wrote_frame(&mut self, bytes: &[u8]) {
        let is_text = bytes.first().is_some_and(|first| *first != 0);
        let transport =
            if is_text { marklin_can::Transport::Adapter } else { marklin_can::Transport::Network };
        self.frames.get_or_insert_with(|| marklin_can::Framing::new(transport));
        let mut framing = marklin_can::Framing::new(transport);
        let frame = bytes.iter().find_map(|byte| framing.push(*byte)).filter(|frame| !frame.is_response);
        if let Some(is_on) = frame.and_then(|frame| power_of(&frame)) {
            self.commanded(is_on, true);
        }
    }

    /// A byte was heard; if a station on Märklin's CAN bus confirms the power with it, that counts.
    pub(crate) fn heard_of_bus(&mut self, byte: u8) {
        let frame =
            self.frames.as_mut().and_then(|framing| framing.push(byte)).filter(|frame| frame.is_response);
        let confirmed = frame.and_then(|frame| power_of(&frame));
        self.reported(confirmed);
    }

    /// A datagram to a Z21 was written.
    pub(crate) fn wrote_datagram(&mut self, datagram: &[u8]) {
        for dataset in z21::Datasets::of(datagram) {
            if let Some(z21::Request::Power { on }) = z21::Request::read(&dataset) {
                self.commanded(on, true);
            }
        }
    }

    /// A datagram was heard; if a Z21 confirms the power with it, that counts.
    pub(crate) fn heard_datagram(&mut self, datagram: &[u8]) {
        for dataset in z21::Datasets::of(datagram) {
            let reply = z21::Reply::read(&dataset).ok().flatten();
            let says = |on| reply.is_some_and(|reply| reply.confirms_power(on));
            self.reported([false, true].into_iter().find(|on| says(*on)));
        }
    }

    /// A byte was heard; if a DCC-EX board confirms the power with it, that counts.
    pub(crate) fn heard_of_board(&mut self, byte: u8) {
        let Some(text) = self.replies.as_mut().and_then(|framing| framing.push(byte)) else { return };
        let confirmed = Reply::read(text).ok().flatten().and_then(|reply| reply.main_power());
        self.reported(confirmed);
    }

    /// A line was written to a LocoNet server.
    pub(crate) fn wrote_line(&mut self, text: &[u8]) {
        self.lines.get_or_insert_default();
        let mut lines = loconet::Lines::default();
        let line = text.iter().find_map(|byte| lines.push(*byte).map(loconet::Line::read));
        let is_on = match line {
            Some(Ok(loconet::Line::Send(loconet::Message::PowerOn))) => true,
            Some(Ok(loconet::Line::Send(loconet::Message::PowerOff))) => false,
            _ => return,
        };
        self.commanded(is_on, true);
    }

    /// A byte was heard; if a command station on LocoNet says in a slot that the power is as commanded, that counts.
    pub(crate) fn heard_of_server(&mut self, byte: u8) {
        let line = self.lines.as_mut().and_then(|lines| lines.push(byte)).map(loconet::Line::read);
        if let Some(Ok(loconet::Line::Receive(loconet::Message::Slot(slot)))) = line {
            self.reported(Some(slot.is_powered()));
        }
    }

    /// A request to JMRI was written.
    pub(crate) fn wrote_request(&mut self, text: &[u8]) {
        self.messages.get_or_insert_default();
        let request =
            std::str::from_utf8(text).ok().and_then(|text| jmri::Request::read(text).ok().flatten());
        if let Some(jmri::Request::Power { on, .. }) = request {
            self.commanded(on, true);
        }
    }

    /// A byte was heard; if JMRI confirms the power with it, that counts.
    pub(crate) fn heard_of_jmri(&mut self, byte: u8) {
        let reply = self.messages.as_mut().and_then(|messages| messages.push(byte)).map(jmri::Reply::read);
        if let Some(Ok(Some(jmri::Reply::Power { on, .. }))) = reply {
            self.reported(on);
        }
    }

    /// The station was commanded to switch the power.
    fn commanded(&mut self, is_on: bool, reports_power: bool) {
        self.power = Some(PowerCommand { is_on, has_answered: false, reports_power, reported: None });
    }

    /// The station has reported whether the track has power.
    fn reported(&mut self, on: Option<bool>) {
        if let Some((power, on)) = self.power.as_mut().zip(on) {
            power.reported = Some(on);
            power.has_answered |= on == power.is_on;
        }
    }

    /// The last power command, and whether the station has confirmed it.
    pub(crate) const fn power(&self) -> Option<PowerCommand> {
        self.power
    }

    /// Takes a byte from the station; if it is the first of a reply, returns the time since the last bit of its poll.
    pub(crate) fn heard(&mut self, at: Timestamp) -> Option<TimeSpan> {
        let (asked, _) = self.request.filter(|_| std::mem::take(&mut self.is_awaited))?;
        if let Some(power) = &mut self.power
            && self.asked_since
        {
            power.has_answered = true;
        }
        Some(at - (asked + BYTE_TIME))
    }
}

/// What a frame says of the power.
fn power_of(frame: &marklin_can::Frame) -> Option<bool> {
    match marklin_can::Message::of(frame) {
        marklin_can::Message::Go(_) => Some(true),
        marklin_can::Message::Stop(_) => Some(false),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The power as it was commanded, whether it is confirmed, and whether the station reports it at all.
    fn seen(rhythm: &Rhythm) -> Option<(bool, bool, bool)> {
        rhythm.power().map(|power| (power.is_on, power.has_answered, power.reports_power))
    }

    #[test]
    fn a_board_confirms_the_power_itself() {
        let mut rhythm = Rhythm::default();
        rhythm.wrote_message(b"<1 MAIN>");
        assert_eq!(seen(&rhythm), Some((true, false, true)));
        b"<# 50><p0 B>".iter().for_each(|byte| rhythm.heard_of_board(*byte));
        assert_eq!(seen(&rhythm), Some((true, false, true)));
        b"<p1 MAIN>".iter().for_each(|byte| rhythm.heard_of_board(*byte));
        assert_eq!(seen(&rhythm), Some((true, true, true)));
    }

    #[test]
    fn a_command_station_on_loconet_confirms_the_power_in_a_slot() {
        let mut rhythm = Rhythm::default();
        rhythm.wrote_line(b"SEND 83 7C\r\n");
        assert_eq!(seen(&rhythm), Some((true, false, true)));
        for (line, has_answered) in [
            (&b"RECEIVE 83 7C\r\n"[..], false),
            (b"RECEIVE E7 0E 05 13 06 00 20 06 00 18 00 00 00 38\r\n", false),
            (b"RECEIVE E7 0E 05 33 18 3F 10 07 00 00 00 00 00 10\r\n", true),
        ] {
            line.iter().for_each(|byte| rhythm.heard_of_server(*byte));
            assert_eq!(seen(&rhythm), Some((true, has_answered, true)));
        }
    }

    #[test]
    fn jmri_confirms_the_power_when_its_hardware_has_switched_it() {
        let mut rhythm = Rhythm::default();
        rhythm.wrote_request(b"{\"type\":\"power\",\"method\":\"post\",\"data\":{\"state\":2}}\n");
        assert_eq!(seen(&rhythm), Some((true, false, true)));
        for (state, has_answered) in [(0, false), (2, true)] {
            let power =
                format!("{{\"type\":\"power\",\"data\":{{\"name\":\"LocoNet\",\"state\":{state}}}}}\n");
            power.bytes().for_each(|byte| rhythm.heard_of_jmri(byte));
            assert_eq!(seen(&rhythm), Some((true, has_answered, true)));
        }
    }

    #[test]
    fn a_central_station_confirms_the_power_itself() {
        let mut rhythm = Rhythm::default();
        rhythm.wrote_frame(&[0, 0, 3, 0, 5, 0, 0, 0, 0, 1, 0, 0, 0]);
        assert_eq!(seen(&rhythm), Some((true, false, true)));
        // Its own echo says nothing; the response bit does.
        for (response, has_answered) in [(0, false), (1, true)] {
            [0, response, 3, 0, 5, 0, 0, 0, 0, 1, 0, 0, 0]
                .into_iter()
                .for_each(|byte| rhythm.heard_of_bus(byte));
            assert_eq!(seen(&rhythm), Some((true, has_answered, true)));
        }
    }

    #[test]
    fn a_z21_confirms_the_power_itself() {
        let mut rhythm = Rhythm::default();
        rhythm.wrote_datagram(&[0x07, 0x00, 0x40, 0x00, 0x21, 0x81, 0xa0]);
        assert_eq!(seen(&rhythm), Some((true, false, true)));
        rhythm.heard_datagram(&[0x07, 0x00, 0x40, 0x00, 0x61, 0x00, 0x61]);
        assert_eq!(seen(&rhythm), Some((true, false, true)));
        assert_eq!(rhythm.power().and_then(|power| power.reported), Some(false));
        rhythm.heard_datagram(&[0x07, 0x00, 0x40, 0x00, 0x61, 0x01, 0x60]);
        assert_eq!(seen(&rhythm), Some((true, true, true)));
        // Power off, and the answer that all locomotives are stopped, which leaves the power on.
        rhythm.wrote_datagram(&[0x07, 0x00, 0x40, 0x00, 0x21, 0x80, 0xa1]);
        rhythm.heard_datagram(&[0x07, 0x00, 0x40, 0x00, 0x81, 0x00, 0x81]);
        assert_eq!(seen(&rhythm), Some((false, false, true)));
    }

    #[test]
    fn the_power_counts_as_heard_of_only_when_a_later_request_is_answered() {
        let at = |ms| Timestamp::ZERO + TimeSpan::from_ms(ms);
        let mut rhythm = Rhythm::default();
        // 128 + 5 asks five modules, 97 takes the power, 96 gives it (6051 manual).
        assert_eq!(rhythm.written(at(0), 133), Some(Request { after: None }));
        assert_eq!(rhythm.written(at(5), 97), None);
        assert_eq!(seen(&rhythm), Some((false, false, false)));
        // The reply to an earlier poll confirms nothing.
        assert!(rhythm.heard(at(12)).is_some());
        assert_eq!(seen(&rhythm), Some((false, false, false)));
        let request = rhythm.written(at(70), 133).expect("a request");
        assert_eq!(request.after, Some((TimeSpan::from_ms(70), 1)));
        assert_eq!(rhythm.heard(at(80)), Some(at(80) - (at(70) + BYTE_TIME)));
        assert_eq!(rhythm.heard(at(84)), None, "only the first byte of an answer");
        assert_eq!(seen(&rhythm), Some((false, true, false)));
        rhythm.written(at(90), 96);
        assert_eq!(seen(&rhythm), Some((true, false, false)));
    }
}
