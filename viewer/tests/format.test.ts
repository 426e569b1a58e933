import { describe, expect, it } from "vitest";
import { aligned, clockTime, commonPower, count, short, span } from "../src/format";

describe("numbers as text", () => {
  it("short", () => {
    expect([0, 1, -2.5, 0.123456, 123456.7, 1e-7, -3.21e-15, 1.5e9, NaN, Infinity, null].map((x) => short(x))).toEqual([
      "0", "1", "−2.5", "0.1235", "123500", "1×10⁻⁷", "−3.21×10⁻¹⁵", "1.5×10⁹", "–", "∞", "–",
    ]);
  });
  it("times of a run are told apart at its own scale", () => {
    expect([clockTime(1.25, 4), clockTime(0.5, 120), clockTime(12.5, 12), clockTime(2e-9, 1e-8)]).toEqual(["1.25000", "0.500", "12.5000", "2.000000e−9"]);
  });
  it("spans have units", () => {
    expect([span(2), span(0.083), span(4.2e-5), span(3e-10), span(1e-15)]).toEqual(["2 s", "83 ms", "42 µs", "300 ps", "0.001 ps"]);
  });
  it("counts are grouped", () => {
    expect(count(1234567)).toBe("1\u202f234\u202f567");
  });
  it("numbers of an account have their decimals under each other", () => {
    const values = [6.885, 0, 4.79549123, -1e-17, null];
    expect(values.map(aligned(values))).toEqual(["6.88500", "0.00000", "4.79549", "0.00000", "–"]);
    expect(commonPower([2e-15, -0.1e-15])).toEqual([1e-15, "10⁻¹⁵ "]);
    expect(commonPower([1.5, 0])).toEqual([1, ""]);
    expect([3e-9].map(aligned([3e-9]))).toEqual(["3.000×10⁻⁹"]);
  });
});
