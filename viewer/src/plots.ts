// Energy, momentum and the error of energy over the run, each with a hand that shows the time of the replay.

import uPlot from "uplot";
import "uplot/dist/uPlot.min.css";
import { themeColour } from "./colours";
import { element, setText } from "./elements";
import { lastAtOrBefore } from "./flight";
import { short } from "./format";
import type { Recording } from "./recording";

interface Curve {
  label: string;
  colour: string;
  /** What is drawn. */
  drawn: number[];
  /** What is told in the legend. */
  values: number[];
  /** Filled down to the curve before it. */
  filled?: boolean;
  /** Drawn on top as a thin line. */
  line?: boolean;
}

interface Plot {
  root: HTMLElement;
  holder: HTMLElement;
  curves: () => Curve[];
  legend: HTMLElement;
  chart: uPlot | null;
  hand: HTMLElement;
  figures: HTMLElement[];
  shown: Curve[];
}

const HEIGHT = 200;
/** Opacity of filled areas, as two hexadecimal digits. */
const FILL = "8c";

export class Plots {
  readonly root = element("div", { class: "plots" });
  private readonly plots: Plot[];
  private hovered: number | null = null;
  private time = 0;
  private readonly times: number[];

  constructor(private readonly recording: Recording, private readonly seek: (time: number) => void) {
    const { series } = recording;
    this.times = series.time;
    this.plots = [
      this.make("Energy", "J", () => this.energy()),
      this.make("Momentum", "kg·m/s", () => {
        const curves = ["x", "y", "z"].map((name, k) => {
          const values = series.momentum.map((p) => p[k]);
          return { label: name, colour: themeColour(`series-${name}`), drawn: values, values };
        });
        const moving = curves.filter((curve) => curve.values.some((p) => p !== 0));
        return moving.length > 0 ? moving : curves;
      }),
      this.make("Energy error", "relative", () => [
        { label: "error", colour: themeColour("series-error"), drawn: series.energyError, values: series.energyError },
      ]),
    ];
    this.root.append(...this.plots.map((plot) => plot.root));
    for (const plot of this.plots) new ResizeObserver(() => this.fit(plot)).observe(plot.holder);
  }

  /**
   * Stacked: kinetic, potential and dissipated energy fill the height up to what there was at the start plus the work done from
   * outside, which is a curve of its own. The ledger closes where the stack meets the curve.
   */
  private energy(): Curve[] {
    const { kineticEnergy, potentialEnergy, dissipated, work } = this.recording.series;
    // The zero of potential energy is free; for stacking it is its lowest value.
    const lowest = potentialEnergy.reduce((low, p) => Math.min(low, p), Infinity);
    const potential = potentialEnergy.map((p) => p - lowest);
    const start = (kineticEnergy[0] ?? 0) + (potential[0] ?? 0) + (dissipated[0] ?? 0) - (work[0] ?? 0);
    const present = (values: number[]) => values.some((x) => x !== 0);
    const curves: Curve[] = [{ label: "kinetic", colour: themeColour("series-kinetic"), drawn: kineticEnergy, values: kineticEnergy, filled: true }];
    const stack = (label: string, colour: string, add: number[], values: number[]) => {
      const below = curves[curves.length - 1].drawn;
      curves.push({ label, colour: themeColour(colour), drawn: below.map((x, i) => x + add[i]), values, filled: true });
    };
    if (present(potential)) stack("potential", "series-potential", potential, potentialEnergy);
    if (present(dissipated)) stack("dissipated", "series-dissipated", dissipated, dissipated);
    curves.push({
      label: present(work) ? "start + work" : "at the start",
      colour: themeColour("ink"),
      drawn: work.map((w) => start + w),
      values: work.map((w) => start + lowest + w),
      line: true,
    });
    return curves;
  }

  private make(title: string, unit: string, curves: () => Curve[]): Plot {
    const legend = element("div", { class: "legend" });
    const holder = element("div", { class: "chart" });
    const root = element("figure", { class: "card plot" },
      element("figcaption", {}, element("h2", {}, title), element("span", { class: "unit" }, unit)), legend, holder);
    return { root, holder, curves, legend, chart: null, hand: element("div", { class: "plot-hand" }), figures: [], shown: [] };
  }

  /** Draws everything anew, in the present colours. */
  draw(): void {
    for (const plot of this.plots) this.drawOne(plot);
    this.show(this.time);
  }

  private fit(plot: Plot): void {
    const width = plot.holder.clientWidth;
    if (width > 0 && !plot.chart) this.drawOne(plot);
    else if (width > 0 && plot.chart && plot.chart.width !== width) plot.chart.setSize({ width, height: HEIGHT });
    this.show(this.time);
  }

  private drawOne(plot: Plot): void {
    plot.chart?.destroy();
    plot.chart = null;
    const width = plot.holder.clientWidth;
    if (width === 0) return;
    if (this.times.length === 0) {
      plot.holder.replaceChildren(element("p", { class: "nothing" }, "No samples were recorded."));
      return;
    }
    const curves = plot.curves();
    plot.shown = curves;
    plot.figures = curves.map(() => element("span", { class: "number" }));
    plot.legend.replaceChildren(...curves.map((curve, i) => {
      const swatch = element("span", { class: curve.line ? "swatch line" : "swatch" });
      swatch.style.background = curve.colour;
      return element("span", { class: "entry" }, swatch, element("span", {}, curve.label), plot.figures[i]);
    }));
    const axis = {
      stroke: themeColour("muted"), font: "11px system-ui, sans-serif",
      grid: { stroke: themeColour("line"), width: 1 }, ticks: { show: false },
    };
    const lows = curves.flatMap((curve) => curve.drawn).filter(Number.isFinite);
    const low = lows.reduce((a, b) => Math.min(a, b), 0);
    const high = lows.reduce((a, b) => Math.max(a, b), 0);
    const filled = curves.filter((curve) => curve.filled).length;
    const options: uPlot.Options = {
      width,
      height: HEIGHT,
      padding: [10, 12, 0, 0],
      legend: { show: false },
      cursor: { sync: { key: "carom" }, y: false, points: { size: 5 }, drag: { x: false, y: false } },
      scales: {
        x: { time: false, range: (_, from, to) => (from === to ? [from - 0.5, to + 0.5] : [from, to]) },
        y: { range: () => (high > low ? [low, high + 0.06 * (high - low)] : low === 0 ? [-1, 1] : [Math.min(0, 1.1 * low), Math.max(0, 1.1 * high)]) },
      },
      axes: [
        { ...axis, values: (_, ticks) => ticks.map((t, i) => (i === 0 ? `${short(t, 4)} s` : short(t, 4))), space: 70, size: 30 },
        { ...axis, values: (_, ticks) => ticks.map((x) => short(x, 3)), size: 62, space: 36 },
      ],
      series: [{}, ...curves.map((curve, i): uPlot.Series => ({
        label: curve.label,
        stroke: curve.colour,
        width: curve.filled ? 1 : 1.5,
        fill: curve.filled && i === 0 ? `${curve.colour}${FILL}` : undefined,
        points: { show: this.times.length === 1 },
      }))],
      bands: Array.from({ length: Math.max(0, filled - 1) }, (_, i) => ({ series: [i + 2, i + 1] as [number, number], fill: `${curves[i + 1].colour}${FILL}` })),
      hooks: {
        setCursor: [(chart) => {
          const index = chart.cursor.idx;
          this.hovered = index === null || index === undefined || (chart.cursor.left ?? -1) < 0 ? null : index;
          this.tell();
        }],
      },
    };
    plot.holder.replaceChildren();
    plot.chart = new uPlot(options, [this.times, ...curves.map((curve) => curve.drawn)], plot.holder);
    plot.chart.over.append(plot.hand);
    plot.chart.over.addEventListener("click", () => {
      const left = plot.chart?.cursor.left ?? -1;
      if (plot.chart && left >= 0) this.seek(plot.chart.posToVal(left, "x"));
    });
  }

  /** Moves the hands to the time of the replay. */
  show(time: number): void {
    this.time = time;
    for (const { chart, hand } of this.plots) {
      if (chart) hand.style.transform = `translateX(${chart.valToPos(time, "x")}px)`;
    }
    if (this.hovered === null) this.tell();
  }

  private tell(): void {
    const at = this.hovered ?? Math.max(0, lastAtOrBefore(this.times, this.time));
    for (const plot of this.plots) plot.figures.forEach((figure, i) => setText(figure, short(plot.shown[i].values[at], 4)));
  }
}
