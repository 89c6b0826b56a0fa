// The current activity of a train, as a sentence.

import { shown, signed } from "./dom.js";
import { kmPerHour } from "./scale.js";
import { say } from "./words.js";

export function doingNow(train) {
  if (!train.at) return train.step > 0 ? say("now-seeks", train.step) : say("now-lost");
  const at = `${train.at} ± ${shown(train.half_mm)} mm`;
  if (train.at_rest && !train.doing) return say("now-rests", at);
  const speed = `${shown(train.speed_mm_per_s)} mm/s (${kmPerHour(train.speed_mm_per_s)})`;
  if (train.at_rest) return say("now-waits", at, train.doing);
  const rest = train.if_stopped;
  if (train.step === 0 && !train.doing && rest) return say("now-slows", speed, rest.at ?? "?", shown(rest.half_mm));
  if (train.doing && train.promise_mm) return say("now-stops", speed, train.doing, signed(train.promise_mm[1]), signed(train.promise_mm[2]));
  return train.doing ? say("now-does", speed, train.doing) : say("now-runs", speed, train.step);
}
