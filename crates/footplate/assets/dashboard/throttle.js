// The throttle of a train: step, stop, reverse, light and functions, large enough for a thumb, and lockable to this train.

import { put } from "./dom.js";
import { orderAtOnce } from "./server.js";
import { say } from "./words.js";

/** The functions that every station can switch: the light, which is F0, and F1 to F4. */
const FUNCTIONS = [0, 1, 2, 3, 4];

export class Throttle {
  /** Whether the slider is being moved. */
  isDragged = false;
  #slider; #shown; #train; #lock; #give; #functions; #note; #step = 0;

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
    $("#functions").append(...this.#functions, this.#note);
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

  show({ step, functions, functions_reported: reported }, highest) {
    this.#step = step;
    FUNCTIONS.forEach((number) => this.#functions[number].setAttribute("aria-pressed", String(functions.includes(number))));
    const isUnreported = functions.some((number) => !reported.includes(number));
    put(this.#note, isUnreported ? say("functions-unreported") : "");
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
