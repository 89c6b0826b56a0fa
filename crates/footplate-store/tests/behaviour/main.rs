//! What the store promises, a file a promise.

mod bad_layouts;
mod bad_logs;
mod bad_tachometer_recordings;
mod bad_trains_and_lines;
mod built_in_layouts;
mod child_process;
mod journal_survives;
mod layout_tables;
mod layouts_of_any_text;
mod logs_round_trip;
mod metro_trips;
mod no_look_ahead;
mod real_logs;
mod recordings;
mod running_times;
mod scored_loop;
mod store_damaged;
mod store_of_old_versions;
mod store_remembers;
mod store_shared;
mod store_survives;
mod stores;
mod tachometer_recordings;
mod tachometer_round_trip;
mod trains_and_lines;
mod vehicle_files;
