// Full pages out of the built one, as the report of a run is made: the data takes the place of the placeholder.

import { readFileSync } from "node:fs";

export const BUILT = new URL("../../python/carom/page/report.html", import.meta.url);
export const PLACEHOLDER = "<!--CAROM-DATA-->";

export function pageWith(recording: unknown): string {
  const data = JSON.stringify(recording).replaceAll("<", "\\u003c");
  return readFileSync(BUILT, "utf8").replace(PLACEHOLDER, () => `<script type="application/json" id="carom-data">${data}</script>`);
}
