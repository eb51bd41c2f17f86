// What the page's tests stand on: a server, recordings, a browser that is watched.

import assert from "node:assert/strict";
import { execFileSync, spawn } from "node:child_process";
import { mkdtempSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { AxeBuilder } from "@axe-core/playwright";
import { chromium } from "playwright-core";

const program = process.env.PAGE_PROGRAM;
const browserPath = process.env.PAGE_BROWSER ?? "/usr/bin/chromium";
/** Where pictures go, if any are wanted. */
export const pictures = process.env.PAGE_PICTURES;

assert(program, "PAGE_PROGRAM names the built program");

/** A folder that is gone in the end. */
export const folder = mkdtempSync(join(tmpdir(), "locution-page-"));

/** Runs the program to its end. */
export function run(...words) {
  return execFileSync(program, words, { encoding: "utf8", stdio: ["ignore", "pipe", "pipe"] });
}

/** A recording of a simulated robot in the office. */
export function recording(name, world, ...words) {
  run("simulate", "--world", world, "--out", join(folder, name), "--fov", "270", ...words);
  return join(folder, `${name}.log`);
}

/** A server on an empty directory. */
export async function startServer() {
  const server = spawn(program, ["serve", "--address", "127.0.0.1:0", "--data-directory", join(folder, "data")]);
  let said = "";
  server.stderr.on("data", (text) => (said += text));
  const url = await new Promise((resolve, reject) => {
    server.stdout.on("data", (text) => {
      said += text;
      const found = /listening on (\S+)/.exec(said);
      if (found) resolve(found[1]);
    });
    server.on("exit", () => reject(new Error(`the server ended: ${said}`)));
  });
  const stop = async () => {
    const ended = new Promise((resolve) => server.on("exit", resolve));
    server.kill();
    await ended;
    rmSync(folder, { recursive: true, force: true });
    assert(!/panicked/.test(said), said);
  };
  return { url: process.env.PAGE_FROM_SOURCES ? await startDev(url) : url, direct: url, stop };
}

/** The page from its sources instead of from the binary, for those who work on it. */
async function startDev(url) {
  const port = 7072;
  const dev = spawn("node", ["dev.mjs", url, String(port)], { stdio: ["ignore", "pipe", "inherit"] });
  process.on("exit", () => dev.kill());
  dev.unref();
  await new Promise((resolve) => dev.stdout.once("data", resolve));
  dev.stdout.unref();
  return `http://127.0.0.1:${port}`;
}

/** A browser whose pages may ask this server only, and must not complain. */
export async function startBrowser(url) {
  const browser = await chromium.launch({ executablePath: browserPath, args: ["--no-sandbox"] });
  const complaints = [];
  const expected = [];
  async function open(options = {}) {
    const context = await browser.newContext({ viewport: { width: 1280, height: 800 }, baseURL: url, ...options });
    context.setDefaultTimeout(30_000);
    const page = await context.newPage();
    page.on("request", (request) => {
      const asked = new URL(request.url());
      if (asked.origin !== new URL(url).origin && asked.protocol !== "blob:") complaints.push(`asked ${asked.href}`);
    });
    page.on("pageerror", (error) => complaints.push(error.stack ?? String(error)));
    page.on("console", (message) => {
      const text = message.text();
      if (message.type() === "error" && !expected.some((part) => text.includes(part))) complaints.push(`${text} ${message.location().url}`);
    });
    return page;
  }
  /** Answers of the server that a test provokes are no complaint. */
  const expect = (...parts) => expected.push(...parts);
  return { browser, open, complaints, expect };
}

/** Finds nothing serious with axe. */
export async function assertAccessible(page, name) {
  await assertPasses(new AxeBuilder({ page }).withTags(["wcag2a", "wcag2aa", "wcag21a", "wcag21aa", "best-practice"]), name);
}

/** Text stands out from its ground; the rest does not depend on the colors. */
export async function assertReadable(page, name) {
  await assertPasses(new AxeBuilder({ page }).withRules(["color-contrast"]), name);
}

async function assertPasses(axe, name) {
  const { violations } = await axe.analyze();
  const grave = violations.filter(({ impact }) => impact === "serious" || impact === "critical");
  const told = grave.map(({ id, help, nodes }) => `${id}: ${help}\n  ${nodes.map(({ html }) => html.slice(0, 160)).join("\n  ")}`);
  assert.equal(told.length, 0, `${name}: ${told.join("\n")}`);
}

/** Nothing sticks out to the right. */
export async function assertFits(page, name) {
  const [wide, shown] = await page.evaluate(() => [document.documentElement.scrollWidth, document.documentElement.clientWidth]);
  assert(wide <= shown, `${name} is ${wide} pixels wide on a screen of ${shown}`);
}

/** Takes a picture for the README, if pictures are wanted. */
export async function picture(page, name) {
  if (pictures) await page.screenshot({ path: join(pictures, `${name}.png`) });
}

/** How many colors a canvas shows; a blank one has one. */
export async function colorsOf(page, selector) {
  return page.locator(selector).first().evaluate((canvas) => {
    const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
    const seen = new Set();
    for (let i = 0; i < data.length; i += 4) seen.add((data[i] << 16) | (data[i + 1] << 8) | data[i + 2]);
    return seen.size;
  });
}

/** Waits until something holds. */
export async function until(holds, what, limit_ms = 60_000) {
  for (const end = Date.now() + limit_ms; Date.now() < end; ) {
    if (await holds()) return;
    await new Promise((resolve) => setTimeout(resolve, 200));
  }
  throw new Error(`in vain: ${what}`);
}

/** JSON of the server. */
export async function ask(url, path, options) {
  const answer = await fetch(url + path, options);
  assert(answer.ok, `${path}: ${answer.status} ${await answer.clone().text()}`);
  return answer.status === 204 ? undefined : answer.json();
}

export { join, readFileSync, writeFileSync };
