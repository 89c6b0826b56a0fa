//! Runs one ignored test of this binary as a process of its own, to be talked to, made to wait and killed.

use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};

/// Tells the child where the store is.
const STORE: &str = "FOOTPLATE_TEST_STORE";
/// Marks the lines that the child means for us, between those of the test harness.
const MARK: &str = "child: ";

pub(crate) struct ChildProcess {
    child: Child,
    said: BufReader<ChildStdout>,
    /// The child lives until this is closed, if it waits for it.
    stdin: Option<ChildStdin>,
}

impl ChildProcess {
    /// Starts the ignored test `test` of this binary.
    pub(crate) fn start(test: &str, store: &Path) -> Self {
        Self::spawn(Command::new(std::env::current_exe().unwrap()), test, store)
    }

    /// The same, where no file may grow beyond `kib` KiB.
    #[cfg(unix)]
    pub(crate) fn start_with_small_disk(test: &str, store: &Path, kib: u32) -> Self {
        let mut shell = Command::new("bash");
        // With the signal ignored the system refuses the write, as it does when the disk is full.
        let limit = format!("trap '' XFSZ; ulimit -f {kib}; exec \"$0\" \"$@\"");
        shell.arg("-c").arg(limit).arg(std::env::current_exe().unwrap());
        Self::spawn(shell, test, store)
    }

    fn spawn(mut command: Command, test: &str, store: &Path) -> Self {
        let mut child = command
            .args(["--exact", test, "--ignored", "--nocapture", "--test-threads", "1"])
            .env(STORE, store)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        let said = BufReader::new(child.stdout.take().unwrap());
        let stdin = child.stdin.take();
        Self { child, said, stdin }
    }

    /// What the child says next, or `None` once it has ended.
    pub(crate) fn next_word(&mut self) -> Option<String> {
        let mut line = String::new();
        while self.said.read_line(&mut line).ok()? > 0 {
            if let Some((_, word)) = line.trim_end().split_once(MARK) {
                return Some(word.to_owned());
            }
            line.clear();
        }
        None
    }

    /// Ends it without a warning, as `kill -9` does.
    pub(crate) fn kill(&mut self) {
        self.child.kill().unwrap();
        self.child.wait().unwrap();
    }

    /// Lets it end by itself.
    pub(crate) fn let_end(mut self) {
        drop(self.stdin.take());
        assert!(self.child.wait().unwrap().success());
    }
}

/// In the child: where the store is; nothing if somebody runs the ignored tests by hand.
pub(crate) fn store_of_parent() -> Option<std::path::PathBuf> {
    std::env::var_os(STORE).map(Into::into)
}

/// In the child: says something to the parent.
pub(crate) fn say(word: impl std::fmt::Display) {
    println!("{MARK}{word}");
}

/// In the child: waits until the parent lets it end.
pub(crate) fn wait_for_parent() {
    let _ = std::io::stdin().read_line(&mut String::new());
}
