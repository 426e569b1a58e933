// Numbers as text: short to look at, whole when hovered over or copied.

const SUPERSCRIPT: Record<string, string> = {
  "-": "⁻", "0": "⁰", "1": "¹", "2": "²", "3": "³", "4": "⁴", "5": "⁵", "6": "⁶", "7": "⁷", "8": "⁸", "9": "⁹",
};

/** `digits` significant digits; very large and very small numbers as 1.2×10⁻⁷. Zeros at the end go unless `whole`. */
export function short(x: number | null | undefined, digits = 4, whole = false): string {
  if (x === null || x === undefined || Number.isNaN(x)) return "–";
  if (x === 0) return "0";
  if (!Number.isFinite(x)) return x > 0 ? "∞" : "−∞";
  const size = Math.abs(x);
  if (size >= 1e-3 && size < 1e6) {
    const text = x.toPrecision(digits);
    return minus(text.includes("e") ? String(Number(text)) : whole ? text : trim(text));
  }
  const [mantissa, exponent] = x.toExponential(Math.min(digits, 4) - 1).split("e");
  return `${minus(whole ? mantissa : trim(mantissa))}×10${superscript(Number(exponent))}`;
}

function superscript(exponent: number): string {
  return [...String(exponent)].map((c) => SUPERSCRIPT[c]).join("");
}

/** Writes the numbers of one account alike, so that they stand under each other: as many decimals as the largest allows. */
export function aligned(values: (number | null | undefined)[], digits = 6): (x: number | null | undefined) => string {
  const largest = values.reduce<number>((most, x) => (x !== null && x !== undefined && Number.isFinite(x) ? Math.max(most, Math.abs(x)) : most), 0);
  const exponent = largest > 0 ? Math.floor(Math.log10(largest)) : 0;
  if (exponent < -3 || exponent > 8) return (x) => short(x, 4, true);
  const decimals = Math.max(0, digits - 1 - exponent);
  return (x) => (x === null || x === undefined || !Number.isFinite(x) ? "–" : minus(x.toFixed(decimals).replace(/^-(?=[0.]*$)/, "")));
}

/** A power of ten to divide the numbers of a table by, if they are too large or small to be written out; and how to write it. */
export function commonPower(values: number[]): [number, string] {
  const largest = values.reduce((most, x) => Math.max(most, Math.abs(x)), 0);
  const exponent = largest > 0 && Number.isFinite(largest) ? Math.floor(Math.log10(largest)) : 0;
  return exponent < -3 || exponent > 4 ? [10 ** exponent, `10${superscript(exponent)} `] : [1, ""];
}

export function count(x: number): string {
  return x.toLocaleString("en-GB").replaceAll(",", "\u202f");
}

/** A time, with as many decimals as `digits` significant digits of the length of the run need. */
export function clockTime(t: number, span: number, digits = 6): string {
  if (!(span > 0)) return short(t, 6);
  const exponent = Math.floor(Math.log10(span));
  if (exponent < -4 || exponent > 6) return minus(t.toExponential(digits));
  return minus(t.toFixed(Math.max(0, digits - 1 - exponent)));
}

const PREFIXES: [number, string][] = [[1, "s"], [1e-3, "ms"], [1e-6, "µs"], [1e-9, "ns"], [1e-12, "ps"]];

/** A length of time in a fitting unit: 83 ms. */
export function span(seconds: number): string {
  const [unit, name] = PREFIXES.find(([size]) => seconds >= 0.9995 * size) ?? PREFIXES[PREFIXES.length - 1];
  return `${short(seconds / unit, 3)} ${name}`;
}

function trim(text: string): string {
  return text.includes(".") ? text.replace(/\.?0+$/, "") : text;
}

function minus(text: string): string {
  return text.replace("-", "−");
}
