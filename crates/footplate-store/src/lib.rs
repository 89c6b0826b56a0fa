//! Layouts, calibrations and recordings on disk, and reading them back.
//!
//! Files come in through [`read_sensor_log`], which turns every form of sensor log into one
//! [`Recording`]. [`score`] walks one and says how good the forecasts of it are. What was measured is
//! kept for ever in a [`Store`].

pub mod accelerometer;
mod batch;
mod content_hash;
mod decimal;
mod described;
mod document;
mod findings;
mod layout_file;
mod line_file;
mod motion_file;
mod motion_replay;
pub mod odometry;
mod position_series;
mod published_table;
mod quantity;
mod railtoolkit;
mod recording;
mod recording_names;
pub mod score;
mod sensor_log;
mod sensor_names;
mod session_check;
mod speed_profile;
mod store;
mod table;
mod tachometer;
mod taped_moves;
mod text_file;
mod train_file;
mod ttobench;
mod vehicle_file;
mod whole_file;
mod written_table;

pub use batch::{Batch, BatchError, BatchEvent, BatchRun, BatchTrain, LeftOut, Polling};
pub use content_hash::{ContentHash, HashingReader};
pub use described::{Described, parse_described, read_described};
pub use document::{DocumentError, DocumentProblem, LARGEST_DOCUMENT};
pub use findings::{
    ComparedLawForm, Findings, LawForm, PollingForm, SuspicionForm, TapedStopForm, TrainFindings,
};
pub use layout_file::{
    BUILT_IN, Drawing, ImportContext, ImportError, ImportedPanel, LARGEST_LAYOUT, LayoutFile,
    LayoutFileError, LayoutProblem, LayoutTables, NothingToDraw, PanelError, RowProblem, built_in,
    draw_layout, import_layout, import_panel, layout_named, parse_layout, read_layout, write_layout,
};
pub use line_file::{LineFile, LineFileForm, parse_line, read_line, write_line};
pub use motion_file::{
    ExactForm, MOTION_MODEL_VERSION, MotionFile, MotionFileError, MotionSectionForm, MotionStepForm,
    SensorScatterForm, StopOffsetForm, StoredModel, UseForm,
};
pub use motion_replay::MotionReplay;
pub use position_series::{PositionSeries, PositionSeriesError};
pub use published_table::{
    CheckedFigure, CountedFrom, CrossCheck, NothingToCompare, PublishedFigure, PublishedQuantity,
    PublishedTableError, TeamSummary, read_published_table,
};
pub use quantity::Quantity;
pub use recording::{Form, GatePass, Note, Oddity, RawEvent, Recording, Run, TrainAtStart};
pub use sensor_log::{
    LogContext, RecordingError, WriteLogError, parse_sensor_log, read_sensor_log, write_sensor_log,
};
pub use sensor_names::{ModuleLetters, SensorNames};
pub use session_check::{SessionCheck, SessionFigure, standardised};
pub use speed_profile::{
    FASTEST_MM_S, HoldOut, LARGEST_PROFILE, ModelRow, ProfileContext, ProfileError, ProfileNote,
    ProfileProblem, ProfileSpeed, SpeedProfile, parse_profile, read_profile, write_profile_table,
    write_roster_entry,
};
pub use store::{
    AssignedDetections, Calibration, Change, Direction, EventKey, Import, Journal, JournalEntry, MachineKey,
    Mark, MarkKind, NewCalibration, NewMachine, RecordingKey, RunKey, Salvaged, SalvagedTable, Schedule,
    Side, Store, StoreError, StoredEvent, StoredMachine, StoredRecording, StoredRun, Traced,
    UnfinishedSession, salvage,
};
pub use table::{LONGEST_LINE, TableError};
pub use tachometer::{
    ColumnMapping, MappingError, RowPlace, TachometerBlock, TachometerColumns, TachometerError,
    TachometerNote, TachometerOddity, TachometerReader, TachometerWriter, TimeFaults, Truth, WrittenColumns,
};
pub use taped_moves::{TapedMoves, TapedMovesError};
pub use text_file::{TextFileError, TextPlace};
pub use train_file::{TrainFile, TrainFileForm, parse_train, read_train, write_train};
pub use vehicle_file::{
    DEFAULT_VEHICLE, LARGEST_VEHICLE, VehicleFile, VehicleFileError, VehicleProblem, default_vehicle,
    parse_vehicle, read_vehicle, write_vehicle,
};
pub use whole_file::{WholeFile, open_file, read_at_most, write_whole};
pub use written_table::{TableForm, UnknownForm};
