// Speeds at the scale of the prototype.

/** How many times smaller a model is than its prototype, by the name of its scale (NEM 010). */
export const SCALES = { "Z": 220, "N": 160, "TT": 120, "H0": 87, "S": 64, "0": 45, "1": 32 };
const KEPT_AS = "scale";
const USUAL = "H0";
/** From mm/s to km/h. */
const KM_PER_H = 0.0036;

/** The scale chosen by the reader. */
export function scale() {
  try {
    const kept = localStorage.getItem(KEPT_AS);
    return Object.hasOwn(SCALES, kept) ? kept : USUAL;
  } catch {
    return USUAL;
  }
}

export function chooseScale(name) {
  try {
    localStorage.setItem(KEPT_AS, name);
  } catch {
    // A browser without storage shows the default scale next time.
  }
}

/** A model's speed (mm/s) as that of its prototype, in whole km/h. */
export const kmPerHour = (speed) => `${(speed * KM_PER_H * SCALES[scale()]).toFixed(0)} km/h`;
