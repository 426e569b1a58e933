// Opens the built page in Chromium with small and large runs; pictures of it go to shots/.
// CHROMIUM names the browser if it is not where Debian puts it.

import { mkdirSync, mkdtempSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { pathToFileURL } from "node:url";
import { chromium, type Browser, type Page } from "playwright-core";
import { afterAll, beforeAll, describe, expect, it } from "vitest";
import { BUILT, pageWith, PLACEHOLDER } from "./pages";
import { bouncingBall, gas, piston, poolBreak, rain, record, twoBalls } from "./samples";
import { dice, funnel, gallery, recordEngineRun, recordSolids, rodStruck, spinningPool, table, thousand } from "./solids";

const shots = new URL("../shots/", import.meta.url).pathname;
const folder = mkdtempSync(join(tmpdir(), "carom-page-"));
let browser: Browser;

beforeAll(async () => {
  mkdirSync(shots, { recursive: true });
  browser = await chromium.launch({
    executablePath: process.env.CHROMIUM ?? "/usr/bin/chromium",
    args: ["--no-sandbox", "--enable-unsafe-swiftshader", "--use-gl=angle", "--use-angle=swiftshader"],
  });
});
afterAll(async () => {
  await browser?.close();
  rmSync(folder, { recursive: true, force: true });
});

interface Sight {
  width?: number;
  height?: number;
  dark?: boolean;
  still?: boolean;
}

/** Opens a page from a file, as users do, and watches for errors and for anything fetched. */
async function open(html: string, sight: Sight = {}): Promise<{ page: Page; trouble: string[] }> {
  const file = join(folder, `${Math.random().toString(36).slice(2)}.html`);
  writeFileSync(file, html);
  const context = await browser.newContext({
    viewport: { width: sight.width ?? 1440, height: sight.height ?? 1000 },
    colorScheme: sight.dark ? "dark" : "light",
    reducedMotion: sight.still ? "reduce" : "no-preference",
  });
  const page = await context.newPage();
  const trouble: string[] = [];
  page.on("console", (message) => { if (["error", "warning"].includes(message.type()) && !message.text().includes("GPU stall")) trouble.push(message.text()); });
  page.on("pageerror", (error) => trouble.push(String(error)));
  page.on("request", (request) => { if (!/^(file|data|blob):/.test(request.url())) trouble.push(`fetched ${request.url()}`); });
  await page.goto(pathToFileURL(file).href);
  return { page, trouble };
}

const now = (page: Page) => page.locator(".strip").getAttribute("aria-valuenow").then(Number);

describe("the built page", () => {
  it("has one place for the data, and nothing that is fetched", () => {
    const html = readFileSync(BUILT, "utf8");
    expect(html.split(PLACEHOLDER).length).toBe(2);
    expect(html).toContain("default-src 'none'");
    expect(html).not.toMatch(/<(script|img|link)\b[^>]*\b(src|href)="(?!data:)/);
  });

  it("says so, kindly, when it has no run in it", async () => {
    const { page, trouble } = await open(readFileSync(BUILT, "utf8"));
    await expect.poll(() => page.locator("h1").textContent()).toBe("No run in this page yet");
    expect(trouble).toEqual([]);
    await page.context().close();
  });

  it("says what is wrong with data it cannot read", async () => {
    const { page } = await open(pageWith({ format: 9 }));
    await expect.poll(() => page.locator("main").textContent()).toContain("format 9");
    await page.context().close();
  });

  it("plays, pauses, seeks and steps", async () => {
    const { page, trouble } = await open(pageWith(record(poolBreak())));
    await expect.poll(() => now(page), { timeout: 20_000 }).toBeGreaterThan(0.1);
    await page.keyboard.press("Space");
    const paused = await now(page);
    await page.waitForTimeout(300);
    expect(await now(page)).toBe(paused);
    await page.keyboard.press("Home");
    await expect.poll(() => now(page)).toBe(0);
    await page.keyboard.press("ArrowRight");
    await expect.poll(() => page.locator(".inspector h2").textContent()).toContain("Impact 1");
    const first = Number(await page.locator('[data-impact="0"] [data-full]').nth(1).getAttribute("data-full"));
    await expect.poll(() => now(page), { timeout: 20_000 }).toBe(first);
    expect(await page.locator(".overlay line.normal").count()).toBe(1);
    await page.locator('[data-impact="3"]').click();
    await expect.poll(() => page.locator(".inspector h2").textContent()).toContain("Impact 4");
    await page.locator('.filter input').fill("8");
    await expect.poll(() => page.locator(".impacts .muted").first().textContent()).toMatch(/ of /);
    expect(trouble).toEqual([]);
    await page.context().close();
  });

  it("copies numbers with every digit", async () => {
    const { page } = await open(pageWith(record(twoBalls)), { still: true });
    const row = page.locator('[data-impact="0"]');
    await row.waitFor();
    const copied = await row.evaluate((line) => {
      document.getSelection()?.selectAllChildren(line.parentElement as Element);
      return new Promise<string>((resolve) => {
        document.addEventListener("copy", (event) => resolve(event.clipboardData?.getData("text/plain") ?? ""), { once: true });
        document.execCommand("copy");
      });
    });
    // Contact where (4 − 2t)² + 0.35² = 1, to the last digits: at t = 2 − √(1 − 0.35²)/2.
    const cells = copied.split("\t");
    expect(Number(cells[1])).toBeCloseTo(2 - Math.sqrt(1 - 0.35 ** 2) / 2, 14);
    expect(cells[1].length).toBeGreaterThan(15);
    expect(cells.slice(2, 5)).toEqual(["A", "B", "ball-ball"]);
    await page.context().close();
  });

  it("works for more bodies than can be replayed", async () => {
    const data: any = record(gas(4, 0.5));
    const none = { id: "", radius: "", mass: "", position: "", velocity: "", fixed: "", count: 0, total: 100_000, name: null };
    const { page, trouble } = await open(pageWith({ ...data, bodies: none }));
    await expect.poll(() => page.locator(".stage").textContent()).toContain("100\u202f000 bodies");
    await page.keyboard.press("ArrowRight");
    await expect.poll(() => page.locator(".inspector h2").textContent()).toContain("Impact 1");
    expect(trouble).toEqual([]);
    await page.context().close();
  });

  it("never takes text of the data for HTML", async () => {
    const evil = '<img src=x onerror="document.title=1"></script><script>document.title=2</script>';
    const data = record({ ...twoBalls, title: evil, balls: twoBalls.balls.map((ball) => ({ ...ball, name: evil })) });
    (data.summary as any).rules = { [evil]: `${evil}: ${evil}` };
    const { page, trouble } = await open(pageWith(data));
    await expect.poll(() => page.locator("h1").textContent()).toBe(evil);
    await page.keyboard.press("ArrowRight");
    await page.waitForTimeout(300);
    expect(await page.locator("img").count()).toBe(0);
    expect(await page.title()).toContain(evil.slice(0, 20));
    expect(trouble).toEqual([]);
    await page.context().close();
  });

  it.each([
    ["no impact", { ...twoBalls, duration: 0.5 }],
    ["a single body", { title: "Alone", duration: 1, balls: [{ position: [0, 0, 0], velocity: [1, 0, 0], radius: 0.5, mass: 1 }] }],
    ["no body", { title: "Nothing", duration: 1, balls: [] }],
  ])("opens a run with %s", async (_, scene) => {
    const { page, trouble } = await open(pageWith(record(scene)));
    await expect.poll(() => now(page)).toBeGreaterThan(0);
    expect(trouble).toEqual([]);
    await page.context().close();
  });

  it("opens 20,000 bodies and 50,000 impacts quickly, and says what is missing", async () => {
    const html = pageWith(rain());
    const { page, trouble } = await open(html);
    // From the start of loading until all parts stand and the first picture is asked for. Drawing it without a graphics
    // card, as here, says nothing about how long it takes with one. The best of three: other work only makes it longer.
    const times: number[] = [];
    for (let i = 0; i < 3; i++) {
      if (i > 0) await page.reload();
      await page.locator(".strip").waitFor();
      times.push(await page.evaluate(() => performance.getEntriesByName("carom-open")[0].startTime));
    }
    const opened = Math.min(...times);
    console.log(`20,000 bodies, ${(html.length / 1e6).toFixed(1)} MB: open after ${opened.toFixed(0)} ms`);
    // Under 3 s is what a user should see; the same again is allowed for drawing in software on busy processors.
    expect(opened).toBeLessThan(6000);
    expect(await page.locator(".gap").textContent()).toContain("50\u202f000");
    await expect.poll(() => now(page)).toBeGreaterThan(0);
    expect(trouble).toEqual([]);
    await page.screenshot({ path: join(shots, "rain.png") });
    await page.context().close();
  });

  it("turns what is struck, and says how fast", async () => {
    const { page, trouble } = await open(pageWith(recordSolids(rodStruck())), { still: true });
    await page.locator(".strip").waitFor();
    const canvas = page.locator(".stage canvas");
    await page.keyboard.press("Home");
    await page.keyboard.press("ArrowRight");
    await expect.poll(() => page.locator(".inspector h2").textContent()).toContain("ball-side");
    // Angular speeds of ball and rod: 0 and 0 before, 0 and 4.8 rad/s after.
    const speeds = await page.locator(".speeds [data-full]").evaluateAll((cells) => cells.map((cell) => Number((cell as HTMLElement).dataset.full)));
    expect(speeds.slice(0, 4)).toEqual([2, 0, expect.closeTo(1.2, 12), expect.closeTo(0.8, 12)]);
    expect(speeds.slice(4)).toEqual([0, 0, 0, expect.closeTo(4.8, 12)]);
    // Pointing at the rod names it, with its speeds.
    const box = (await canvas.boundingBox())!;
    await page.mouse.move(box.x + box.width * 0.463, box.y + box.height * 0.52);
    await expect.poll(() => page.locator(".hover").textContent()).toBe("rod (id 1) · 0.8 m/s · 4.8 rad/s");
    expect(trouble).toEqual([]);
    await page.context().close();
  });

  it("draws a thousand polyhedra in a few calls", async () => {
    const { page, trouble } = await open(pageWith(recordSolids(thousand())), { still: true });
    await page.locator(".strip").waitFor();
    await page.keyboard.press("Home");
    for (let i = 0; i < 3; i++) await page.keyboard.press("ArrowRight");
    await expect.poll(() => page.locator(".inspector h2").textContent()).toContain("Impact 3");
    await page.waitForTimeout(1000);
    await page.screenshot({ path: join(shots, "thousand-impact-light.png") });
    expect(trouble).toEqual([]);
    await page.context().close();
  });

  const sights: [string, unknown][] = [
    ["pool", record(poolBreak())], ["two_balls", record(twoBalls)], ["bouncing", record(bouncingBall)], ["piston", record(piston)], ["gas", record(gas())],
    ["shapes", recordSolids(gallery())], ["dice", recordSolids(dice())], ["funnel", recordSolids(funnel())], ["spin", recordSolids(spinningPool())], ["table", recordSolids(table())],
    ["engine", recordEngineRun()],
  ];
  it.each(sights)("looks right: %s", async (name, recording) => {
    const html = pageWith(recording);
    const all: Sight[] = [{ dark: false }, { dark: true, width: 400, height: 860 }, { dark: true }, { dark: false, width: 400, height: 860 }];
    for (const sight of name === "pool" ? all : all.slice(0, 2)) {
      const { page, trouble } = await open(html, { ...sight, still: true });
      const wide = sight.width ? "narrow" : "wide";
      const tone = sight.dark ? "dark" : "light";
      await page.locator(".strip").waitFor();
      await page.locator(".strip").click({ position: { x: 150, y: 20 } });
      await page.waitForTimeout(700);
      await page.screenshot({ path: join(shots, `${name}-${wide}-${tone}.png`), fullPage: true });
      if (wide === "wide") {
        await page.keyboard.press("Home");
        for (let i = 0; i < 2; i++) await page.keyboard.press("ArrowRight");
        await page.waitForTimeout(700);
        await page.screenshot({ path: join(shots, `${name}-impact-${tone}.png`) });
      }
      // Nothing sticks out to the side.
      expect(await page.evaluate(() => document.documentElement.scrollWidth - innerWidth)).toBeLessThanOrEqual(0);
      expect(trouble).toEqual([]);
      await page.context().close();
    }
  });
});
