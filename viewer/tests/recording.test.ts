import { describe, expect, it } from "vitest";
import { parseRecording, RecordingError } from "../src/recording";
import { record, twoBalls } from "./samples";

function changed(change: (data: any) => void): string {
  const data = structuredClone(record(twoBalls));
  change(data);
  return JSON.stringify(data);
}

describe("recording", () => {
  it("reads what a report carries", () => {
    const recording = parseRecording(changed(() => {}));
    expect(recording.title).toBe("One ball meets another");
    expect([...recording.bodies.id]).toEqual([0, 1]);
    expect(recording.bodies.name).toEqual(["A", "B"]);
    expect([...recording.bodies.position.subarray(3)]).toEqual([2, -0.15, 0]);
    expect(recording.impacts.count).toBe(1);
    expect(recording.duration).toBe(4);
    expect(recording.replayUntil).toBe(4);
  });

  it("counts time from the start of the run", () => {
    const recording = parseRecording(changed((data) => { data.time_start = 1e9; data.time_end = 1e9 + 4; data.replay_until = 1e9 + 2; }));
    expect([recording.timeStart, recording.duration, recording.replayUntil]).toEqual([1e9, 4, 2]);
  });

  it.each([
    ["a format it does not know", (data: any) => (data.format = 2), "format 2"],
    ["a missing column", (data: any) => delete data.impacts.impulse, "impacts.impulse"],
    ["a column that is too short", (data: any) => (data.impacts.time = ""), "impacts.time holds 0 bytes, not 8"],
    ["text that is not base64", (data: any) => (data.bodies.radius = "%%%"), "bodies.radius"],
    ["a vector of two", (data: any) => (data.gravity = [0, 0]), "gravity"],
    ["a domain it does not know", (data: any) => (data.domain.axes[1] = "round"), "domain.axes"],
    ["no series", (data: any) => delete data.series, "series"],
  ])("names the field in an error: %s", (_, change, words) => {
    expect(() => parseRecording(changed(change))).toThrow(RecordingError);
    expect(() => parseRecording(changed(change))).toThrow(words);
  });

  it("says so when the data is no JSON", () => {
    expect(() => parseRecording("{")).toThrow("not JSON");
  });
});
