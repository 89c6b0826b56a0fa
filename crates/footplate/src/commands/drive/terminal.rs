//! The live view in a terminal: trains, messages and a prompt. It shows the same board as the dashboard, from a thread
//! of its own, so that a slow terminal delays no train.

mod prompt;
mod view;
mod view_model;

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::Duration;

use anyhow::Context;
use ratatui::DefaultTerminal;
use ratatui::crossterm::event::{self, Event, KeyCode, KeyEvent, KeyEventKind, KeyModifiers};
use tokio::sync::oneshot;

use self::prompt::Prompt;
use self::view_model::TerminalModel;
use crate::dashboard::{Answer, Board, LayoutPicture, Request};

/// Frame interval: 15 frames a second look smooth, and a line of 9600 baud can carry the changes.
const FRAME: Duration = Duration::from_millis(66);

/// The live view; dropping it restores the terminal.
pub(super) struct Terminal {
    is_over: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl Terminal {
    /// Starts the live view.
    ///
    /// # Errors
    /// The terminal does not support it.
    pub(super) fn open(board: &Arc<Board>, layout: &LayoutPicture) -> anyhow::Result<Self> {
        let terminal = ratatui::try_init().context("the terminal cannot show the screen: try --plain")?;
        let is_over = Arc::new(AtomicBool::new(false));
        let view_thread = ViewThread {
            board: Arc::clone(board),
            model: TerminalModel::of(layout)?,
            prompt: Prompt::default(),
            asked: Vec::new(),
        };
        let over = Arc::clone(&is_over);
        let thread = std::thread::Builder::new().name("terminal".to_owned()).spawn(move || {
            // If the terminal fails, the trains are still driven, and the program still ends by a signal.
            let _ = view_thread.run(terminal, &over);
        })?;
        Ok(Self { is_over, thread: Some(thread) })
    }
}

impl Drop for Terminal {
    fn drop(&mut self) {
        self.is_over.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
        ratatui::restore();
    }
}

/// The state of the view's thread.
struct ViewThread {
    board: Arc<Board>,
    model: TerminalModel,
    prompt: Prompt,
    /// Requests without an answer yet.
    asked: Vec<oneshot::Receiver<Answer>>,
}

impl ViewThread {
    fn run(mut self, mut terminal: DefaultTerminal, is_over: &AtomicBool) -> std::io::Result<()> {
        while !is_over.load(Ordering::Relaxed) {
            self.model.look(&self.board);
            self.show_answers();
            terminal.draw(|frame| view::draw(frame, &self.model, &self.prompt))?;
            if event::poll(FRAME)?
                && let Event::Key(key) = event::read()?
                && key.kind == KeyEventKind::Press
            {
                self.press(key);
            }
        }
        Ok(())
    }

    fn press(&mut self, key: KeyEvent) {
        let with_control = key.modifiers.contains(KeyModifiers::CONTROL);
        match key.code {
            KeyCode::Char('c' | 'd') if with_control => self.ask("quit", Request::Line("quit".to_owned())),
            KeyCode::Char(' ') if self.prompt.text().is_empty() => {
                self.ask("emergency stop", Request::EmergencyStop);
            }
            KeyCode::Char(letter) if !with_control => self.prompt.insert(letter),
            KeyCode::Enter => {
                if let Some(line) = self.prompt.take() {
                    self.ask(&line.clone(), Request::Line(line));
                }
            }
            KeyCode::PageUp => self.model.scroll(1),
            KeyCode::PageDown => self.model.scroll(-1),
            other => self.prompt.press(other),
        }
    }

    fn ask(&mut self, said: &str, request: Request) {
        self.model.say(format!("> {said}"));
        match self.board.ask(request) {
            Ok(answer) => self.asked.push(answer),
            Err(_) => {
                self.model.say("! too many commands are waiting: enter it again in a moment".to_owned());
            }
        }
    }

    fn show_answers(&mut self) {
        let model = &mut self.model;
        self.asked.retain_mut(|asked| match asked.try_recv() {
            Ok(Answer::Refused(why)) => {
                model.say(format!("! {why}"));
                false
            }
            Err(oneshot::error::TryRecvError::Empty) => true,
            _ => false,
        });
    }
}
