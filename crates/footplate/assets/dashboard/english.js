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
};
