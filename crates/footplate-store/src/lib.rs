//! Layouts, calibrations and recordings on disk, and reading them back.
