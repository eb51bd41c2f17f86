// Clicks through the whole page before a real server, from an empty one to a map with two versions.
// The tests build on one another, in this order.

import assert from "node:assert/strict";
import { tmpdir } from "node:os";
import { after, before, test as nodeTest } from "node:test";
import { gzipSync } from "node:zlib";
import { mcapOfLog } from "./bags.mjs";
import { ask, assertAccessible, assertFits, assertReadable, colorsOf, folder, join, picture, readFileSync, recording, startBrowser, startServer, until, writeFileSync } from "./surroundings.mjs";

const world = process.env.PAGE_WORLD;
const PHONE = { viewport: { width: 390, height: 844 }, hasTouch: true, isMobile: true, deviceScaleFactor: 2 };
let server;
let chrome;
let page;
let logs;

before(async () => {
  logs = {
    porter: recording("porter", world, "--wander", "70", "--seed", "3", "--start", "30,17"),
    cleaner: recording("cleaner", world, "--wander", "50", "--seed", "4", "--start", "30,17"),
    guest: recording("guest", world, "--wander", "30", "--seed", "5", "--start", "30,17"),
  };
  writeFileSync(join(folder, "cleaner.log.gz"), gzipSync(readFileSync(logs.cleaner)));
  writeFileSync(join(folder, "guest.mcap"), mcapOfLog(readFileSync(logs.guest, "utf8")));
  server = await startServer();
  chrome = await startBrowser(server.url);
  page = await chrome.open();
});

after(async () => {
  await chrome?.browser.close();
  await server?.stop();
});

// What follows a test that failed would only wait for what is not there.
let hasFailed = false;
const test = (name, act) =>
  nodeTest(name, async (context) => {
    if (hasFailed) return context.skip("a test before it failed");
    try {
      await act();
    } catch (error) {
      hasFailed = true;
      await page?.screenshot({ path: join(tmpdir(), "locution-page-failed.png") }).catch(() => undefined);
      throw error;
    }
  });

const heading = (name) => page.getByRole("heading", { name, level: 1 });
const visit = async (hash) => {
  await page.goto(`/ui${hash}`);
};

test("an empty server says what to do", async () => {
  await visit("");
  await page.getByText("This server has no site yet").waitFor();
  await page.getByText("locution demo").waitFor();
  await assertAccessible(page, "empty server");
  await page.getByLabel("Name of the site").fill("office");
  await page.getByRole("button", { name: "Make the site" }).click();
  await heading("Runs").waitFor();
  await page.getByText("There are none yet").waitFor();
  await page.getByText("No map yet").waitFor();
  await assertAccessible(page, "site without a map");
});

test("recordings are sent from the browser and become a map", async () => {
  await page.getByLabel("Recordings", { exact: true }).setInputFiles([logs.porter, join(folder, "cleaner.log.gz")]);
  await page.getByRole("button", { name: "Send 2 runs" }).click();
  await page.getByText("Sent. The map is being built").waitFor();
  await page.getByRole("link", { name: "Jobs", exact: true }).first().click();
  await page.locator(".state.done").first().waitFor({ timeout: 150_000 });
  await until(async () => (await ask(server.direct, "/v1/sites/office/jobs")).items.every((job) => job.state === "done"), "all builds done");
  await page.getByRole("link", { name: "Map", exact: true }).click();
  await page.getByRole("checkbox", { name: "Walls" }).waitFor();
  await until(async () => (await colorsOf(page, ".pane canvas")) > 3, "walls are drawn");
});

test("the map is moved, and its address brings one back", async () => {
  await visit("#/sites/office/map");
  const canvas = page.locator(".pane canvas");
  await until(async () => (await colorsOf(page, ".pane canvas")) > 3, "walls are drawn");
  const box = await canvas.boundingBox();
  const at = { x: box.x + 0.4 * box.width, y: box.y + 0.6 * box.height };
  const position = async () => (await page.locator(".position").textContent()).split(",").map(Number.parseFloat);
  await page.mouse.move(at.x, at.y);
  const [x, y] = await position();
  const length = await page.locator(".scale .bar").getAttribute("data-length");
  for (let turn = 0; turn < 6; turn++) await page.mouse.wheel(0, -240);
  await page.mouse.move(at.x + 1, at.y);
  const [x2, y2] = await position();
  assert(Math.hypot(x2 - x, y2 - y) < 0.2, "what is under the pointer stays there");
  assert.notEqual(await page.locator(".scale .bar").getAttribute("data-length"), length, "the scale bar follows");
  await canvas.focus();
  for (const key of ["ArrowLeft", "ArrowUp", "+", "-"]) await page.keyboard.press(key);
  await until(async () => page.url().includes("at="), "the camera stands in the address");
  await page.getByRole("checkbox", { name: "Labels" }).check();
  await page.getByRole("checkbox", { name: "Words under the path" }).check();
  await page.waitForTimeout(400);
  const other = await chrome.open();
  await other.goto(page.url());
  assert(await other.getByRole("checkbox", { name: "Labels" }).isChecked());
  assert.equal(await other.locator(".scale .bar").textContent(), await page.locator(".scale .bar").textContent());
  await other.context().close();
  await page.getByRole("button", { name: "Show everything" }).click();
});

test("all layers are shown and explained", async () => {
  await visit("#/sites/office/map");
  await page.getByRole("checkbox", { name: "Rooms" }).check();
  await until(async () => (await page.locator(".note").count()) === 0, "rooms are loaded");
  await page.waitForTimeout(300);
  await picture(page, "rooms");
  for (const name of ["Places", "Words under the path", "Labels", "Changes", "rejected"]) await page.getByRole("checkbox", { name }).check();
  for (const text of ["porter", "door between rooms", "narrow 0", "verified match", "rejected match", "corridor", "disappeared"]) {
    await page.locator(".legend").getByText(text, { exact: true }).waitFor();
  }
  await until(async () => (await page.locator(".note").count()) === 0, "all is loaded");
  await page.getByLabel("Color by").selectOption("density");
  await page.locator(".legend").getByText("density 0").waitFor();
  await assertAccessible(page, "map");
});

test("a map is taken along for nav2, its picture under the name that its YAML says", async () => {
  await visit("#/sites/office/map");
  const saved = async (title) => {
    const [file] = await Promise.all([page.waitForEvent("download"), page.getByRole("button", { name: title }).click()]);
    return { name: file.suggestedFilename(), bytes: readFileSync(await file.path()) };
  };
  const picture = await saved("Grid for map_server (PGM)");
  const about = await saved("Its YAML");
  assert.equal(/^image: (.*)$/m.exec(about.bytes.toString())[1], picture.name);
  assert.equal(picture.bytes.subarray(0, 2).toString(), "P5");
  const rooms = JSON.parse((await saved("Rooms and doors (GeoJSON)")).bytes.toString());
  assert.equal(rooms.type, "FeatureCollection");
});

test("a room is named, and a thing put onto the map and taken away", async () => {
  const rooms = async () => (await ask(server.direct, "/v1/sites/office/rooms?limit=1000")).items;
  const room = (await rooms()).reduce((a, b) => (a.area_m2 > b.area_m2 ? a : b));
  const canvas = page.locator(".pane canvas");
  const pressEnterAt = async ({ x, y }, layers) => {
    await page.goto("about:blank");
    await visit(`#/sites/office/map?layers=${layers}&at=${x},${y},60`);
    await until(async () => (await colorsOf(page, ".pane canvas")) > 3 && (await page.locator(".note").count()) === 0, "the layers are drawn");
    await canvas.focus();
    await page.keyboard.press("Enter");
  };
  await pressEnterAt(room.centre, "walls,rooms");
  await page.getByLabel("What people call it").fill("Great hall");
  await page.getByRole("button", { name: "Name it" }).click();
  await page.locator(".note").waitFor({ state: "detached" });
  await until(async () => (await rooms()).some(({ id, name }) => id === room.id && name === "Great hall"), "the room has its name");
  // Another name replaces the first.
  await pressEnterAt(room.centre, "walls,rooms");
  await page.locator(".note strong").getByText("Great hall").waitFor();
  await page.getByLabel("What people call it").fill("Small hall");
  await page.getByRole("button", { name: "Name it" }).click();
  await page.locator(".note").waitFor({ state: "detached" });
  await until(async () => (await rooms()).some(({ id, name }) => id === room.id && name === "Small hall"), "the room has its other name");
  const annotations = async () => (await ask(server.direct, "/v1/sites/office/annotations")).items.map(({ kind, name }) => `${kind} ${name}`);
  assert.deepEqual(await annotations(), ["room Small hall"]);
  await page.getByRole("checkbox", { name: "Annotations" }).check();
  await page.getByLabel("What people call it").fill("Charger");
  await page.getByRole("button", { name: "Set place" }).click();
  await page.getByText("Click the map; or focus it").waitFor();
  await canvas.focus();
  for (const key of ["ArrowLeft", "Enter"]) await page.keyboard.press(key);
  await assertAccessible(page, "annotations");
  await page.getByRole("button", { name: "Add it" }).click();
  await until(async () => (await annotations()).includes("dock Charger"), "the dock is there");
  await until(async () => (await page.locator(".note").count()) === 0, "it is shown");
  await canvas.focus();
  await page.keyboard.press("Enter");
  await page.getByRole("button", { name: "Delete Charger" }).click();
  await until(async () => !(await annotations()).includes("dock Charger"), "the dock is gone");
});

test("a word that is clicked asks where else it reads like this", async () => {
  await visit("#/sites/office/map?layers=walls,words&at=30,17,40");
  const drive = await ask(server.direct, "/v1/sites/office/runs/porter/trajectory?frame=map");
  const pose = drive.poses[Math.floor(drive.poses.length / 2)];
  await visit(`#/sites/office/map?layers=words&at=${pose.x},${pose.y},40`);
  await until(async () => (await colorsOf(page, ".pane canvas")) > 1, "words are drawn");
  const box = await page.locator(".pane canvas").boundingBox();
  await page.mouse.click(box.x + box.width / 2, box.y + box.height / 2);
  await page.getByRole("link", { name: "Where else does it read like this?" }).click();
  await page.getByText(/\d+ places?, best first/).waitFor();
});

test("a match is looked at, vetoed, confirmed and taken back", async () => {
  await visit("#/sites/office/matches");
  await page.locator(".list .item").first().click();
  await heading(/Match/).waitFor();
  await until(async () => (await colorsOf(page, ".overlay canvas")) > 10, "both scans are drawn");
  await page.getByText("of what both saw agrees").waitFor();
  await picture(page, "match");
  await assertAccessible(page, "match");
  await page.getByLabel("Posed").selectOption("map");
  await page.getByLabel("Shown").selectOption("later");
  const id = /matches\/(\d+)/.exec(page.url())[1];
  const decision = async () => (await ask(server.direct, `/v1/sites/office/matches/${id}`)).decision;
  await page.getByRole("button", { name: "Confirm" }).click();
  await page.getByText("confirmed by a person").waitFor();
  assert.equal(await decision(), "confirm");
  await page.getByRole("button", { name: "Take it back" }).click();
  await page.getByText("confirmed by a person").waitFor({ state: "detached" });
  assert.equal(await decision(), null);
  await page.getByRole("button", { name: "Veto" }).click();
  await page.getByText("vetoed by a person").waitFor();
  await page.getByRole("button", { name: "Build the map now" }).click();
  await until(async () => (await ask(server.direct, "/v1/sites/office/map")).version > 1, "the next version is built");
  await page.getByRole("link", { name: /All matches/ }).click();
  await page.getByLabel("State").selectOption("rejected");
  await page.locator(".list .item").filter({ hasText: "vetoed" }).first().waitFor();
});

test("words are put together from chips", async () => {
  const { items: words } = await ask(server.direct, "/v1/sites/office/runs/porter/words?limit=1000");
  const word = words.reduce((a, b) => (b.size > a.size ? b : a));
  await visit("#/sites/office/ask");
  await page.getByRole("button", { name: "+ word" }).click();
  await page.getByLabel("Density class").selectOption(String(word.class));
  await page.getByLabel("Length, metres").fill((word.size / 10).toFixed(1));
  await page.getByLabel("Length, metres").blur();
  await page.getByText(/\d+ places?, best first/).waitFor();
  await page.getByRole("button", { name: "+ word" }).click();
  await page.getByLabel("Density class").selectOption("");
  await page.getByRole("button", { name: "← earlier" }).click();
  assert(decodeURIComponent(page.url()).includes(`words=:40,${word.class}:${word.size}`), page.url());
  await page.getByRole("button", { name: "Remove" }).click();
  await page.getByText(/\d+ places?, best first/).waitFor();
  await picture(page, "words");
  await assertAccessible(page, "question by words");
});

test("a stretch that is drawn is looked up", async () => {
  const drive = await ask(server.direct, "/v1/sites/office/runs/porter/trajectory?frame=map");
  const stretch = drive.poses.slice(150, 400);
  const middle = stretch[Math.floor(stretch.length / 2)];
  const scale = 25;
  await visit(`#/sites/office/ask/drawing?at=${middle.x},${middle.y},${scale}`);
  const box = await page.locator(".pane canvas").boundingBox();
  await until(async () => (await colorsOf(page, ".pane canvas")) > 3, "walls are drawn");
  const pixel = (pose) => [box.x + box.width / 2 + (pose.x - middle.x) * scale, box.y + box.height / 2 - (pose.y - middle.y) * scale];
  await page.mouse.move(...pixel(stretch[0]));
  await page.mouse.down();
  for (const pose of stretch.filter((_, idx) => idx % 5 === 0)) await page.mouse.move(...pixel(pose));
  await page.mouse.up();
  await page.getByText(/\d+ places?, best first/).waitFor();
  assert.match(decodeURIComponent(page.url()), /drawn=(porter|cleaner):\d+-\d+/);
});

test("places are asked for by what a person calls them", async () => {
  await visit("#/sites/office/ask/labels");
  await page.getByRole("button", { name: "+ place" }).click();
  await page.getByText(/\d+ places?, best first/).waitFor();
  await page.getByLabel("At least, metres").fill("900");
  await page.getByLabel("At least, metres").blur();
  await page.getByText("Nowhere.").waitFor();
});

test("a recording is found in the map", async () => {
  await visit("#/sites/office/ask/example");
  await page.getByLabel("Recording", { exact: true }).setInputFiles(join(folder, "guest.mcap"));
  await page.getByText("/scan with odometry of tf").waitFor();
  await page.getByRole("button", { name: "Where was this recorded?" }).click();
  await page.getByText(/Found\.|Several places|Not here/).waitFor();
  await assertAccessible(page, "question by recording");
});

test("a recording is localized while one watches", async () => {
  await visit("#/sites/office/localize");
  await page.getByLabel("Recording", { exact: true }).setInputFiles(join(folder, "guest.mcap"));
  await page.getByLabel("Pace").selectOption("0");
  await page.getByRole("button", { name: "Drive" }).click();
  await page.locator(".state.converged").waitFor();
  await picture(page, "localize");
  await page.getByRole("button", { name: "Stop" }).click();
  await page.getByRole("button", { name: "Drive again" }).waitFor();
  await assertAccessible(page, "localize");
});

test("the way from one place to another is shown", async () => {
  await visit("#/sites/office/map");
  await until(async () => (await colorsOf(page, ".pane canvas")) > 3, "walls are drawn");
  const { poses } = await ask(server.direct, "/v1/sites/office/runs/porter/trajectory?frame=map");
  const [from, to] = [poses[20], poses[500]].map((pose) => `${pose.x.toFixed(2)},${pose.y.toFixed(2)}`);
  await page.getByRole("button", { name: "Set start" }).click();
  await page.getByText("Click the map; or focus it").waitFor();
  await page.locator(".pane canvas").focus();
  await page.keyboard.press("Enter");
  await until(async () => page.url().includes("from="), "the start stands in the address");
  await visit(`#/sites/office/map?from=${from}&to=${to}`);
  await page.locator(".steps li").first().waitFor();
});

test("versions are compared side by side and by their difference", async () => {
  await visit("#/sites/office/versions");
  await until(async () => (await page.locator(".sides canvas").count()) === 2 && (await colorsOf(page, ".sides canvas")) > 3, "both are drawn");
  await page.getByRole("cell", { name: "as before" }).first().waitFor();
  // How many builds came between depends on when the runs ended, so both sides are chosen.
  await page.getByLabel("Left").selectOption("1");
  await page.getByLabel("Shown").selectOption("difference");
  await page.getByText("only in version 1").waitFor();
  await until(async () => (await colorsOf(page, ".wide canvas")) > 1, "the difference is drawn");
  await assertAccessible(page, "versions");
});

test("a run that is driven is watched as it grows", async () => {
  const { geometry } = await ask(server.direct, "/v1/sites/office/runs/porter");
  const { items } = await ask(server.direct, "/v1/sites/office/runs/porter/scans?limit=400");
  const headers = { "content-type": "application/json" };
  const send = (first, last) => ask(server.direct, "/v1/sites/office/runs/live/batches", { method: "POST", headers, body: JSON.stringify({ first_sequence: first, scans: items.slice(first, last).map(({ scan_seq: _, ...scan }) => scan) }) });
  await ask(server.direct, "/v1/sites/office/runs/live", { method: "PUT", headers, body: JSON.stringify({ geometry }) });
  await send(0, 200);
  await visit("#/sites/office/runs");
  await page.locator(".item").filter({ hasText: "live" }).first().click();
  await page.locator(".figures dd").getByText("200", { exact: true }).waitFor();
  await send(200, 400);
  await page.locator(".figures dd").getByText("400", { exact: true }).waitFor();
  await page.locator(".chip").first().waitFor();
  await picture(page, "run");
  await assertAccessible(page, "run");
});

test("a job is cancelled, and a run is deleted with the next map", async () => {
  await visit("#/sites/office/jobs");
  await page.locator("h1").getByText("Jobs").waitFor();
  // Most of a build of this size is over before a hand could cancel it, so it is held back until it is cancelled.
  const held = [{ id: "900", kind: "build", state: "running", progress: 0.4, left_s: 12, detail: "registering" }];
  let cancelled = "";
  await page.route("**/jobs?*", (route) => route.fulfill({ json: { items: cancelled ? [{ ...held[0], state: "cancelled", detail: "cancelled" }] : held, next_cursor: null } }));
  await page.route("**/jobs/900", (route) => {
    cancelled = route.request().method();
    return route.fulfill({ json: { ...held[0], state: "cancelled" } });
  });
  await page.getByText("40 % · registering · about 12 s left").waitFor();
  await assertAccessible(page, "jobs");
  await page.getByRole("button", { name: "Cancel" }).click();
  await page.locator(".state.cancelled").waitFor();
  assert.equal(cancelled, "DELETE");
  await page.unroute("**/jobs?*");
  await page.unroute("**/jobs/900");
  const before = (await ask(server.direct, "/v1/sites/office/map")).version;
  await visit("#/sites/office/runs/cleaner");
  await page.getByRole("button", { name: "Delete this run…" }).click();
  await page.getByRole("dialog").getByLabel(/Type cleaner/).fill("cleaner");
  await page.getByRole("button", { name: "Delete it" }).click();
  await heading("Runs").waitFor();
  await page.locator(".item").filter({ hasText: "cleaner" }).waitFor({ state: "detached" });
  await until(async () => {
    const map = await ask(server.direct, "/v1/sites/office/map");
    return map.version > before && map.runs.every(({ run }) => run !== "cleaner");
  }, "a map without the run");
});

test("a phone shows every view, and two fingers zoom", async () => {
  const phone = await chrome.open(PHONE);
  for (const view of ["", "sites/office/map", "sites/office/runs", "sites/office/matches", "sites/office/matches/0", "sites/office/ask", "sites/office/localize", "sites/office/versions", "sites/office/jobs", "sites/office/manage"]) {
    await phone.goto(`/ui#/${view}`);
    await phone.locator("h1").first().waitFor();
    await assertFits(phone, view);
  }
  await phone.goto("/ui#/sites/office/map");
  await until(async () => (await colorsOf(phone, ".pane canvas")) > 3, "walls are drawn");
  await assertAccessible(phone, "map on a phone");
  const box = await phone.locator(".pane canvas").boundingBox();
  const before = await phone.locator(".scale .bar").textContent();
  const session = await phone.context().newCDPSession(phone);
  const touch = (type, spread) => session.send("Input.dispatchTouchEvent", { type, touchPoints: type === "touchEnd" ? [] : [-1, 1].map((side, id) => ({ x: box.x + box.width / 2 + side * spread, y: box.y + box.height / 2, id })) });
  await touch("touchStart", 20);
  for (let spread = 30; spread <= 150; spread += 10) await touch("touchMove", spread);
  await touch("touchEnd");
  assert.notEqual(await phone.locator(".scale .bar").textContent(), before, "the pinch zoomed in");
  await picture(phone, "phone");
  await phone.context().close();
});

test("in the dark everything can be read, too", async () => {
  const dark = await chrome.open({ colorScheme: "dark" });
  for (const view of ["", "sites/office/map", "sites/office/runs", "sites/office/matches/0", "sites/office/ask", "sites/office/jobs", "sites/office/manage"]) {
    await dark.goto(`/ui#/${view}`);
    await dark.locator("h1").first().waitFor();
    await dark.waitForTimeout(300);
    await assertReadable(dark, `${view} in the dark`);
  }
  await dark.context().close();
});

test("a site is deleted only when its name is typed", async () => {
  await ask(server.direct, "/v1/sites/by-browser", { method: "PUT", headers: { "content-type": "application/json" }, body: "{}" });
  await visit("#/sites/by-browser/manage");
  await page.getByRole("button", { name: "Delete this site…" }).click();
  const dialog = page.getByRole("dialog");
  assert(await dialog.getByRole("button", { name: "Delete it" }).isDisabled());
  await assertAccessible(page, "confirmation");
  await page.keyboard.press("Escape");
  await dialog.waitFor({ state: "detached" });
  await page.getByRole("button", { name: "Delete this site…" }).click();
  await dialog.getByLabel(/Type by-browser/).fill("by-browser");
  await dialog.getByRole("button", { name: "Delete it" }).click();
  await page.getByRole("heading", { name: "Sites" }).waitFor();
  assert.equal((await fetch(`${server.direct}/v1/sites/by-browser`)).status, 404);
});

test("a site that is not there is said to be missing", async () => {
  chrome.expect("404");
  await visit("#/sites/nowhere/map");
  await page.getByRole("alert").waitFor();
  await page.getByRole("link", { name: "All sites" }).click();
  await page.getByRole("heading", { name: "Sites" }).waitFor();
});

test("the page asked nobody else and never complained", () => {
  assert.deepEqual(chrome.complaints, []);
});
