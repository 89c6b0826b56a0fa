// The set-up of a railway: from the command station to the first stop, step by step.

import { aboutCalibration } from "./calibration_page.js";
import { doingNow } from "./doing_now.js";
import { make, put, shown, signed, svg } from "./dom.js";
import { ask, get, order } from "./server.js";
import { Track } from "./track.js";
import { inOwnLanguage, logged, say } from "./words.js";

const STEPS = ["station", "layout", "trains", "link", "calibrate", "stop"];
/** The stations that a serial port may lead to. */
const ON_A_PORT = ["marklin-serial", "dcc-ex", "marklin-can"];
/** How the address of a station in the network becomes a link. */
const LINKS = {
  "z21": (host) => `z21:${host}`,
  "marklin-can": (host) => `marklin-can:${host}`,
  "dcc-ex": (host) => `dcc-ex:tcp://${host.includes(":") ? host : `${host}:2560`}`,
  "loconet": (host) => `loconet:${host}`,
  "jmri": (host) => `jmri:${host}`,
  "marklin-serial": (host) => `marklin-serial:tcp://${host}`,
};

/** The last address of DCC decoders (NMRA S-9.2.1), before a station is chosen. */
const LAST_ADDRESS = 10_239;

/** Draws a layout as a whole. */
const drawn = (drawing, layout) => drawing.setAttribute("viewBox", new Track(drawing, layout).whole.join(" "));

/** The steps that are done. */
function done({ mode, link, layout, trains = [], line }) {
  const isCalibrated = mode === "driving" || trains.length > 0 && trains.every(({ is_calibrated: is }) => is);
  return mode === "setting-up"
    ? { station: link, layout, trains: trains.length > 0, link: line?.status === 0, calibrate: isCalibrated }
    : { station: true, layout: true, trains: true, link: true, calibrate: isCalibrated };
}

export function setupPage(root, live, wanted) {
  const $ = (selector) => root.querySelector(selector);
  const setUp = () => live.setUp;
  const isSettingUp = setUp().mode === "setting-up";
  const fixed = { calibrating: "calibrate", driving: "stop" }[setUp().mode];
  const step = fixed ?? (STEPS.includes(wanted) ? wanted : STEPS.find((name) => !done(setUp())[name]) ?? "stop");
  let isBusy = false;

  const named = ({ address, name }) => (name ? `${address} · ${name}` : String(address));
  const button = (text, does, more = {}) => {
    const made = make("button", { type: "button", ...more }, text);
    made.addEventListener("click", does);
    return made;
  };
  const answer = (text, isBad = false) => {
    put($("#setup-answer"), text);
    $("#setup-answer").classList.toggle("bad", isBad);
  };

  /** Carries out a request; only one at a time, and its controls are off meanwhile. */
  async function busy(text, work) {
    if (isBusy) return;
    isBusy = true;
    answer(text);
    $("#setup-step").setAttribute("aria-busy", "true");
    $("#setup-step").querySelectorAll("button").forEach((one) => { one.disabled = true; });
    try {
      await work();
      answer("");
    } catch (error) {
      answer(error.message, true);
    }
    isBusy = false;
    $("#setup-step").removeAttribute("aria-busy");
    $("#setup-step").querySelectorAll("button").forEach((one) => { one.disabled = false; });
  }

  /** Sends a step, and goes on to the next. */
  const send = (change, next) => busy(say("setup-saving"), async () => {
    live.setUp = await ask("/api/setup", change);
    if (next) location.hash = `#/setup/${next}`;
  });

  /** Another process takes over: the frame opens the page again when it answers. */
  const goOver = (path, body) => busy(say("setup-goes-over"), async () => {
    await ask(path, body);
    live.awaitsMode = true;
    // The same step is shown afterwards, with its result.
    history.replaceState(null, "", `#/setup/${step}`);
    await new Promise(() => {});
  });

  function report(result, isOpen) {
    if (!result) return "";
    const word = result.status === 0 ? "setup-done" : result.status === 1 ? "setup-short" : "setup-failed";
    return make("details", { open: isOpen || result.status !== 0 }, make("summary", { class: result.status === 0 ? "" : "answer bad" }, say(word)),
      make("pre", { tabIndex: 0, role: "region", "aria-label": say(word) }, inOwnLanguage(result.report)));
  }

  const build = {
    station() {
      const found = make("ul", { id: "stations", class: "plain cards", "aria-live": "polite" });
      const speed = make("select", { id: "sim-speed" }, ...[1, 4, 20].map((times) => new Option(say("setup-times", times), String(times))));
      speed.value = String(setUp().speed ?? 1);
      const use = (link, more = {}) => send({ link, ...more }, "layout");
      const simulated = make("li", { class: "card" }, make("h3", {}, say("setup-simulated")), make("p", {}, say("setup-simulated-about")),
        make("div", { class: "does fields" }, make("label", {}, make("span", {}, say("setup-pace")), speed),
          button(say("setup-use-simulated"), () => use("sim", { speed: Number(speed.value) }), { id: "use-simulated" })));
      async function search() {
        found.replaceChildren(make("li", { class: "quiet" }, say("setup-searching")));
        try {
          const stations = await get("/api/setup/stations");
          found.replaceChildren(...stations.map(({ kind, place, note }) => make("li", { class: "card" }, make("h3", {}, say(`station-${kind}`)),
            make("p", {}, [place, note].filter(Boolean).join(" · ")), make("div", { class: "does" }, ...(kind === "serial"
              ? ON_A_PORT.map((own) => button(say("setup-use", say(`station-${own}`)), () => use(`${own}:${place}`)))
              : [button(say("setup-use", say(`station-${kind}`)), () => use(place))])))));
          if (stations.length === 0) found.append(make("li", { class: "quiet" }, say("setup-none-found")));
        } catch (error) {
          found.replaceChildren(make("li", { class: "answer bad" }, error.message));
        }
      }
      const kind = make("select", { id: "station-kind" }, ...Object.keys(LINKS).map((name) => new Option(say(`station-${name}`), name)));
      const host = make("input", { id: "station-host", autocomplete: "off", spellcheck: false, placeholder: "192.168.0.111" });
      const typed = make("form", { class: "does fields" }, make("label", {}, make("span", {}, say("setup-kind")), kind),
        make("label", {}, make("span", {}, say("setup-host")), host), make("button", { type: "submit", id: "use-typed" }, say("setup-use-typed")));
      typed.addEventListener("submit", (event) => {
        event.preventDefault();
        if (!host.value.trim()) answer(say("setup-host-missing"), true);
        else use(LINKS[kind.value](host.value.trim()));
      });
      search();
      return [make("ul", { class: "plain cards" }, simulated), make("h3", {}, say("setup-found")), found,
        make("div", { class: "does search" }, button(say("setup-search"), search, { id: "search" })), make("h3", {}, say("setup-typed")), typed];
    },

    layout() {
      const file = make("input", { type: "file", id: "layout-file", accept: ".toml" });
      file.addEventListener("change", async () => {
        if (file.files[0]) send({ drawn: { toml: await file.files[0].text() } }, "trains");
      });
      return [make("p", {}, make("a", { href: "#/editor", id: "draw" }, say("setup-draw"))),
        make("p", {}, make("label", {}, `${say("setup-layout-file")} `, file)), make("h3", {}, say("setup-built-in")),
        make("div", { class: "does" }, ...setUp().layouts.map((name) => {
          const drawing = svg("svg", { "aria-hidden": "true" });
          // Without its drawing, a layout can still be chosen by its name.
          get(`/api/setup/layouts/${encodeURIComponent(name)}`).then((layout) => drawn(drawing, layout), () => drawing.remove());
          const choice = button(name, () => send({ layout: name }, "trains"), { "data-layout": name, class: "preview" });
          choice.prepend(drawing);
          return choice;
        }))];
    },

    trains() {
      const rows = make("div", { id: "train-rows" });
      const [first, last] = setUp().addresses ?? [1, LAST_ADDRESS];
      const add = ({ address = "", name = "" } = {}) => {
        const nth = rows.children.length + 1;
        const row = make("div", { class: "does fields", role: "group", "aria-label": say("setup-train-row", nth) },
          make("label", {}, make("span", {}, say("setup-address")), make("input", { type: "number", min: first, max: last, required: true, value: address, class: "address" })),
          make("label", {}, make("span", {}, say("setup-name")), make("input", { maxLength: 40, value: name, autocomplete: "off", class: "called" })));
        row.append(button(say("setup-remove"), () => row.remove()));
        rows.append(row);
      };
      const known = setUp().trains;
      (known.length ? known : [setUp().link === "sim" ? { address: 24 } : {}]).forEach(add);
      const form = make("form", {}, rows, make("div", { class: "does" }, button(say("setup-add"), () => add(), { id: "add-train" }),
        make("button", { type: "submit", id: "save-trains" }, say("setup-save"))));
      form.addEventListener("submit", (event) => {
        event.preventDefault();
        const trains = [...rows.children].map((row) => ({ address: Number(row.querySelector(".address").value), name: row.querySelector(".called").value.trim() }));
        send({ trains }, "link");
      });
      return [make("p", { class: "quiet" }, say("setup-address-about", first, last)), form];
    },

    link() {
      const check = () => busy(say("setup-checking"), async () => {
        live.setUp = await ask("/api/setup/doctor", {});
        show();
      });
      return [make("p", {}, say("setup-link-about")),
        make("div", { class: "does" }, button(say("setup-check"), check, { id: "check-link" }),
          setUp().line ? make("a", { href: "#/setup/calibrate", id: "link-next", class: "next" }, say("setup-next")) : ""), report(setUp().line, true)];
    },

    calibrate() {
      if (!isSettingUp) {
        return [make("p", { id: "calibrates", class: "now", role: "status" }, say("phase-finding")), make("progress", { id: "calibrated", max: 1, value: 0, "aria-label": say("time-used") }),
          make("p", { id: "time-left", class: "quiet" }), make("p", { id: "reached", class: "quiet" }), make("p", { class: "quiet" }, say("setup-calibrating-about")), make("ol", { id: "told", class: "plain", tabIndex: 0, "aria-label": say("said") })];
      }
      const clear = make("input", { type: "checkbox", id: "turnouts-clear" });
      const one = (train) => make("li", { class: "card" }, make("h3", {}, say("train", named(train))),
        make("p", {}, say(train.is_calibrated ? "setup-is-calibrated" : "setup-not-calibrated")),
        make("div", { class: "does" }, button(say(train.is_calibrated ? "setup-calibrate-more" : "setup-calibrate"), () => goOver("/api/setup/calibrate", { train: train.address, turnouts_are_clear: clear.checked }), { "data-calibrate": String(train.address) })),
        report(train.calibration, false));
      return [make("p", {}, say("setup-calibrate-about")), setUp().link === "sim" ? make("p", { class: "quiet" }, say("setup-calibrate-fast")) : "",
        make("p", {}, make("label", { class: "check" }, clear, ` ${say("setup-clear")}`)), make("ul", { class: "plain cards" }, ...setUp().trains.map(one)),
        make("p", {}, make("a", { href: "#/setup/stop", id: "calibrate-next", class: "next" }, say("setup-next")))];
    },

    stop() {
      if (isSettingUp) {
        return [make("p", {}, say("setup-drive-about")), make("div", { class: "does" }, button(say("setup-drive"), () => goOver("/api/setup/drive", {}), { id: "drive" }))];
      }
      const sensors = live.layout.nodes.filter(({ kind }) => kind === "contact").map(({ name }) => name);
      const train = make("select", { id: "first-train" }, ...setUp().trains.map((one) => new Option(named(one), String(one.address))));
      const place = make("select", { id: "first-place" }, ...sensors.map((name) => new Option(name, name)));
      const straight = () => busy(say("setup-setting"), () => order("turnout all straight"));
      const go = () => busy(say("setup-sending"), () => order(`go ${train.value} to ${place.value}`));
      return [make("div", { id: "first-turnouts" }, make("p", {}, say("setup-turnouts-unknown")), button(say("setup-straight"), straight, { id: "all-straight" })),
        make("div", { id: "first-lost" }),
        make("div", { id: "first-go", class: "does fields", hidden: true }, make("label", {}, make("span", {}, say("setup-train")), train),
          make("label", {}, make("span", {}, say("setup-place")), place), button(say("setup-go"), go, { id: "go" })),
        make("p", { id: "first-does", class: "now", role: "status" }), make("p", { id: "first-result", role: "status" }),
        make("p", {}, make("a", { href: "#/layout", id: "to-layout" }, say("setup-to-layout")))];
    },
  };

  /** The way back from a session. */
  async function again() {
    await ask("/api/setup/again", {});
    if (setUp().mode === "calibrating") await ask("/api/emergency-stop", {});
    else await order("quit");
    live.awaitsMode = true;
  }

  function show() {
    const ready = done(setUp());
    $("#setup-steps").replaceChildren(...STEPS.map((name, nth) => {
      const text = `${nth + 1}. ${say(`setup-${name}`)}`;
      const isHere = name === step;
      const inside = isSettingUp ? make("a", { href: `#/setup/${name}`, ...(isHere && { "aria-current": "step" }) }, text) : make("span", isHere ? { "aria-current": "step" } : {}, text);
      return make("li", { class: ready[name] ? "ready" : "" }, inside, ready[name] ? make("span", { class: "quiet" }, ` ${say("setup-ready")}`) : "");
    }));
    put($("#setup-heading"), say(`setup-${step}-heading`));
    $("#setup-step").replaceChildren(...build[step]());
    $("#setup-back").hidden = isSettingUp;
    const nth = STEPS.indexOf(step);
    $("#setup-before").hidden = !isSettingUp || nth === 0;
    if (nth > 0) $("#setup-before").href = `#/setup/${STEPS[nth - 1]}`;
    put($("#setup-chosen"), isSettingUp ? [setUp().link && say("setup-has-link", setUp().link === "sim" ? say("setup-simulated") : setUp().link), setUp().layout && say("setup-has-layout", setUp().layout)].filter(Boolean).join(" · ") : "");
    $("#setup-problem").hidden = !setUp().problem;
    put($("#setup-problem"), setUp().problem ? say("setup-problem", setUp().problem) : "");
  }

  $("#setup-again").addEventListener("click", () => busy(say("setup-goes-over"), again));
  show();

  /** A train goes nowhere while the position of another one is unknown: the page offers to find that one. */
  function lost({ trains }) {
    const place = $("#first-lost");
    const unknown = trains.filter(({ at }) => !at).map(({ train }) => train);
    const shown = trains.length > 1 && $("#first-turnouts").hidden ? unknown : [];
    if (place.dataset.trains === shown.join()) return;
    place.dataset.trains = shown.join();
    place.replaceChildren(...(shown.length ? [make("p", {}, say("setup-lost", shown.map((train) => live.called(train)).join(", ")))] : []), ...shown.map((train) => make("div", { class: "does" },
      button(say("find-train", train), () => busy(say("setup-sending"), () => order(`find ${train}`))),
      make("a", { href: `#/layout/${train}` }, say("act-place", train)))));
  }

  const lines = () => {
    if (!$("#told")) return;
    $("#told").replaceChildren(...live.lines.slice(-12).map(({ text }) => make("li", {}, logged(text))));
  };
  lines();
  return {
    picture(picture) {
      if (step === "calibrate" && picture.calibration) {
        const { elapsed_s: elapsed, left_s: left, expected } = picture.calibration;
        put($("#calibrates"), aboutCalibration(picture.calibration));
        $("#calibrated").value = elapsed / Math.max(1, elapsed + left);
        put($("#time-left"), say("setup-time-left", `${Math.floor(left / 60)}:${String(Math.floor(left % 60)).padStart(2, "0")}`));
        put($("#reached"), expected ? say("setup-reached", expected.step, shown(expected.stop_within_mm), shown(expected.speed_within_percent, 1)) : "");
      }
      if (step === "stop" && !isSettingUp) {
        const isKnown = Object.values(picture.turnouts).every(Boolean);
        $("#first-turnouts").hidden = isKnown;
        $("#first-go").hidden = !isKnown;
        lost(picture);
        const own = picture.trains.find(({ train }) => String(train) === $("#first-train").value);
        put($("#first-does"), own?.doing ? `${live.called(own.train)}: ${doingNow(own)}` : "");
      }
    },
    line: lines,
    ended({ train, achieved, error_mm: error, promised_low_mm: low, promised_high_mm: high, refused, true_error_mm: truth }) {
      if (!$("#first-result") || (achieved == null && !refused)) return;
      const parts = refused ? [say("refused", logged(refused))] : [say("setup-stopped", train, achieved ?? "", error == null ? "" : signed(error, 1)),
        low == null ? "" : say("setup-promised", signed(low), signed(high)), truth == null ? "" : say("setup-truth", signed(truth, 1))];
      put($("#first-result"), parts.filter(Boolean).join(" "));
    },
  };
}
