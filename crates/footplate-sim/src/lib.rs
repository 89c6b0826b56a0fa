//! A seeded world of trains, track and sensors, whose truth only scorers see.
