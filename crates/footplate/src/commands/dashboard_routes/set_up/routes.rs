//! The HTTP interface of the set-up.
//!
//! ```text
//! GET  /api/setup             the mode of the program, and the set-up as far as it is complete
//! POST /api/setup             {"link": ..}, {"layout": ..}, {"drawn": ..} or {"trains": ..}: a step
//! GET  /api/setup/stations    stations that were found
//! GET  /api/setup/layouts/x   a built-in layout, to draw it
//! POST /api/setup/doctor      {}: check the link
//! POST /api/setup/calibrate   {"train": 24, "turnouts_are_clear": true}
//! POST /api/setup/drive       {}: the set-up is complete
//! POST /api/setup/again       {}: back to the set-up once this session has ended
//! ```

use std::collections::BTreeSet;
use std::path::PathBuf;
use std::sync::mpsc::SyncSender;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use anyhow::{Context, bail};
use axum::Json;
use axum::extract::rejection::JsonRejection;
use axum::extract::{DefaultBodyLimit, Path, State};
use axum::http::{StatusCode, header};
use axum::response::{IntoResponse, Response};
use axum::routing::{get, post};
use footplate_core::Timestamp;
use footplate_store::{BUILT_IN, built_in, write_whole};
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

use super::super::answer_queue::{AnswerQueue, Rejection};
use super::super::drawn_layout::{DrawnLayout, LARGEST_LAYOUT, drawn_layout_routes};
use super::set_up_file::{SetUp, SetUpTrain, StepResult};
use super::{Next, check_link};
use crate::clock::now;
use crate::dashboard::{LayoutPicture, Routes};
use crate::error_text::error_text;
use crate::link::find_stations;

/// What the program that answers does.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum SetUpMode {
    /// It drives a railway that its command line describes.
    Fixed,
    /// It waits for the owner.
    SettingUp,
    /// It calibrates a train of the set-up.
    Calibrating,
    /// It drives the railway of the set-up.
    Driving,
}

/// The part of the interface that a session offers.
#[derive(Debug, Clone)]
pub(crate) struct SetUpRoute {
    file: Option<PathBuf>,
    mode: SetUpMode,
    /// Whether `/api/truth` answers: a simulated railway that is driven.
    offers_truth: bool,
    instance: Instance,
}

/// Distinguishes one server at an address from the next: browsers open the page again when it changes.
#[derive(Debug, Clone, Serialize)]
struct Instance(String);

impl Instance {
    fn new() -> Self {
        Self((now() - Timestamp::ZERO).as_ns().to_string())
    }
}

impl SetUpRoute {
    /// The route of a session that its command line describes.
    pub(crate) fn fixed() -> Self {
        Self { file: None, mode: SetUpMode::Fixed, offers_truth: false, instance: Instance::new() }
    }

    /// The route of a session; without a file it was not set up in the browser.
    pub(crate) fn of_session(file: Option<PathBuf>, mode: SetUpMode, offers_truth: bool) -> Self {
        let mode = if file.is_some() { mode } else { SetUpMode::Fixed };
        Self { file, mode, offers_truth, instance: Instance::new() }
    }

    pub(crate) fn routes(self) -> Routes {
        Routes::new(self, [("/api/setup", get(state_of_session)), ("/api/setup/again", post(again))])
    }

    /// Marks the set-up as incomplete, so that the program returns to it.
    fn reopen(&self) -> anyhow::Result<Value> {
        let file = self
            .file
            .as_ref()
            .context("this railway was not set up in the browser: start `footplate serve` without --link")?;
        let mut set_up = SetUp::read(file)?;
        set_up.is_complete = false;
        set_up.write(file)?;
        Ok(json!({ "taken": true }))
    }
}

async fn state_of_session(State(route): State<SetUpRoute>) -> Response {
    let trains = route.file.as_deref().and_then(|file| SetUp::read(file).ok()).unwrap_or_default().trains;
    answer(Ok(json!({
        "mode": route.mode, "instance": route.instance, "offers_truth": route.offers_truth, "trains": trains,
    })))
}

async fn again(State(route): State<SetUpRoute>) -> Response {
    answer(route.reopen())
}

/// The pages of the set-up, while no other process serves the address.
#[derive(Clone)]
pub(super) struct Pages {
    shared: Arc<Shared>,
}

struct Shared {
    kept: Mutex<Kept>,
    store: PathBuf,
    /// Why the last drive could not begin.
    problem: Option<String>,
    chosen: SyncSender<Next>,
    instance: Instance,
    /// One check of the link at a time: a station takes one program.
    checking: tokio::sync::Semaphore,
}

/// The set-up, and what follows from it and the store. Only a change of the set-up opens the store: no other process
/// writes to it while these pages are served.
struct Kept {
    set_up: SetUp,
    calibrated: BTreeSet<u16>,
    /// Why the store cannot be read.
    problem: Option<String>,
}

impl Kept {
    fn of(set_up: SetUp, store: &std::path::Path) -> Self {
        let (calibrated, problem) = match set_up.calibrated(store) {
            Ok(calibrated) => (calibrated, None),
            Err(error) => (BTreeSet::new(), Some(error_text(&error))),
        };
        Self { set_up, calibrated, problem }
    }
}

/// One step: exactly one of its fields is given.
#[derive(Debug, Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
struct Step {
    link: Option<String>,
    /// Of a simulated railway, beside its link.
    speed: Option<f64>,
    layout: Option<String>,
    drawn: Option<DrawnLayout>,
    trains: Option<Vec<SetUpTrain>>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct ToCalibrate {
    train: u16,
    /// The owner says that no train is on a turnout: all of them are set straight.
    turnouts_are_clear: bool,
}

impl Pages {
    pub(super) fn new(
        set_up: SetUp,
        store: PathBuf,
        problem: Option<String>,
        chosen: SyncSender<Next>,
    ) -> Self {
        let checking = tokio::sync::Semaphore::new(1);
        Self {
            shared: Arc::new(Shared {
                kept: Mutex::new(Kept::of(set_up, &store)),
                store,
                problem,
                chosen,
                instance: Instance::new(),
                checking,
            }),
        }
    }

    pub(super) fn routes(self) -> Routes {
        let change = post(change).layer(DefaultBodyLimit::max(LARGEST_LAYOUT));
        Routes::new(
            self,
            [
                ("/api/setup", get(state).merge(change)),
                ("/api/setup/stations", get(stations)),
                ("/api/setup/layouts/{name}", get(layout_to_draw)),
                ("/api/setup/doctor", post(doctor)),
                ("/api/setup/calibrate", post(calibrate)),
                ("/api/setup/drive", post(drive)),
                // Pages of a session that has ended still ask for these until they open the set-up.
                ("/api/events", get(async || StatusCode::NO_CONTENT)),
                ("/api/line", get(async || answer(Ok(Value::Null)))),
            ],
        )
        .and(drawn_layout_routes(&AnswerQueue::new()))
    }

    fn kept(&self) -> MutexGuard<'_, Kept> {
        self.shared.kept.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn set_up(&self) -> SetUp {
        self.kept().set_up.clone()
    }

    fn file(&self) -> PathBuf {
        super::file_beside(&self.shared.store)
    }

    fn json(&self) -> Value {
        let kept = self.kept();
        let Kept { set_up, calibrated, problem } = &*kept;
        let trains = set_up.trains.iter().map(|SetUpTrain { address, name }| {
            json!({
                "address": address, "name": name, "is_calibrated": calibrated.contains(address),
                "calibration": set_up.calibrations.get(address),
            })
        });
        let addresses =
            set_up.station().map(|station| [*station.addresses().start(), *station.addresses().end()]);
        json!({
            "mode": SetUpMode::SettingUp, "instance": self.shared.instance, "store": self.shared.store, "layouts": BUILT_IN,
            "problem": self.shared.problem.as_ref().or(problem.as_ref()), "link": set_up.link, "speed": set_up.speed,
            "layout": set_up.layout, "line": set_up.line, "addresses": addresses, "trains": trains.collect::<Vec<_>>(),
        })
    }

    /// Changes a copy, so that a rejected step changes nothing.
    fn change(&self, step: Step) -> anyhow::Result<Value> {
        let mut changed = self.set_up();
        match step {
            Step { link: Some(link), speed, .. } => changed.set_link(&link, speed)?,
            Step { layout: Some(layout), .. } => changed.set_layout(&layout)?,
            Step { drawn: Some(drawn), .. } => {
                changed.set_layout(&self.keep_drawn(&drawn, changed.layout.as_deref())?)?;
            }
            Step { trains: Some(trains), .. } => changed.set_trains(trains)?,
            _ => bail!("name a step: `link`, `layout`, `drawn` or `trains`"),
        }
        self.write(changed)?;
        Ok(self.json())
    }

    fn write(&self, changed: SetUp) -> anyhow::Result<()> {
        changed.write(&self.file())?;
        *self.kept() = Kept::of(changed, &self.shared.store);
        Ok(())
    }

    /// Writes a layout to a file beside the store, named after it; returns the path.
    fn keep_drawn(&self, drawn: &DrawnLayout, present: Option<&str>) -> anyhow::Result<String> {
        let layout = drawn.written()?.layout;
        let letters = layout.name().to_lowercase();
        let words = letters.split(|c: char| !c.is_ascii_alphanumeric()).filter(|word| !word.is_empty());
        let name = words.collect::<Vec<_>>().join("-");
        if name.is_empty() || BUILT_IN.contains(&name.as_str()) {
            bail!("give the layout another name, of letters and digits: its file is named after it");
        }
        let path = self.shared.store.with_file_name(format!("{name}.toml"));
        let text =
            path.to_str().context("the folder of the store has a name that cannot be written in a link")?;
        // An absolute path holds wherever the program is started next.
        if path.exists() && present != Some(text) && std::fs::read_to_string(&path)? != drawn.toml {
            bail!("{text} exists already and is another layout: give this one another name");
        }
        write_whole(&path, drawn.toml.as_bytes()).with_context(|| format!("cannot write {text}"))?;
        Ok(text.to_owned())
    }

    fn wait_for_check(&self) -> anyhow::Result<()> {
        if self.shared.checking.available_permits() == 0 {
            bail!("the link is still being checked: wait for its result");
        }
        Ok(())
    }

    /// Keeps the result of a check of the link of a set-up that may have been changed meanwhile.
    fn keep_check(&self, checked: &SetUp, line: StepResult) -> anyhow::Result<Value> {
        let mut changed = self.set_up();
        if changed.link != checked.link {
            bail!("another link was chosen while the link was being checked: check it again");
        }
        changed.line = Some(line);
        self.write(changed)?;
        Ok(self.json())
    }

    /// Goes over to another process.
    fn go_on(&self, next: Next) -> anyhow::Result<Value> {
        self.wait_for_check()?;
        // A second click changes nothing: the first one is carried out.
        let _ = self.shared.chosen.try_send(next);
        Ok(json!({ "taken": true }))
    }

    fn calibrate(&self, ToCalibrate { train, turnouts_are_clear }: &ToCalibrate) -> anyhow::Result<Value> {
        let set_up = self.set_up();
        set_up.calibration_link()?;
        set_up.layout()?;
        if !set_up.trains.iter().any(|named| named.address == *train) {
            bail!("train {train} is not in the set-up: add it to the trains first");
        }
        if !turnouts_are_clear {
            bail!(
                "all turnouts are set straight before the train moves: check first that no train is standing on one"
            );
        }
        self.go_on(Next::Calibrate(*train))
    }

    fn drive(&self) -> anyhow::Result<Value> {
        let mut changed = self.set_up();
        changed.link()?;
        changed.layout()?;
        if changed.trains.is_empty() {
            bail!("name a train first");
        }
        // A refused request leaves the set-up as it is.
        self.wait_for_check()?;
        changed.is_complete = true;
        self.write(changed)?;
        self.go_on(Next::Drive)
    }
}

/// JSON, or the reason why not.
fn answer(result: anyhow::Result<Value>) -> Response {
    let no_store = [(header::CACHE_CONTROL, "no-store")];
    match result {
        Ok(json) => (no_store, Json(json)).into_response(),
        Err(error) => {
            (no_store, Rejection(StatusCode::UNPROCESSABLE_ENTITY, error_text(&error))).into_response()
        }
    }
}

/// The body of a request, or what is wrong with it.
fn read<T>(body: Result<Json<T>, JsonRejection>, work: impl FnOnce(T) -> anyhow::Result<Value>) -> Response {
    match body {
        Ok(Json(read)) => answer(work(read)),
        Err(wrong) => Rejection(wrong.status(), wrong.body_text()).into_response(),
    }
}

async fn state(State(pages): State<Pages>) -> Response {
    answer(Ok(pages.json()))
}

async fn change(State(pages): State<Pages>, body: Result<Json<Step>, JsonRejection>) -> Response {
    read(body, |step| pages.change(step))
}

async fn stations() -> Response {
    let found = tokio::task::spawn_blocking(find_stations).await;
    answer(found.map_err(anyhow::Error::from).map(|found| json!(found)))
}

async fn layout_to_draw(Path(name): Path<String>) -> Response {
    answer(
        built_in(&name)
            .map_err(Into::into)
            .and_then(|file| Ok(serde_json::to_value(LayoutPicture::of(&file))?)),
    )
}

async fn doctor(State(pages): State<Pages>) -> Response {
    let Ok(_checking) = pages.shared.checking.try_acquire() else {
        return answer(Err(anyhow::anyhow!("the link is being checked already: wait for its result")));
    };
    let (set_up, store) = (pages.set_up(), pages.shared.store.clone());
    let checked = set_up.clone();
    let line = tokio::task::spawn_blocking(move || check_link(&set_up, &store)).await;
    let keep = |line| pages.keep_check(&checked, line);
    answer(line.map_err(anyhow::Error::from).and_then(|line| line).and_then(keep))
}

async fn calibrate(State(pages): State<Pages>, body: Result<Json<ToCalibrate>, JsonRejection>) -> Response {
    read(body, |wanted| pages.calibrate(&wanted))
}

async fn drive(State(pages): State<Pages>) -> Response {
    answer(pages.drive())
}

/// The routes of a set-up that has not begun and leads to no other process, for the fuzzer.
pub(crate) fn fuzzed_set_up_routes(store: PathBuf) -> Routes {
    let (chosen, _) = std::sync::mpsc::sync_channel(1);
    Pages::new(SetUp::default(), store, None, chosen).routes()
}

/// The paths of the set-up, for the test of the description.
#[cfg(test)]
pub(crate) fn set_up_paths() -> Vec<&'static str> {
    let pages = fuzzed_set_up_routes(PathBuf::new());
    pages.paths().iter().chain(SetUpRoute::fixed().routes().paths()).copied().collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The pages of a simulated railway with a train, in a folder of their own.
    fn pages(folder: &std::path::Path) -> Pages {
        let mut set_up = SetUp::default();
        set_up.set_link("sim", None).expect("a simulation");
        set_up.set_layout("track-a").expect("it is built in");
        set_up
            .set_trains(vec![SetUpTrain { address: 24, name: String::new() }])
            .expect("a train that it has");
        let (chosen, _) = std::sync::mpsc::sync_channel(1);
        Pages::new(set_up, folder.join("railway.db"), None, chosen)
    }

    fn refused(result: anyhow::Result<Value>) -> String {
        result.expect_err("it should be refused").to_string()
    }

    #[test]
    fn driving_that_is_refused_while_the_link_is_being_checked_leaves_the_set_up_open() {
        let folder = tempfile::tempdir().expect("a folder");
        let pages = pages(folder.path());
        let checking = pages.shared.checking.try_acquire().expect("nothing else checks");
        assert!(refused(pages.drive()).contains("wait for its result"));
        assert!(!pages.set_up().is_complete);
        drop(checking);
        pages.drive().expect("it goes on");
        assert!(pages.set_up().is_complete);
    }

    #[test]
    fn a_check_of_a_link_that_was_replaced_meanwhile_says_nothing_of_the_new_one() {
        let folder = tempfile::tempdir().expect("a folder");
        let pages = pages(folder.path());
        let line = StepResult { status: 0, report: "a 6051".to_owned() };
        let mut other = pages.set_up();
        other.link = Some("z21:192.168.0.111".to_owned());
        assert!(refused(pages.keep_check(&other, line.clone())).contains("check it again"));
        assert!(pages.set_up().line.is_none());
        pages.keep_check(&pages.set_up(), line).expect("it is the link that was checked");
        assert!(pages.set_up().line.is_some());
    }
}
