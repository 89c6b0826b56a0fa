// The throttle of a train: step, stop, reverse, light and functions, large enough for a thumb, and lockable to this train.

import { put } from "./dom.js";
import { orderAtOnce } from "./server.js";
import { say } from "./words.js";

/** The functions of a decoder: F0, which is the light, to F28. */
const FUNCTIONS = Array.from({ length: 29 }, (_, number) => number);
/** A step that was asked for is shown for this time, until the train has it (ms): presses in quick succession count on from it. */
const ASKED_FOR_MS = 1500;
/** The last function that every station can switch. */
const LAST_OF_ALL = 4;

export class Throttle {
  /** Whether the slider is being moved. */
  isDragged = false;
  #slider; #shown; #train; #lock; #give; #functions; #note; #asked; #askedAt = 0;

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
    this.#functions = FUNCTIONS.map((number) => {
      const button = document.createElement("button");
      button.type = "button";
      button.textContent = number === 0 ? say("light") : `F${number}`;
      button.setAttribute("aria-pressed", "false");
      button.addEventListener("click", () => {
        const isOn = button.getAttribute("aria-pressed") === "true";
        give(`function ${train} ${number} ${isOn ? "off" : "on"}`);
      });
      return button;
    });
    this.#note = document.createElement("small");
    $("#functions").append(...this.#functions.slice(0, LAST_OF_ALL + 1), this.#note);
    $("#more-functions .functions").append(...this.#functions.slice(LAST_OF_ALL + 1));
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
    put(this.#shown, String(within));
    [this.#asked, this.#askedAt] = [within, performance.now()];
    this.#give(`speed ${this.#train} ${within}`);
  }

  /** Shows only this throttle and the emergency stop, and stops the train when the page is hidden. */
  #lockTo(isLocked) {
    document.body.classList.toggle("locked", isLocked);
    this.#lock.setAttribute("aria-pressed", String(isLocked));
    put(this.#lock, say(isLocked ? "unlock" : "lock"));
  }

  /** A locked throttle that is hidden stops its train, also one that is at rest for a moment within a command. */
  #left = () => {
    if (document.hidden && this.isLocked) orderAtOnce(`stop ${this.#train}`);
  };

  show({ step, functions, functions_reported: reported }, highest) {
    FUNCTIONS.forEach((number) => this.#functions[number].setAttribute("aria-pressed", String(functions.includes(number))));
    const isUnreported = functions.some((number) => !reported.includes(number));
    put(this.#note, isUnreported ? say("functions-unreported") : "");
    if (highest) this.#slider.max = String(highest);
    if (step === this.#asked || performance.now() - this.#askedAt > ASKED_FOR_MS) this.#asked = undefined;
    if (this.isDragged || this.#asked !== undefined) return;
    this.#slider.value = String(step);
    put(this.#shown, String(step));
  }

  close() {
    document.removeEventListener("visibilitychange", this.#left);
    this.#lockTo(false);
  }
}
