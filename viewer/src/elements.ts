// Building blocks of the page. Text is only ever set as text; nothing in the data is read as HTML.

type Attributes = Record<string, string | number | boolean | undefined>;

/** A new element: attributes, then children (text or elements). */
export function element<K extends keyof HTMLElementTagNameMap>(
  tag: K,
  attributes: Attributes = {},
  ...children: (Node | string)[]
): HTMLElementTagNameMap[K] {
  const made = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (value === undefined || value === false) continue;
    made.setAttribute(name, value === true ? "" : String(value));
  }
  made.append(...children);
  return made;
}

export function svg(tag: string, attributes: Attributes = {}, ...children: (Node | string)[]): SVGElement {
  const made = document.createElementNS("http://www.w3.org/2000/svg", tag);
  for (const [name, value] of Object.entries(attributes)) if (value !== undefined) made.setAttribute(name, String(value));
  made.append(...children);
  return made;
}

/** A drawn button; `label` is its tooltip and what a screen reader says. */
export function iconButton(icon: string, label: string, press: () => void): HTMLButtonElement {
  const button = element("button", { type: "button", class: "icon", title: label, "aria-label": label }, drawIcon(icon));
  button.addEventListener("click", press);
  return button;
}

const ICONS: Record<string, string> = {
  play: "M7 4.5v15l12.5-7.5z",
  pause: "M6.5 5h4v14h-4zM13.5 5h4v14h-4z",
  next: "M6 5.5v13l9-6.5zM16 5.5h2.5v13H16z",
  previous: "M18 5.5v13L9 12zM5.5 5.5H8v13H5.5z",
  whole: "M4 9V4h5v2H6v3zM15 4h5v5h-2V6h-3zM18 15h2v5h-5v-2h3zM4 15h2v3h3v2H4z",
};

export function drawIcon(name: string): SVGElement {
  return svg("svg", { viewBox: "0 0 24 24", width: 20, height: 20, "aria-hidden": "true" }, svg("path", { d: ICONS[name], fill: "currentColor" }));
}

export function setText(target: Element, text: string): void {
  if (target.textContent !== text) target.textContent = text;
}

/** A number: `text` to see, every digit of `value` on hovering and in what is copied. */
export function numeric(text: string, value: number | string | null | undefined, unit = ""): HTMLSpanElement {
  const whole = value === null || value === undefined ? "" : String(value);
  const made = element("span", { class: "number" }, text);
  if (whole !== "") {
    made.dataset.full = whole;
    made.title = unit === "" ? whole : `${whole} ${unit}`;
  }
  if (unit !== "") made.append(element("span", { class: "unit" }, ` ${unit}`));
  return made;
}

/** Copying a selection copies numbers with every digit, columns separated by tabs. */
export function copyWholeNumbers(): void {
  document.addEventListener("copy", (event) => {
    const selection = document.getSelection();
    if (!selection || selection.isCollapsed || !event.clipboardData) return;
    const active = document.activeElement;
    if (active instanceof HTMLInputElement) return;
    const fragment = selection.getRangeAt(0).cloneContents();
    const numbers = fragment.querySelectorAll<HTMLElement>("[data-full]");
    let text: string;
    if (numbers.length === 0) {
      const parent = selection.anchorNode?.parentElement?.closest<HTMLElement>("[data-full]");
      if (!parent || selection.toString().trim() !== parent.textContent?.trim()) return;
      text = parent.dataset.full ?? "";
    } else {
      for (const number of numbers) number.replaceChildren(number.dataset.full ?? "");
      const lines = [...fragment.querySelectorAll("[role=row], .account-row")];
      text = lines.length > 0
        ? lines.map((line) => [...line.children].map((cell) => cell.textContent ?? "").join("\t")).join("\n")
        : fragment.textContent ?? "";
    }
    event.clipboardData.setData("text/plain", text);
    event.preventDefault();
  });
}
