// What the run was, and what its books say: the line of facts, the impact looked at, the ledger, the rules.

import { element, numeric } from "./elements";
import type { Flight } from "./flight";
import { aligned, clockTime, commonPower, count, short } from "./format";
import { parties } from "./impacts";
import { AXES, type Recording, type Vector } from "./recording";

function inside(value: unknown, name: string): unknown {
  return typeof value === "object" && value !== null ? (value as Record<string, unknown>)[name] : undefined;
}

function asNumber(value: unknown): number | null {
  return typeof value === "number" ? value : null;
}

function lastOf(values: number[]): number | null {
  return values.length > 0 ? values[values.length - 1] : null;
}

function asVector(value: unknown): Vector | null {
  return Array.isArray(value) && value.length === 3 && value.every((x) => typeof x === "number") ? (value as Vector) : null;
}

/** The books at the end of the run: from the summary if it has them, else from the last sample. */
export function closingLedger(recording: Recording) {
  const { series, summary } = recording;
  const book = inside(summary, "ledger");
  const entry = (name: string, sampled: number | null) => asNumber(inside(book, name)) ?? sampled;
  const kinetic = entry("kinetic_energy", lastOf(series.kineticEnergy));
  const potential = entry("potential_energy", lastOf(series.potentialEnergy));
  const dissipated = entry("dissipated", lastOf(series.dissipated));
  const work = entry("work", lastOf(series.work));
  const first = series.time.length > 0 ? series.kineticEnergy[0] + series.potentialEnergy[0] : null;
  return {
    start: entry("energy_start", first),
    kinetic,
    potential,
    dissipated,
    work,
    energyError: entry("energy_error", lastOf(series.energyError)),
    momentum: asVector(inside(book, "momentum")) ?? series.momentum[series.momentum.length - 1] ?? null,
    angularMomentum: asVector(inside(book, "angular_momentum")),
    momentumStart: asVector(inside(inside(summary, "ledger_start"), "momentum")) ?? series.momentum[0] ?? null,
    fromWalls: asVector(inside(book, "wall_impulse")),
    fromGravity: asVector(inside(book, "gravity_impulse")),
    momentumError: asNumber(inside(book, "momentum_error")),
  };
}

/** The rules the run was made by: [what for, name, in words]. */
export function rules(recording: Recording): [string, string, string][] {
  const given = inside(recording.summary, "rules");
  if (typeof given !== "object" || given === null) return [];
  return Object.entries(given).filter(([, text]) => typeof text === "string").map(([what, text]) => {
    const [name, ...words] = String(text).split(/:\s+/);
    return [what, name, words.join(": ")];
  });
}

export function facts(recording: Recording): HTMLElement {
  const { bodies, impacts, version, gravity, timeStart } = recording;
  const error = closingLedger(recording).energyError;
  const pull = Math.hypot(...gravity);
  const items: (Node | string)[] = [
    `${count(bodies.total)} ${bodies.total === 1 ? "body" : "bodies"}`,
    `${count(impacts.total)} ${impacts.total === 1 ? "impact" : "impacts"}`,
    numeric(short(recording.duration, 5), recording.duration, "s"),
  ];
  if (pull > 0) items.push(element("span", {}, "gravity ", numeric(short(pull), pull, "m/s²")));
  if (error !== null) items.push(element("span", {}, "energy error ", numeric(short(error, 2), error)));
  const names = rules(recording).map(([what, name]) => element("span", { title: what }, name));
  if (names.length > 0) items.push(element("span", {}, "rules ", ...names.flatMap((name, i) => (i > 0 ? [", ", name] : [name]))));
  if (timeStart !== 0) items.push(element("span", {}, "clock from ", numeric(short(timeStart, 12), timeStart, "s")));
  if (version) items.push(`Carom ${version}`);
  return element("ul", { class: "facts" }, ...items.map((item) => element("li", {}, item)));
}

/** What of the run is not on the page, in plain words; empty if all of it is. */
export function missing(recording: Recording): string {
  const { impacts, bodies, replayUntil, duration } = recording;
  const said: string[] = [];
  if (impacts.count < impacts.total) {
    said.push(`This page carries the first ${count(impacts.count)} of ${count(impacts.total)} impacts.`);
  }
  if (replayUntil < duration && bodies.count === bodies.total) {
    said.push(`The replay ends at ${clockTime(replayUntil, duration)} s of ${clockTime(duration, duration)} s; plots and ledger cover the whole run.`);
  }
  if (bodies.count < bodies.total) said.push(`The bodies are not on this page (${count(bodies.total)} are too many); plots and ledger cover the whole run.`);
  if (said.length > 0) said.push("The run folder has everything.");
  return said.join(" ");
}

function angularAccount(angular: Vector): HTMLElement[] {
  const [power, written] = commonPower(angular);
  const alike = aligned(angular.map((l) => l / power), 4);
  return [element("tbody", {},
    element("tr", {}, element("th", { scope: "rowgroup", colspan: 4, class: "caption", title: "About the origin" },
      "Angular momentum", element("span", { class: "unit" }, `  ${written}kg·m²/s`))),
    element("tr", {}, element("th", { scope: "row" }, "Is"), ...angular.map((l) => element("td", {}, numeric(alike(l / power), l)))))];
}

/** Why the run ended before its time, if it did. */
export function ending(recording: Recording): string {
  const { summary } = recording;
  const status = inside(summary, "status");
  if (status === "interrupted") return `The run was interrupted at ${short(recording.duration, 6)} s; what is shown is complete up to there.`;
  if (status === "running") return "This report was made while the run was going on.";
  if (status !== "collapsed") return "";
  const error = inside(summary, "error");
  const message = inside(error, "message");
  return `The run was stopped. ${typeof message === "string" ? message : "Impacts piled up."}`;
}

type Line = [label: string, value: HTMLElement | string, kind?: "sum" | "note"];

function account(lines: Line[]): HTMLElement {
  return element("div", { class: "account" }, ...lines.map(([label, value, kind]) =>
    element("div", { class: `account-row ${kind ?? ""}` }, element("span", {}, label), typeof value === "string" ? element("span", { class: "number" }, value) : value)));
}

export function ledgerPanel(recording: Recording, flight: Flight): HTMLElement {
  const book = closingLedger(recording);
  const due = book.start === null ? null : book.start + (book.work ?? 0) - (book.dissipated ?? 0);
  const held = book.kinetic === null ? null : book.kinetic + (book.potential ?? 0);
  const energies = [book.start, book.work, book.dissipated, due, book.kinetic, book.potential, held];
  const alike = aligned(energies);
  const energy = (x: number | null) => numeric(alike(x), x);
  const error = (x: number | null) => numeric(short(x, 2), x);
  const said = rules(recording);
  const notes = inside(recording.summary, "notes");
  return element("section", { class: "card ledger", "aria-label": "Ledger" },
    element("h2", {}, "Ledger", element("span", { class: "unit" }, "  energy, J")),
    account([
      ["At the start", energy(book.start)],
      ["+ work from outside", energy(book.work)],
      ["− dissipated at impacts", energy(book.dissipated)],
      ["Should be left", energy(due), "sum"],
      ["Kinetic", energy(book.kinetic)],
      ["+ potential", energy(book.potential)],
      ["Is left", energy(held), "sum"],
      ["Relative error", error(book.energyError), "note"],
    ]),
    momentumAccount(book),
    account([
      ["Relative error", error(book.momentumError), "note"],
      ...(recording.impacts.count > 0 ? [["Replay to recorded contacts", numeric(short(flight.largestMismatch(), 2), flight.largestMismatch(), "m"), "note"] as Line] : []),
    ]),
    ...(said.length === 0 ? [] : [
      element("h3", {}, "Rules"),
      element("dl", { class: "rules" }, ...said.flatMap(([what, name, words]) => [
        element("dt", {}, what), element("dd", {}, element("b", {}, name), words ? ` – ${words}` : ""),
      ])),
    ]),
    ...(Array.isArray(notes) && notes.length > 0 ? [element("h3", {}, "Notes"), ...notes.map((note) => element("p", { class: "muted" }, String(note)))] : []),
  );
}

/** The momentum at the start, what planes, fixed bodies and gravity gave, and what there is, by component. */
function momentumAccount(book: ReturnType<typeof closingLedger>): HTMLElement {
  const lines: [string, Vector | null, string?][] = [
    ["Start", book.momentumStart],
    ["+ planes", book.fromWalls],
    ["+ gravity", book.fromGravity],
    ["Is", book.momentum, "sum"],
  ];
  const given = lines.filter(([label, v]) => v && (label === "Start" || label === "Is" || v.some((x) => x !== 0)));
  const all = given.flatMap(([, v]) => v ?? []);
  const [power, written] = commonPower(all);
  const alike = aligned(all.map((p) => p / power), 4);
  const cell = (p: number | undefined) => numeric(alike(p === undefined ? undefined : p / power), p);
  return element("table", { class: "components" },
    element("caption", {}, "Momentum", element("span", { class: "unit" }, `  ${written}kg·m/s`)),
    element("thead", {}, element("tr", {}, element("td"), ...["x", "y", "z"].map((name) => element("th", { scope: "col" }, name)))),
    element("tbody", {}, ...given.map(([label, v, kind]) => element("tr", { class: kind },
      element("th", { scope: "row" }, label), ...AXES.map((k) => element("td", {}, cell(v?.[k])))))),
    ...(book.angularMomentum ? angularAccount(book.angularMomentum) : []),
  );
}

const KEYS: [string, string][] = [
  ["space", "play, pause"], ["← →", "previous, next impact"], ["shift ← →", "back, on by a hundredth"], ["↑ ↓", "faster, slower"],
  ["S", "slow motion at every impact"], ["C", "close-up"], ["0", "whole scene"],
];

/** The impact looked at, in numbers; before there is one, how to get to one. */
export class Inspector {
  readonly root = element("section", { class: "card inspector", "aria-label": "Impact looked at", "aria-live": "polite" });
  private shown = -2;

  constructor(private readonly recording: Recording, private readonly flight: Flight) {
    this.show(-1);
  }

  show(impact: number): void {
    if (impact === this.shown) return;
    this.shown = impact;
    const { impacts, replayUntil } = this.recording;
    if (impact < 0) {
      this.root.replaceChildren(
        element("h2", {}, "Impact"),
        element("p", { class: "muted" }, impacts.count === 0
          ? "Nothing met anything in this run."
          : "Step to an impact, or press one in the table, to go into it in slow motion."),
        element("dl", { class: "keys" }, ...KEYS.flatMap(([keys, what]) => [
          element("dt", {}, ...keys.split(" ").map((key) => element("kbd", {}, key))), element("dd", {}, what),
        ])),
      );
      return;
    }
    const pair = parties(this.recording, this.flight, impact);
    const of = (values: Float64Array, unit: string) => numeric(short(values[impact], 6), values[impact], unit);
    const speed = (v: number[]) => {
      const shown = numeric(short(Math.hypot(...v), 4), Math.hypot(...v));
      shown.title = `(${v.join(", ")}) m/s`;
      return shown;
    };
    const spin = (w: number[]) => {
      const shown = numeric(short(Math.hypot(...w), 4), Math.hypot(...w));
      shown.title = `(${w.join(", ")}) rad/s`;
      return shown;
    };
    const n = [0, 1, 2].map((k) => impacts.normal[3 * impact + k]);
    this.root.replaceChildren(
      element("h2", {}, `Impact ${count(impact + 1)}`, element("span", { class: "unit" }, ` ${impacts.kinds[impacts.kind[impact]] ?? ""}`)),
      account([
        ["Time", numeric(clockTime(impacts.time[impact], replayUntil, 9), impacts.time[impact], "s")],
        ["Speed of approach", of(impacts.approachSpeed, "m/s")],
        ["Speed of separation", of(impacts.separationSpeed, "m/s")],
        ["Restitution", of(impacts.restitution, "")],
        ["Impulse", of(impacts.impulse, "N·s")],
        ["Energy lost", of(impacts.energyLost, "J")],
        ["Normal, b to a", numeric(`(${n.map((x) => short(x, 3)).join(", ")})`, `(${n.join(", ")})`)],
      ]),
      element("table", { class: "speeds" },
        element("thead", {}, element("tr", {}, element("th", { scope: "col" }, "Speed, m/s"),
          ...pair.map((party, i) => element("th", { scope: "col", title: `id ${party.id}` }, element("span", { class: "muted" }, i === 0 ? "a " : "b "), party.label)))),
        element("tbody", {},
          element("tr", {}, element("th", { scope: "row" }, "before"), ...pair.map((party) => element("td", {}, speed(party.before)))),
          element("tr", {}, element("th", { scope: "row" }, "after"), ...pair.map((party) => element("td", {}, speed(party.after))))),
        ...(this.recording.bodies.turning ? [element("tbody", {},
          element("tr", {}, element("th", { scope: "rowgroup", colspan: 3, class: "caption" }, "Angular speed, rad/s")),
          element("tr", {}, element("th", { scope: "row" }, "before"), ...pair.map((party) => element("td", {}, spin(party.spinBefore)))),
          element("tr", {}, element("th", { scope: "row" }, "after"), ...pair.map((party) => element("td", {}, spin(party.spinAfter)))))] : [])),
    );
  }
}
