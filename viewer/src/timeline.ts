// The controls of the clock: play, step, speed, slow motion, and the strip that shows where impacts are dense.

import { FASTEST, SLOWEST, type Clock } from "./clock";
import { drawIcon, element, iconButton, setText } from "./elements";
import { clockTime, span } from "./format";
import { themeColour } from "./colours";
import type { Recording } from "./recording";

const DECADES = Math.log10(FASTEST / SLOWEST);

export class Timeline {
  readonly root: HTMLElement;
  private readonly play: HTMLButtonElement;
  private readonly strip: HTMLElement;
  private readonly canvas = element("canvas", { "aria-hidden": "true" });
  private readonly hand = element("div", { class: "hand" });
  private readonly now = element("output", { class: "now", "aria-live": "off" });
  private readonly rate = element("span", { class: "rate" });
  private readonly speed: HTMLInputElement;
  private readonly slow: HTMLButtonElement;
  private shownPlaying: boolean | null = null;

  constructor(
    private readonly recording: Recording,
    private readonly clock: Clock,
    /** Called after a control has changed the clock. */
    private readonly changed: () => void,
    private readonly still: boolean,
  ) {
    this.play = iconButton("play", "Play (space)", () => this.toggle());
    this.play.classList.add("play");
    const previous = iconButton("previous", "Previous impact (←)", () => this.step(-1));
    const next = iconButton("next", "Next impact (→)", () => this.step(1));
    if (clock.times.length === 0) previous.disabled = next.disabled = true;

    this.speed = element("input", {
      type: "range", min: 0, max: 1, step: "any", value: this.fromSpeed(1), "aria-label": "Speed of the replay", title: "Speed (↑ ↓); double-click: normal",
    });
    this.speed.addEventListener("input", () => this.setSpeed(SLOWEST * 10 ** (Number(this.speed.value) * DECADES)));
    this.speed.addEventListener("dblclick", () => this.setSpeed(1));
    this.slow = element("button", { type: "button", class: "toggle", "aria-pressed": "false", title: "Slow down around every impact (S)" }, "Slow motion");
    this.slow.addEventListener("click", () => this.toggleSlow());
    if (clock.times.length === 0) this.slow.disabled = true;

    this.strip = element("div", {
      class: "strip", role: "slider", tabindex: 0, "aria-label": "Time of the replay", "aria-valuemin": 0, "aria-valuemax": clock.end, "aria-orientation": "horizontal",
    }, this.canvas, this.hand);
    this.strip.addEventListener("pointerdown", (event) => {
      this.strip.setPointerCapture(event.pointerId);
      this.drag(event);
    });
    this.strip.addEventListener("pointermove", (event) => {
      if (this.strip.hasPointerCapture(event.pointerId)) this.drag(event);
    });

    this.root = element("div", { class: "timeline", role: "group", "aria-label": "Replay controls" },
      this.strip,
      element("div", { class: "controls" },
        element("div", { class: "buttons" }, previous, this.play, next),
        this.now,
        element("label", { class: "speed" }, element("span", {}, "Speed"), this.speed, this.rate),
        this.slow,
      ),
    );
    new ResizeObserver(() => this.drawStrip()).observe(this.strip);
  }

  toggle(): void {
    this.clock.toggle();
    this.changed();
  }

  step(direction: 1 | -1): void {
    if (this.clock.times.length === 0) return;
    this.clock.step(direction, this.still);
    this.changed();
  }

  scrub(share: number): void {
    this.clock.seek(this.clock.time + share * this.clock.end);
    this.changed();
  }

  toggleSlow(): void {
    this.clock.slowMotion = !this.clock.slowMotion;
    this.slow.setAttribute("aria-pressed", String(this.clock.slowMotion));
    this.changed();
  }

  setSpeed(speed: number): void {
    // Normal speed is easy to hit again.
    const near = Math.abs(Math.log10(speed)) < 0.12 ? 1 : speed;
    this.clock.speed = Math.min(Math.max(near, SLOWEST), FASTEST);
    this.speed.value = String(this.fromSpeed(this.clock.speed));
    this.changed();
  }

  faster(factor: number): void {
    this.setSpeed(this.clock.speed * factor);
  }

  private fromSpeed(speed: number): number {
    return Math.log10(speed / SLOWEST) / DECADES;
  }

  private drag(event: PointerEvent): void {
    const box = this.strip.getBoundingClientRect();
    this.clock.pause();
    this.clock.seek(((event.clientX - box.left) / box.width) * this.clock.end);
    this.changed();
  }

  /** Shows the clock as it is now. */
  show(): void {
    const { clock } = this;
    if (this.shownPlaying !== clock.playing) {
      this.shownPlaying = clock.playing;
      this.play.replaceChildren(drawIcon(clock.playing ? "pause" : "play"));
      const label = clock.playing ? "Pause (space)" : "Play (space)";
      this.play.setAttribute("aria-label", label);
      this.play.title = label;
    }
    const share = clock.end > 0 ? clock.time / clock.end : 0;
    this.hand.style.transform = `translateX(${share * this.strip.clientWidth}px)`;
    setText(this.now, `${clockTime(clock.time, clock.end)} s`);
    setText(this.rate, `1 s shows ${span(clock.rate())}`);
    this.strip.setAttribute("aria-valuenow", String(clock.time));
    this.strip.setAttribute("aria-valuetext", `${clockTime(clock.time, clock.end)} of ${clockTime(clock.end, clock.end)} seconds`);
  }

  /** One bar for each few pixels: how many impacts happen in that stretch of time. */
  drawStrip(): void {
    const width = this.strip.clientWidth;
    const height = this.strip.clientHeight;
    const sharp = Math.min(devicePixelRatio, 2);
    this.canvas.width = width * sharp;
    this.canvas.height = height * sharp;
    const paint = this.canvas.getContext("2d");
    if (!paint || width === 0) return;
    paint.scale(sharp, sharp);
    const step = 3;
    const bins = new Int32Array(Math.max(1, Math.floor(width / step)));
    const { time } = this.recording.impacts;
    for (const t of time) bins[Math.min(bins.length - 1, Math.max(0, Math.floor((t / (this.clock.end || 1)) * bins.length)))]++;
    let most = 1;
    for (const bin of bins) most = Math.max(most, bin);
    paint.fillStyle = themeColour("bar");
    const room = height - 14;
    bins.forEach((bin, i) => {
      if (bin === 0) return;
      const tall = Math.max(3, (room * Math.log1p(bin)) / Math.log1p(most));
      paint.fillRect(i * step, height - 4 - tall, step - 1, tall);
    });
    this.show();
  }
}
