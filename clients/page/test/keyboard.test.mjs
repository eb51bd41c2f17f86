// What a hand on the keyboard can do without a mouse, and a list of sites that does not fit one page.

import assert from "node:assert/strict";
import { after, before, test } from "node:test";
import { ask, assertAccessible, colorsOf, recording, run, startBrowser, startServer, until } from "./surroundings.mjs";

const SITES = 60;
let server;
let chrome;
let page;

before(async () => {
  server = await startServer();
  const log = recording("porter", process.env.PAGE_WORLD, "--wander", "60", "--seed", "3", "--start", "30,17");
  run("replay", "--url", server.direct, "--site", "office", "--wait", log);
  const headers = { "content-type": "application/json" };
  for (let idx = 0; idx < SITES; idx++) await ask(server.direct, `/v1/sites/hall-${String(idx).padStart(3, "0")}`, { method: "PUT", headers, body: "{}" });
  chrome = await startBrowser(server.url);
  page = await chrome.open();
});

after(async () => {
  await chrome?.browser.close();
  await server?.stop();
});

const focused = () => page.evaluate(() => (document.activeElement?.getAttribute("aria-label") ?? document.activeElement?.textContent ?? "").trim());

/** Presses Tab until something of this name has the focus, and shows that it has. */
async function tabTo(name, key = "Tab") {
  for (let i = 0; i < 150; i++) {
    await page.keyboard.press(key);
    if (!name.test(await focused())) continue;
    const outline = await page.evaluate(() => getComputedStyle(document.activeElement).outlineStyle);
    assert.notEqual(outline, "none", `${name} does not show that it has the focus`);
    return;
  }
  throw new Error(`no way by Tab to ${name}; the last was ${await focused()}`);
}

test("many sites come page by page and are found by a part of their name", async () => {
  await page.goto("/ui");
  await page.getByRole("heading", { name: "Sites" }).waitFor();
  const items = page.locator(".sites .item");
  await items.first().waitFor();
  assert.equal(await items.count(), 50);
  await page.getByRole("link", { name: "Next page" }).click();
  await page.getByText("hall-050").waitFor();
  await page.getByLabel("Part of a name").fill("FFI");
  await page.getByText("office").waitFor();
  assert.equal(await items.count(), 1);
  await assertAccessible(page, "sites");
});

test("a site is opened and a match confirmed without a mouse", async () => {
  await page.goto("about:blank");
  await page.goto("/ui#/?name=office");
  await page.locator(".sites .item").first().waitFor();
  await tabTo(/^To the content$/);
  await page.keyboard.press("Enter");
  await tabTo(/^office/);
  await page.keyboard.press("Enter");
  await until(async () => (await colorsOf(page, ".pane canvas")) > 3, "walls are drawn");
  await tabTo(/^Matches$/);
  await page.keyboard.press("Enter");
  await page.locator(".list .item").first().waitFor();
  await tabTo(/^porter \d+–\d+ ↔/);
  await page.keyboard.press("Enter");
  await page.getByRole("heading", { name: /^Match/ }).waitFor();
  await page.getByText("of what both saw agrees").waitFor();
  await tabTo(/^Confirm$/);
  await page.keyboard.press("Enter");
  await page.getByText("confirmed by a person").waitFor();
});

test("the map is moved and asked by keys, and a stretch is drawn by them", async () => {
  const { poses } = await ask(server.direct, "/v1/sites/office/runs/porter/trajectory?frame=map");
  const at = poses[200];
  await page.goto("about:blank");
  await page.goto(`/ui#/sites/office/map?at=${at.x},${at.y},40`);
  await until(async () => (await colorsOf(page, ".pane canvas")) > 3, "walls are drawn");
  await tabTo(/^Map of office/);
  await page.keyboard.press("Enter");
  await page.locator(".note").getByText("porter").waitFor();
  await page.goto("about:blank");
  await page.goto(`/ui#/sites/office/ask/drawing?at=${at.x},${at.y},20`);
  await until(async () => (await colorsOf(page, ".pane canvas")) > 3, "walls are drawn");
  const canvas = page.locator(".pane canvas");
  await canvas.focus();
  // Corners of the drawn path, each put under the cross by the address; Enter twice ends it.
  for (const idx of [200, 240, 280, 320]) {
    await page.evaluate(([x, y]) => (location.hash = `#/sites/office/ask/drawing?at=${x},${y},20`), [poses[idx].x, poses[idx].y]);
    await page.waitForTimeout(150);
    await page.keyboard.press("Enter");
  }
  await page.keyboard.press("Enter");
  await page.getByText(/\d+ places?, best first/).waitFor();
});

test("a window keeps the focus, and Escape closes it", async () => {
  await page.goto("/ui#/sites/office/manage");
  await tabTo(/^Delete this site/);
  await page.keyboard.press("Enter");
  await page.getByRole("dialog").waitFor();
  for (let i = 0; i < 6; i++) {
    await page.keyboard.press("Tab");
    const isInside = await page.evaluate(() => document.activeElement === document.body || document.activeElement.closest("dialog") !== null);
    assert(isInside, "the focus leaves the window");
  }
  await page.keyboard.press("Escape");
  await page.getByRole("dialog").waitFor({ state: "detached" });
  assert.match(await focused(), /^Delete this site/, "the focus comes back to where it was");
});

test("the page asked nobody else and never complained", () => {
  assert.deepEqual(chrome.complaints, []);
});
