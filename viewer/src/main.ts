// Start-up: reads the data out of the page, puts the parts together, and runs the loop that keeps them at one time.

import { Clock } from "./clock";
import type { Colouring } from "./colours";
import { copyWholeNumbers, element, iconButton, setText } from "./elements";
import { Flight, lastAtOrBefore } from "./flight";
import { count, short } from "./format";
import { bodyLabel, ImpactOverlay, slowWindows } from "./impacts";
import { ending, facts, Inspector, ledgerPanel, missing } from "./panel";
import { Plots } from "./plots";
import { parseRecording, type Recording, type Vector } from "./recording";
import { Stage } from "./stage";
import "./style.css";
import { ImpactTable } from "./table";
import { Timeline } from "./timeline";

/** Balls smaller than this on the screen are worth moving in on (CSS pixels). */
const SMALL = 15;

const page = document.querySelector("main") as HTMLElement;

function say(title: string, ...lines: (Node | string)[]): void {
  page.replaceChildren(element("section", { class: "message" }, element("h1", {}, title), ...lines.map((line) => element("p", {}, line))));
}

function start(): void {
  const data = document.getElementById("carom-data");
  if (!data) {
    say("No run in this page yet", "This is the empty page that Carom fills with a run.",
      element("span", {}, "To make a full one: ", element("code", {}, "carom run SCENE"), ", then open report.html in the run folder; or ", element("code", {}, "carom report RUN"), "."));
    return;
  }
  try {
    show(parseRecording(data.textContent ?? ""));
    data.remove();
  } catch (error) {
    say("This run cannot be shown", error instanceof Error ? error.message : String(error));
    console.error(error);
  }
}

function show(recording: Recording): void {
  document.title = `${recording.title} – Carom`;
  const flight = new Flight(recording);
  const still = matchMedia("(prefers-reduced-motion: reduce)").matches;
  const base = new Clock([], [], recording.replayUntil).base;
  const clock = new Clock(recording.impacts.time, slowWindows(recording, flight, base), recording.replayUntil);

  const host = element("div", { class: "stage" });
  const inspector = new Inspector(recording, flight);
  const tools = element("div", { class: "tools" });
  const table = new ImpactTable(recording, flight, (impact) => goTo(impact));
  const timeline = new Timeline(recording, clock, () => wake(), still);
  const plots = new Plots(recording, (time) => {
    clock.pause();
    clock.seek(time);
    wake();
  });
  page.replaceChildren(
    element("header", { class: "title" }, element("h1", {}, recording.title), facts(recording)),
    element("div", { class: "top" }, element("div", { class: "column" },
      element("section", { class: "card replay", "aria-label": "Replay" }, element("header", {}, element("h2", {}, "Replay"), tools), host, timeline.root,
        ...[ending(recording), missing(recording)].filter((text) => text !== "").map((text) => element("p", { class: "gap", role: "note" }, text))),
      plots.root),
    element("aside", { class: "column" }, inspector.root, ledgerPanel(recording, flight))),
    table.root,
  );

  // What the loop remembers.
  let last = 0;
  let asked = false;
  let seenFocus = -2;
  let movedIn = false;

  let stage: Stage | null = null;
  let overlay: ImpactOverlay | null = null;
  const { bodies } = recording;
  if (bodies.count === 0 && bodies.total > 0) {
    host.append(element("p", { class: "nothing" }, `${count(bodies.total)} bodies: too many to be replayed on a page.`));
  } else {
    try {
      stage = new Stage(recording, flight, host);
      overlay = new ImpactOverlay(recording, flight, stage);
      host.append(overlay.drawing, overlay.tag);
    } catch (error) {
      host.append(element("p", { class: "nothing" }, "The replay needs WebGL 2, which this browser does not offer here. Plots, ledger and table work without it."));
      console.warn(error);
    }
  }

  // --- tools at the corner of the picture ---
  let closeUp = false;
  const toggles: Record<string, HTMLButtonElement> = {};
  if (stage) {
    const scene = stage;
    const toggle = (name: string, label: string, tip: string, set: (on: boolean) => void) => {
      const button = element("button", { type: "button", class: "toggle", "aria-pressed": "false", title: tip }, label);
      button.addEventListener("click", () => {
        const on = button.getAttribute("aria-pressed") !== "true";
        button.setAttribute("aria-pressed", String(on));
        set(on);
        wake();
      });
      toggles[name] = button;
      return button;
    };
    const colours = element("select", { "aria-label": "Colour of the bodies" },
      ...scene.palette.ways.map((how) => element("option", { value: how, selected: how === scene.palette.start }, how)));
    colours.addEventListener("change", () => {
      scene.colourBy(colours.value as Colouring);
      wake();
    });
    tools.append(element("label", {}, element("span", {}, "Colour"), colours));
    if (scene.hasPaths) {
      tools.append(toggle("paths", "Paths", "The way each body has come", (on) => scene.showPaths(on)));
      if (recording.bodies.count <= 20) toggles.paths.click();
    }
    if (recording.impacts.count > 0) {
      tools.append(toggle("closeUp", "Close-up", "Move in on the impact looked at (C)", (on) => {
        closeUp = on;
        seenFocus = -2;
      }));
    }
    tools.append(iconButton("whole", "Whole scene (0)", () => {
      scene.showWhole();
      wake();
    }));
    host.style.setProperty("--aspect", String(Math.min(Math.max(stage.aspect, 0.9), 1.9)));
  }
  const key = element("div", { class: "key", hidden: true },
    ...(stage?.crowd && !stage.view.flat ? [element("span", { class: "plain" }, recording.geometries.length > 0 ? "bodies in front left out" : "balls in front left out")] : []),
    ...[["before", recording.bodies.turning ? "velocity and spin before" : "velocity before"], ["after", "after"], ["normal", "normal, b to a"]].map(([kind, words]) => element("span", { class: kind }, words)));
  const hover = element("div", { class: "hover", hidden: true });
  host.append(key, hover);

  // --- the loop ---
  function wake(): void {
    if (asked) return;
    asked = true;
    requestAnimationFrame(frame);
  }

  function frame(now: number): void {
    asked = false;
    const seconds = Math.min(0.1, last > 0 ? (now - last) / 1000 : 0);
    last = now;
    clock.advance(seconds);
    clock.rate();
    const { focus } = clock;
    if (focus !== seenFocus) {
      seenFocus = focus;
      if (focus >= 0) inspector.show(focus);
      key.hidden = focus < 0 || !stage;
      moveCamera(focus);
    }
    table.select(focus >= 0 ? focus : lastAtOrBefore(clock.times, clock.time), focus >= 0);
    timeline.show();
    plots.show(clock.time);
    if (stage) {
      stage.draw(clock.time, focus >= 0 ? [flight.rowA[focus], flight.rowB[focus]] : null, seconds);
      overlay?.draw(focus);
    }
    if (clock.playing || stage?.dirty) wake();
    else last = 0;
  }

  function moveCamera(focus: number): void {
    if (!stage) return;
    if (focus < 0 || !closeUp) {
      if (movedIn) stage.closeUp(null);
      movedIn = false;
      return;
    }
    const place = [0, 1, 2].map((k) => recording.impacts.point[3 * focus + k]) as Vector;
    const radii = [flight.rowA[focus], flight.rowB[focus]].filter((row) => row >= 0).map((row) => recording.bodies.radius[row]);
    stage.closeUp(place, Math.max(7 * Math.min(...radii), 3.2 * Math.max(...radii)), still);
    movedIn = true;
  }

  function goTo(impact: number): void {
    clock.goTo(impact, still);
    wake();
    const box = host.getBoundingClientRect();
    if (box.bottom < 120 || box.top > innerHeight - 120) host.scrollIntoView({ behavior: still ? "auto" : "smooth", block: "center" });
  }

  // --- pointing at bodies ---
  function under(event: PointerEvent | MouseEvent): number {
    const box = host.getBoundingClientRect();
    return stage?.bodyAt(event.clientX - box.left, event.clientY - box.top) ?? -1;
  }
  stage?.canvas.addEventListener("pointermove", (event) => {
    const row = event.buttons === 0 ? under(event) : -1;
    hover.hidden = row < 0;
    host.classList.toggle("pointing", row >= 0);
    if (row < 0) return;
    const id = recording.bodies.id[row];
    const v = flight.velocityAt(row, clock.time);
    const spin = Math.hypot(...flight.angularVelocityAt(row, clock.time));
    const label = bodyLabel(recording, row, id);
    setText(hover, `${label}${recording.bodies.name?.[row] ? ` (id ${id})` : ""} · ${short(Math.hypot(v[0], v[1], v[2]), 3)} m/s${spin > 0 ? ` · ${short(spin, 3)} rad/s` : ""}`);
    const box = host.getBoundingClientRect();
    hover.style.transform = `translate(${Math.min(event.clientX - box.left + 14, box.width - 190)}px, ${event.clientY - box.top + 14}px)`;
  });
  stage?.canvas.addEventListener("pointerleave", () => (hover.hidden = true));
  let pressed: [number, number] = [0, 0];
  stage?.canvas.addEventListener("pointerdown", (event) => (pressed = [event.clientX, event.clientY]));
  stage?.canvas.addEventListener("click", (event) => {
    if (Math.hypot(event.clientX - pressed[0], event.clientY - pressed[1]) > 4) return;
    const row = under(event);
    if (row >= 0) table.filterBy(recording.bodies.name?.[row] ?? String(recording.bodies.id[row]));
  });
  for (const event of ["pointermove", "wheel", "pointerup"]) stage?.canvas.addEventListener(event, () => wake(), { passive: true });

  // --- keys ---
  document.addEventListener("keydown", (event) => {
    const target = event.target as HTMLElement;
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    if (target instanceof HTMLSelectElement || (target instanceof HTMLInputElement && target.type !== "range")) return;
    if (event.key === " " && target instanceof HTMLButtonElement) return;
    if (target instanceof HTMLInputElement && event.key.startsWith("Arrow")) return;
    if (target.classList.contains("scroller") && ["ArrowUp", "ArrowDown", " "].includes(event.key)) return;
    const along = event.key === "ArrowRight" ? 1 : -1;
    const acts: Record<string, () => void> = {
      " ": () => timeline.toggle(),
      ArrowRight: () => (event.shiftKey ? timeline.scrub(0.01 * along) : timeline.step(along)),
      ArrowLeft: () => (event.shiftKey ? timeline.scrub(0.01 * along) : timeline.step(along)),
      ArrowUp: () => timeline.faster(10 ** 0.25),
      ArrowDown: () => timeline.faster(10 ** -0.25),
      Home: () => timeline.scrub(-1),
      End: () => timeline.scrub(1),
      s: () => timeline.toggleSlow(),
      c: () => toggles.closeUp?.click(),
      0: () => {
        stage?.showWhole();
        wake();
      },
    };
    const act = acts[event.key.length === 1 ? event.key.toLowerCase() : event.key];
    if (!act) return;
    act();
    event.preventDefault();
  });

  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => {
    stage?.restyle();
    plots.draw();
    timeline.drawStrip();
    wake();
  });
  new ResizeObserver(() => wake()).observe(host);
  copyWholeNumbers();

  if (stage && toggles.closeUp) {
    // Balls too small to be seen meeting: go near when one asks for an impact.
    const radii = recording.bodies.radius.filter((r) => r > 0).sort();
    const usual = radii[radii.length >> 1] ?? 0;
    const middle = [0, 1, 2].map((k) => (stage.view.low[k] + stage.view.high[k]) / 2) as Vector;
    if (usual < SMALL * stage.pixelAt(middle)) toggles.closeUp.click();
  }
  plots.draw();
  if (!still) clock.toggle();
  wake();
  performance.mark("carom-open");
}

start();
