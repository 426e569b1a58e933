// The table of impacts. Only the rows in sight exist, so fifty thousand impacts scroll like fifty.

import { element, numeric, setText } from "./elements";
import { clockTime, count, short } from "./format";
import { bodyLabel } from "./impacts";
import type { Flight } from "./flight";
import type { Recording } from "./recording";

/** Height of a row, the same in the style sheet (CSS pixels). */
const ROW = 30;
/** Rows kept ready beyond those in sight. */
const SPARE = 8;

interface Column {
  name: string;
  unit?: string;
  tip: string;
  cell: (impact: number) => HTMLElement | string;
  sort?: (impact: number) => number;
}

export class ImpactTable {
  readonly root: HTMLElement;
  private readonly columns: Column[];
  private readonly scroller: HTMLElement;
  private readonly body = element("div", { class: "rows", role: "rowgroup" });
  private readonly found = element("span", { class: "muted", "aria-live": "polite" });
  private readonly filter: HTMLInputElement;
  private readonly heads: HTMLElement[];
  private readonly nothing = element("p", { class: "nothing" });
  /** Impacts listed, in the order they are listed. */
  private listed: Int32Array;
  private selected = -1;
  private sortedBy = -1;
  private falling = false;

  constructor(
    private readonly recording: Recording,
    flight: Flight,
    private readonly jump: (impact: number) => void,
  ) {
    const { impacts } = recording;
    this.listed = Int32Array.from({ length: impacts.count }, (_, i) => i);
    const quantity = (name: string, unit: string, tip: string, values: Float64Array, whole = true): Column => ({
      name, unit, tip,
      cell: (i) => numeric(short(values[i], 5, whole), values[i]),
      sort: (i) => values[i],
    });
    const body = (rows: Int32Array, ids: Int32Array) => (i: number) => {
      const label = bodyLabel(recording, rows[i], ids[i]);
      return element("span", { title: `id ${ids[i]}` }, label);
    };
    this.columns = [
      { name: "#", tip: "Number of the impact", cell: (i) => numeric(count(i + 1), i + 1), sort: (i) => i },
      {
        name: "time", unit: "s", tip: "Since the start of the run",
        cell: (i) => numeric(clockTime(impacts.time[i], recording.replayUntil, 9), impacts.time[i]),
        sort: (i) => i,
      },
      { name: "a", tip: "First body", cell: body(flight.rowA, impacts.a), sort: (i) => impacts.a[i] },
      { name: "b", tip: "Second body", cell: body(flight.rowB, impacts.b), sort: (i) => impacts.b[i] },
      { name: "kind", tip: "What met what", cell: (i) => element("span", { class: "muted" }, impacts.kinds[impacts.kind[i]] ?? "") },
      quantity("approach", "m/s", "Speed of approach along the normal", impacts.approachSpeed),
      quantity("separation", "m/s", "Speed of separation along the normal", impacts.separationSpeed),
      quantity("impulse", "N·s", "Impulse along the normal: + on a, − on b", impacts.impulse),
      quantity("e", "", "Coefficient of restitution", impacts.restitution, false),
      quantity("energy lost", "J", "Energy dissipated at the impact", impacts.energyLost),
    ];

    this.heads = this.columns.map((column, index) => {
      const head = element("button", { type: "button", title: `${column.tip}${column.sort ? " – press to sort" : ""}` },
        column.name, element("span", { class: "unit" }, column.unit ? ` ${column.unit}` : ""));
      head.addEventListener("click", () => this.sort(index));
      return element("div", { role: "columnheader", "aria-sort": "none" }, head);
    });
    this.filter = element("input", { type: "search", placeholder: "id or name", "aria-label": "Show the impacts of one body", spellcheck: "false", autocomplete: "off" });
    this.filter.addEventListener("input", () => this.refresh(true));

    this.scroller = element("div", { class: "scroller", tabindex: 0, "aria-label": "Impacts: arrow keys to move, Enter to go there" },
      element("div", { class: "grid", role: "table", "aria-label": "Impacts", "aria-rowcount": impacts.count + 1 },
        element("div", { class: "head", role: "row" }, ...this.heads),
        this.body),
      this.nothing);
    this.scroller.addEventListener("scroll", () => this.render());
    new ResizeObserver(() => this.render()).observe(this.scroller);
    this.body.addEventListener("click", (event) => {
      const row = (event.target as Element).closest<HTMLElement>("[data-impact]");
      // A selection being made by hand is for copying, not for going anywhere.
      if (row && document.getSelection()?.isCollapsed !== false) this.jump(Number(row.dataset.impact));
    });

    this.root = element("section", { class: "card impacts", "aria-label": "Impacts" },
      element("header", {},
        element("h2", {}, "Impacts"),
        this.found,
        element("label", { class: "filter" }, element("span", {}, "Body"), this.filter)),
      this.scroller);
    this.refresh(false);
  }

  /** Lists only the impacts of one body; with an empty text all of them. */
  filterBy(text: string): void {
    this.filter.value = text;
    this.refresh(true);
  }

  private sort(index: number): void {
    if (!this.columns[index].sort) return;
    this.falling = this.sortedBy === index ? !this.falling : index > 4;
    this.sortedBy = index;
    this.heads.forEach((head, i) => head.setAttribute("aria-sort", i !== index ? "none" : this.falling ? "descending" : "ascending"));
    this.refresh(true);
  }

  private refresh(toTop: boolean): void {
    const { impacts, bodies } = this.recording;
    const wanted = this.filter.value.trim().toLowerCase();
    const all = Int32Array.from({ length: impacts.count }, (_, i) => i);
    if (wanted === "") {
      this.listed = all;
    } else {
      const id = /^[-−]?\d+$/.test(wanted) ? Number(wanted.replace("−", "-")) : NaN;
      const named = new Set<number>();
      bodies.name?.forEach((name, row) => { if (name?.toLowerCase() === wanted) named.add(bodies.id[row]); });
      this.listed = all.filter((i) => impacts.a[i] === id || impacts.b[i] === id || named.has(impacts.a[i]) || named.has(impacts.b[i]));
    }
    const key = this.columns[this.sortedBy]?.sort;
    if (key) this.listed.sort((i, j) => (this.falling ? key(j) - key(i) : key(i) - key(j)) || i - j);
    const shown = this.listed.length;
    setText(this.found, wanted === "" ? `${count(shown)}${impacts.total > impacts.count ? ` of ${count(impacts.total)}` : ""}` : `${count(shown)} of ${count(impacts.count)}`);
    setText(this.nothing, shown > 0 ? "" : impacts.count === 0 ? "Nothing met anything in this run." : `No impact of “${this.filter.value.trim()}”.`);
    this.body.style.height = `${shown * ROW}px`;
    if (toTop) this.scroller.scrollTop = 0;
    this.render();
  }

  private render(): void {
    const from = Math.max(0, Math.floor(this.scroller.scrollTop / ROW) - SPARE);
    const to = Math.min(this.listed.length, from + Math.ceil(this.scroller.clientHeight / ROW) + 2 * SPARE);
    const rows: HTMLElement[] = [];
    for (let place = from; place < to; place++) {
      const impact = this.listed[place];
      const row = element("div", { role: "row", "aria-rowindex": place + 2, "data-impact": impact, class: impact === this.selected ? "selected" : undefined },
        ...this.columns.map((column) => element("div", { role: "cell" }, column.cell(impact))));
      row.style.transform = `translateY(${place * ROW}px)`;
      rows.push(row);
    }
    this.body.replaceChildren(...rows);
  }

  /** Marks an impact (−1: none) and brings it into sight if `reveal`. */
  select(impact: number, reveal: boolean): void {
    if (impact === this.selected) return;
    this.selected = impact;
    if (impact >= 0 && reveal) {
      const place = this.listed.indexOf(impact);
      const room = this.scroller.clientHeight - 2 * ROW;
      const top = place * ROW;
      if (place >= 0 && (top < this.scroller.scrollTop || top > this.scroller.scrollTop + room)) {
        this.scroller.scrollTop = top - room / 2;
      }
    }
    for (const row of this.body.children) row.classList.toggle("selected", (row as HTMLElement).dataset.impact === String(impact));
  }
}
