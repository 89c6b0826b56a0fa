// The throttle of a train: step, stop and reverse, large enough for a thumb, and lockable to this train.

import { put } from "./dom.js";
import { orderAtOnce } from "./server.js";
import { say } from "./words.js";

export class Throttle {
  /** Whether the slider is being moved. */
  isDragged = false;
  #slider; #shown; #train; #lock; #give; #step = 0;

  /** `give` sends a command and shows its result beside the throttle. */
  constructor(root, train, give) {
    const $ = (selector) => root.querySelector(selector);
    [this.#slider, this.#shown, this.#train, this.#lock, this.#give] = [$("#step"), $("#step-told"), train, $("#lock"), give];
    const slider = this.#slider;
    slider.addEventListener("input", () => { this.isDragged = true; put(this.#shown, slider.value); });
    slider.addEventListener("change", () => { this.isDragged = false; this.#runAt(Number(slider.value)); });
    $("#slower").addEventListener("click", () => this.#runAt(Number(slider.value) - 1));
    $("#faster").addEventListener("click", () => this.#runAt(Number(slider.value) + 1));
    $("#stop").addEventListener("click", () => give(`stop ${train}`));
    $("#reverse").addEventListener("click", () => give(`reverse ${train}`));
    this.#lock.addEventListener("click", () => this.#lockTo(!this.isLocked));
    document.addEventListener("visibilitychange", this.#left);
    put(this.#lock, say("lock"));
  }

  get isLocked() {
    return document.body.classList.contains("locked");
  }

  #runAt(step) {
    const within = Math.min(Math.max(step, 0), Number(this.#slider.max));
    this.#slider.value = String(within);
    this.#give(`speed ${this.#train} ${within}`);
  }

  /** Shows only this throttle and the emergency stop, and stops the train when the page is hidden. */
  #lockTo(isLocked) {
    document.body.classList.toggle("locked", isLocked);
    this.#lock.setAttribute("aria-pressed", String(isLocked));
    put(this.#lock, say(isLocked ? "unlock" : "lock"));
  }

  /** A locked throttle that is hidden stops its train. */
  #left = () => {
    if (document.hidden && this.isLocked && this.#step > 0) orderAtOnce(`stop ${this.#train}`);
  };

  show({ step }, highest) {
    this.#step = step;
    if (highest) this.#slider.max = String(highest);
    if (this.isDragged) return;
    if (document.activeElement !== this.#slider) this.#slider.value = String(step);
    put(this.#shown, String(step));
  }

  close() {
    document.removeEventListener("visibilitychange", this.#left);
    this.#lockTo(false);
  }
}
