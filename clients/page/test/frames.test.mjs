// How smoothly a site of 10⁵ observations moves: frames a second while it is panned, zoomed and pointed at.

import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { after, before, test } from "node:test";
import { startBrowser, until } from "./surroundings.mjs";
import { SYNTHETIC, answerOf } from "./synthetic.mjs";

/** What the page has to reach, frames a second. */
const RATE_MIN = 30;
/** Other work on the machine may spoil a measurement, but not all of them. */
const ATTEMPTS = 3;
const DURATION_MS = 2000;
const URL_BEFORE = "http://page.test";
const files = new URL(process.env.PAGE_BUILT ?? "../../../server/assets/ui/", import.meta.url);
const TYPES = { html: "text/html", js: "text/javascript", css: "text/css", svg: "image/svg+xml", png: "image/png", yaml: "text/plain" };

let chrome;
let page;

before(async () => {
  chrome = await startBrowser(URL_BEFORE);
  page = await chrome.open();
  const known = new Map();
  await page.route("**/*", (route) => {
    const path = new URL(route.request().url()).pathname;
    const name = path === "/ui" ? "index.html" : /^\/ui\/([a-z]+\.[a-z]+)$/.exec(path)?.[1];
    if (name) return route.fulfill({ contentType: TYPES[name.split(".").at(-1)], body: readFileSync(new URL(name, files)) });
    if (!known.has(path)) {
      const answer = answerOf(path);
      known.set(path, answer === undefined || typeof answer === "string" || Buffer.isBuffer(answer) ? answer : JSON.stringify(answer));
    }
    const body = known.get(path);
    const contentType = TYPES[path.split(".").at(-1)] ?? "application/json";
    return body === undefined ? route.fulfill({ status: 404, body: "{}" }) : route.fulfill({ contentType, body });
  });
});

after(() => chrome?.browser.close());

/** Frames a second while something is done to the canvas before each, and the slowest of twenty, milliseconds. */
function measure(what) {
  return page.evaluate(
    ([what, duration_ms]) =>
      new Promise((resolve) => {
        const canvas = document.querySelector(".pane canvas");
        const box = canvas.getBoundingClientRect();
        const [x, y] = [box.left + box.width / 2, box.top + box.height / 2];
        const pointer = (type, dx, dy, buttons) => canvas.dispatchEvent(new PointerEvent(type, { clientX: x + dx, clientY: y + dy, buttons, button: 0, pointerId: 1, bubbles: true }));
        canvas.setPointerCapture = () => undefined;
        const acts = {
          pan: (i) => pointer("pointermove", 150 * Math.sin(i / 9), 100 * Math.cos(i / 9), 1),
          zoom: (i) => canvas.dispatchEvent(new WheelEvent("wheel", { deltaY: i % 80 < 40 ? -60 : 60, clientX: x + 90, clientY: y + 50, bubbles: true, cancelable: true })),
          point: (i) => pointer("pointermove", 150 * Math.sin(i / 9), 100 * Math.cos(i / 9), 0),
        };
        if (what === "pan") pointer("pointerdown", 0, 0, 1);
        const times = [];
        const round = (now) => {
          times.push(now);
          acts[what](times.length);
          if (now - times[0] < duration_ms) return requestAnimationFrame(round);
          if (what === "pan") pointer("pointerup", 0, 0, 0);
          const steps = times.slice(1).map((time, i) => time - times[i]).sort((a, b) => a - b);
          resolve({ rate: (1000 * steps.length) / (times.at(-1) - times[0]), slow_ms: steps[Math.floor(0.95 * steps.length)] });
        };
        requestAnimationFrame(round);
      }),
    [what, DURATION_MS],
  );
}

test(`${SYNTHETIC.observations} observations move at more than ${RATE_MIN} frames a second`, async (context) => {
  const views = {
    "walls, runs and matches": "layers=walls,runs,matches&state=verified,rejected",
    "every layer by class": "layers=walls,words,runs,matches,labels&state=verified,rejected",
    "every layer by class, near": "layers=walls,words,runs,matches,labels&state=verified,rejected&at=100,75,40",
    "words by density": "layers=walls,words&color=density",
  };
  for (const [name, query] of Object.entries(views)) {
    // From elsewhere, so that each begins with all of the site in view unless it says where.
    await page.goto("about:blank");
    await page.goto(`${URL_BEFORE}/ui#/sites/large/map?${query}`);
    await page.getByRole("checkbox", { name: "Walls" }).waitFor();
    await until(async () => (await page.locator(".note").count()) === 0 && (await page.locator(".pane canvas").count()) === 1, "all is loaded");
    await page.waitForTimeout(500);
    for (const what of ["pan", "zoom", "point"]) {
      let best = { rate: 0, slow_ms: Infinity };
      for (let attempt = 0; attempt < ATTEMPTS && best.rate <= RATE_MIN; attempt++) {
        const measured = await measure(what);
        if (measured.rate > best.rate) best = measured;
      }
      context.diagnostic(`${name}, ${what}: ${best.rate.toFixed(0)} frames/s, one in twenty slower than ${best.slow_ms.toFixed(0)} ms`);
      assert(best.rate > RATE_MIN, `${name}, ${what}: ${best.rate.toFixed(1)} frames/s`);
    }
  }
  assert.deepEqual(chrome.complaints, []);
});
