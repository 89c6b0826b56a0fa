// The words of the pages in English.

export const ENGLISH = {
  // the frame
  "connecting": "connecting …", "connected": "live", "lost": "connection lost, trying again", "pages": "Pages",
  "halt": "Emergency stop", "halt-hint": "or the space bar: all trains stand, power off",
  "halt-asked": "emergency stop asked for, not confirmed yet",
  "halt-taken": "all trains were told to stand, and the power goes off",
  "halt-failed": "the emergency stop was NOT taken: {0}",
  "chart-keys": "Arrow keys move along the values.", "skip": "To the page",

  // layout
  "layout": "Layout", "zoom": "Zoom", "zoom-in": "Zoom in", "zoom-out": "Zoom out", "zoom-all": "All",
  "track": "The layout with its trains; press on the track to name a place",
  "pick-hint": "Press on the track to name a place.", "picked": "{0}: choose a train below", "trains": "Trains",
  "said": "Said", "order": "Order", "send": "Send", "speed": "speed", "at": "at", "busy": "busy with", "rests": "will rest",
  "nowhere": "nobody knows where", "stop": "Stop", "stop-here": "Stop at {0}", "step": "Step", "set": "Set",
  "none": "No train is driven here.", "gap": "{0} lines were missed", "unread": "cannot be sent: {0}",
  "step-of": "Step of train {0}", "at-step": "step {0}", "train": "Train {0}",

  // a train
  "no-such-train": "Train {0} is not driven here.", "sent": "sent: {0}", "refused": "refused: {0}",
  "picked-for": "{0}: stop train {1} there, or let it arrive in time", "drive": "Drive",
  "if-stopped": "told to stop now", "rest-way": "rests {0} ± {1} mm further, at {2}, in {3} s", "at-rest": "stands",
  "due": "next contact", "due-in": "{0} in {1} s ± {2} ms", "found": "found", "reverse": "Turn around",
  "slower": "One step slower", "faster": "One step faster", "hold": "Hold", "hold-speed": "Speed to hold (mm/s)",
  "follow": "Follow", "leader": "Train to follow", "gap-behind": "Seconds behind it", "arrive": "Arrive",
  "arrive-at": "Place to arrive at", "arrive-in": "in (s)", "move": "Move", "move-way": "Way to move (mm)",
  "window": "Time shown", "last-30": "30 seconds", "last-60": "1 minute", "last-300": "5 minutes",
  "over-time": "Over time", "predictions": "Predictions", "contact": "contact", "time-s": "time (s)",
  "late-ms": "late (ms)", "beside-mm": "off (mm)", "mean-speed": "mean (mm/s)", "missed": "missed", "stops": "Stopping",
  "note-speed": "Estimated speed with its 95 % band; points: mean speed between two contacts, by length and clock alone. Broken lines: another step was told.",
  "note-sure": "Shaded: where the train may be beside the estimate, 95 %. Points: where it was when a contact told.",
  "note-way": "The way since the train was found, and the contacts on it.",
  "note-late": "How much later than predicted each contact closed, with the 95 % interval stated beforehand.",
  "note-stops": "The way to rest by speed, 95 % of stops shaded; points: steps from which stops were measured, with what is not known of them. Upright: the speed now.",
  "chart-speed": "Speed over time", "chart-sure": "How sure the place is", "chart-way": "Way over time",
  "chart-late": "Prediction errors over time", "chart-stops": "Stopping distance by speed",
  "axis-time": "time since the session began (s)", "axis-speed": "speed (mm/s)", "axis-sure": "off (mm)",
  "axis-way": "way (m)", "axis-late": "later (ms)", "axis-from-speed": "speed (mm/s)", "axis-stop": "way to rest (mm)",
  "band-95": "95 %", "estimated": "estimated", "mean-between": "between contacts", "at-contact": "at a contact",
  "later": "later", "stop-95": "95 % of stops", "stop-way": "way to rest", "stop-measured": "measured",
  "stops-made": "Stops made", "order-given": "order", "rests-at": "rests at", "error-mm": "off (mm)", "promised": "promised (mm)",
  "truth-mm": "in truth (mm)", "did-stop": "stop", "did-move": "move", "did-arrive": "arrive", "did-speed": "speed",
  "did-reverse": "turn", "did-hold": "hold", "did-follow": "follow",

  // calibration
  "calibration": "Calibration", "of-train": "Train", "driven-with": "What it is driven with",
  "note-driven-with": "The model that drives the train now; it learns as the train runs. Intervals are 95 %.",
  "note-speeds": "Steady speed by step, by the side from which the step was reached.",
  "note-stops-by-step": "The way to rest from each step, with the interval in which 95 of 100 stops end.",
  "reached-from": "reached from", "side-below": "below", "side-above": "above", "contacts": "contacts", "not-known": "of it not known (mm)",
  "in-s": "in (s)", "stops-count": "stops", "why": "Why?", "why-of": "Why is {0} so?", "in-store": "What all recordings say",
  "note-store": "Worked out from all that the store holds of this train, less what was excluded, by the same fit as `footplate calibrate --store`.",
  "note-stored": "Steady speed by step with its 95 % interval.", "change-shown": "Change of speed shown",
  "note-law": "The law of this change, and the mean speeds between contacts.", "note-beyond": "How far contacts lie beyond the law, with 95 % of what is not known of that.",
  "law": "law", "law-up": "getting faster", "law-down": "getting slower", "law-from": "from {0} changes, held-out error {1} mm",
  "why-so": "Why is this number so?", "number-asked": "Number", "reason": "Reason, to exclude or restore", "reason-first": "Write a reason first.",
  "exclude": "Exclude", "restore": "Restore", "exclude-event": "Exclude event {0}", "restore-event": "Restore event {0}", "thinks": "mark",
  "excluded": "excluded: event {0}; it stays in the store and can be restored", "restored": "restored: event {0}", "marked": "Excluded by a person",
  "under-way": "A calibration is under way", "about": "experiment", "because": "why", "time-left": "time left", "time-used": "Time used",
  "expected": "expected accuracy", "left-of": "{0} s of {1} s of track time", "expected-at": "at step {0}: stops within {1} mm, speed within {2} % (95 %)",
  "chart-speeds": "Speed by step", "chart-stops-by-step": "Way to rest by step", "chart-stored": "Speed by step from recordings",
  "chart-law": "Change of speed", "chart-beyond": "Beyond the law", "axis-step": "step", "axis-since": "since the command (s)",
  "axis-beyond": "beyond (mm)", "beyond-law": "beyond the law", "from-below": "from below", "from-above": "from above", "from-unknown": "side not recorded",

  // health
  "health": "Health", "predicted": "predictions", "rms-mm": "error, rms (mm)", "mean-mm": "mean (mm)", "inside-95": "inside the 95 % interval",
  "drift": "on the way to a drift alarm", "drift-of": "Train {0}: {1} % of the way to a drift alarm", "too-few": "too few yet",
  "note-errors": "Where each train was beside the estimate when a contact told.", "note-doubts": "Errors in units of the interval stated beforehand: 95 of 100 belong into the shaded band.",
  "axis-doubts": "error / half interval", "chart-errors": "Prediction errors of all trains", "chart-doubts": "Prediction errors by their intervals",
  "alarms": "Alarms", "no-alarm": "None so far.", "line": "Line and loop", "chart-poll": "Poll period", "chart-first-byte": "First byte", "chart-turn": "Control loop",
  "note-poll": "From one reading of the contacts to the next, with no command between them.", "note-first-byte": "From the last bit of a request to the first byte of its answer.",
  "note-turn": "How long the control loop is busy each time it wakes.", "axis-ms": "ms", "axis-count": "times", "times": "times",
  "quantiles": "{0} times: median {1} ms, 95 % {2}, 99 % {3}, longest {4}", "none-yet": "Nothing counted yet.",

  // recordings
  "recordings": "Recordings", "session": "session", "events": "events", "excluded-count": "excluded", "decided-by": "decided by",
  "machine-drive": "driving", "machine-calibrate": "calibration", "machine-tour": "demo", "choose-two": "Choose a session to walk it again, or two to compare them.",
  "no-recordings": "The store holds no recording yet.", "walking": "walking it again …", "walked-track": "The track of {0}", "play": "Play", "pause": "Pause",
  "moment": "Moment", "compared": "Compared", "note-recorded": "Where trains were beside the estimate when a contact told; upright: the moment shown.",
  "chart-recorded": "Prediction errors of the sessions", "axis-session": "time since its first picture (s)",

  // odometry
  "odometry": "Odometry", "drop-here": "Drop a recording of a tachometer here: CSV or Parquet.", "or-choose": "Or choose a file:",
  "note-odometry": "Columns t_s, pulses_1, pulses_2 and more; it is walked as by `footplate odometry`, for two powered wheelsets of 80 teeth. At most 64 MB.",
  "walking-file": "{0} is walked …", "odometry-of": "Odometry of {0}", "too-large": "{0} is too large: {1} MB; at most 64 MB are taken",
};
