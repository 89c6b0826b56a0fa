//! Any bytes as a vehicle file: they are refused with their place, or read as a vehicle that writes and reads back.

use footplate_store::{parse_vehicle, write_vehicle};

pub(crate) fn fuzz(bytes: &[u8]) {
    match parse_vehicle("train.toml", bytes) {
        Ok(file) => {
            assert!(file.vehicle.check().is_ok());
            let again = parse_vehicle("train.toml", write_vehicle(&file).as_bytes());
            assert_eq!(again.expect("a vehicle that was written reads back"), file);
        }
        Err(error) => assert!(error.to_string().starts_with("train.toml")),
    }
}
