// Speeds as a full-size train would have them.

/** How many times smaller than its example a model is, by the name of its scale (NEM 010). */
export const SCALES = { "Z": 220, "N": 160, "TT": 120, "H0": 87, "S": 64, "0": 45, "1": 32 };
const KEPT_AS = "scale";
const USUAL = "H0";
/** From mm/s to km/h. */
const KM_PER_H = 0.0036;

/** The scale that this reader chose. */
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
    // A browser that keeps nothing shows the usual scale again next time.
  }
}

/** A model's speed (mm/s) as that of its example, in whole km/h. */
export const kmPerHour = (speed) => `${(speed * KM_PER_H * SCALES[scale()]).toFixed(0)} km/h`;
