// The page of one train: motion and detections, predicted stop, and commands.

import { TrainCharts } from "./train_charts.js";
import { make, put, shown, signed } from "./dom.js";
import { doingNow } from "./doing_now.js";
import { PickTrack } from "./pick_track.js";
import { showPortrait } from "./portrait.js";
import { kmPerHour } from "./scale.js";
import { order } from "./server.js";
import { Throttle } from "./throttle.js";
import { logged, say } from "./words.js";

/** Detections in the list; the charts show more. */
const LISTED = 40;

export function trainPage(root, live, number) {
  const train = Number(number);
  const $ = (selector) => root.querySelector(selector);
  $("h2").textContent = live.called(train);
  showPortrait($("#portrait"), train);
  const charts = new TrainCharts(root, live, train);
  /** Where the result of the last command is shown: beside its control. */
  let answer = $("#answer");

  async function give(line, beside = $("#answer")) {
    if (answer !== beside) put(answer, "");
    answer = beside;
    answer.className = "answer";
    put(answer, say("sent", line));
    try {
      await order(line);
    } catch (error) {
      refused(say("unread", error.message));
    }
  }

  function refused(text) {
    answer.className = "answer bad";
    put(answer, text);
  }

  const track = new PickTrack($("#track"), live.layout, (place) => {
    put($("#picked"), place ? say("picked-for", place, train) : say("pick-hint"));
    put($("#stop-at"), say("stop-here", place ?? "…"));
    put($("#go-to"), say("go-here", place ?? "…"));
    for (const id of ["#stop-at", "#go-to"]) $(id).disabled = !place;
    if (place) $("#arrive-at").value = place;
  });

  put($("#stop-at"), say("stop-here", "…"));
  put($("#go-to"), say("go-here", "…"));
  put($("#find"), say("find-train", train));
  put($("#say-where"), say("act-place", train));
  $("#say-where").href = `#/layout/${train}`;
  $("#find").addEventListener("click", () => give(`find ${train}`));
  const aim = () => ($("#not-beyond").checked ? " not-beyond 0.1%" : "");
  const stopping = () => `${$("#from-step").value ? ` at step ${$("#from-step").value}` : ""}${aim()}${$("#next-round").checked ? " next round" : ""}`;
  const arriving = () => `${$("#facing").checked ? " facing" : ""}${aim()}`;
  const throttle = new Throttle(root, train, give);
  $("#stop-at").addEventListener("click", () => track.place && give(`stop ${train} at ${track.place}${stopping()}`, $("#stop-answer")));
  $("#go-to").addEventListener("click", () => track.place && give(`go ${train} to ${track.place}${arriving()}`, $("#stop-answer")));
  const asks = (form, line) => $(form).addEventListener("submit", (event) => {
    event.preventDefault();
    give(line(new FormData(event.target)), event.target.querySelector(".answer"));
  });
  asks("#hold", (said) => `hold ${train} ${said.get("speed")}mm/s`);
  asks("#follow", (said) => `follow ${train} behind ${said.get("leader")} by ${said.get("gap")}${said.get("unit")}`);
  asks("#length", (said) => `length ${train} pickup ${said.get("pickup")}mm overhang ${said.get("overhang")}mm`);
  asks("#arrive", (said) => `arrive ${train} at ${said.get("at")} in ${said.get("in")}s`);
  asks("#move", (said) => `move ${train} ${said.get("way")}mm`);
  asks("#reverse-then", (said) => `reverse ${train} at step ${said.get("step")}`);

  function leaders(picture) {
    const others = picture.trains.map((other) => String(other.train)).filter((other) => other !== String(train));
    const select = $("#leader");
    if ([...select.options].map((option) => option.value).join() === others.join()) return;
    select.replaceChildren(...others.map((other) => new Option(say("train", other), other)));
    $("#follow").hidden = others.length === 0;
  }

  let due;
  function list() {
    const own = live.passed.filter((passed) => passed.train === train);
    const rows = own.slice(-LISTED).reverse().map((passed) => make("tr", {},
      make("th", { scope: "row" }, passed.contact),
      make("td", { class: "number" }, shown(passed.t_s, 2)),
      make("td", { class: "number" }, passed.late_ms == null ? say("found") : `${signed(passed.late_ms)} ± ${shown(passed.late_half_ms)}`),
      make("td", { class: "number" }, passed.short_mm == null ? "–" : signed(-passed.short_mm, 1)),
      make("td", { class: "number" }, passed.mean == null ? "–" : shown(passed.mean[1])),
      make("td", { class: "number" }, passed.missed > 0 ? String(passed.missed) : "–")));
    $("#passed").replaceChildren(...rows);
    due = own.at(-1)?.next;
  }

  function ends() {
    const own = live.ended.filter((ended) => ended.train === train && ended.achieved);
    const rows = own.slice(-LISTED).reverse().map((ended) => make("tr", {},
      make("th", { scope: "row" }, `${say(`did-${ended.command}`)} ${ended.target ?? ""}`),
      make("td", {}, ended.achieved),
      make("td", { class: "number" }, ended.error_mm == null ? "–" : signed(ended.error_mm, 1)),
      make("td", { class: "number" }, ended.promised_low_mm == null ? "–" : `${signed(ended.promised_low_mm)} … ${signed(ended.promised_high_mm)}`),
      make("td", { class: "number" }, ended.true_error_mm == null ? "–" : signed(ended.true_error_mm, 1))));
    $("#ends").replaceChildren(...rows);
    $("#ended").hidden = rows.length === 0;
  }

  list();
  ends();

  return {
    picture(picture) {
      track.show(picture);
      leaders(picture);
      const own = picture.trains.find((one) => one.train === train);
      $("#unknown").hidden = Boolean(own);
      if (!own) return put($("#unknown"), say("no-such-train", train));
      charts.goesOn(picture.t_s, own);
      put($("#now"), doingNow(own));
      $("#lost-does").hidden = Boolean(own.at);
      put($("#at"), own.at ? `${own.at} ± ${shown(own.half_mm)} mm` : say("nowhere"));
      put($("#speed"), own.at ? `${shown(own.speed_mm_per_s)} ± ${shown(own.speed_half_mm_per_s)} mm/s` : "–");
      put($("#km-per-hour"), own.at ? kmPerHour(own.speed_mm_per_s) : "–");
      put($("#busy"), own.doing ?? "–");
      const rest = own.if_stopped;
      put($("#if-stopped"), rest ? say("rest-way", shown(rest.way_mm), shown(rest.half_mm), rest.at ?? "?", shown(rest.in_s, 1)) : own.at_rest ? say("at-rest") : "–");
      put($("#due"), due && !own.at_rest ? say("due-in", due.contact, shown(Math.max(due.t_s - picture.t_s, 0), 1), shown(due.half_ms)) : "–");
      throttle.show(own, charts.highest);
    },
    passed(passed) {
      if (passed.train === train) { list(); charts.passed(passed); }
    },
    ended(ended) {
      if (ended.train !== train) return;
      if (ended.refused) refused(say("refused", logged(ended.refused)));
      else if (ended.achieved) put(answer, say("achieved", ended.achieved));
      ends();
    },
    anew() { charts.anew(); list(); ends(); },
    close() { throttle.close(); charts.close(); },
  };
}
