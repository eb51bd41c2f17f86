// Recordings read by the browser: to the last bit what the command line reads, and refused with a reason.

import assert from "node:assert/strict";
import { copyFileSync } from "node:fs";
import { after, before, test } from "node:test";
import { mcapFile, rosbagFile } from "./bags.mjs";
import { ask, folder, join, readFileSync, recording, run, startBrowser, startServer, writeFileSync } from "./surroundings.mjs";

let server;
let chrome;
let page;

before(async () => {
  recording("guest", process.env.PAGE_WORLD, "--wander", "30", "--seed", "5", "--start", "30,17");
  server = await startServer();
  chrome = await startBrowser(server.url);
  page = await chrome.open();
});

after(async () => {
  await chrome?.browser.close();
  await server?.stop();
});

test("the browser reads recordings as the command line does", async () => {
  // Of both messages, with and without what old logs get wrong: carriage returns, a mark, codes for no return.
  const flaser = (t, ranges) => `FLASER ${ranges.length} ${ranges.join(" ")} ${0.1 * t} 0.05 0.01 ${0.1 * t} 0 0.01 ${1000 + t}.123456789 host ${t}`;
  const robot = (t, ranges) => `ROBOTLASER1 0 -1.5707963 3.1415927 0.0174533 81.83 0.01 0 ${ranges.length} ${ranges.join(" ")} 0 ${0.1 * t + 0.2} 0.1 ${3.1 + 0.001 * t} ${0.1 * t} 0.1 ${3.1 + 0.001 * t} 0 0 0.3 0.2 1e6 ${t}.5e0 host ${t}`;
  const ranges = (count, t) => Array.from({ length: count }, (_, beam) => (beam % 7 === 0 ? "81.83" : beam % 31 === 3 ? "-1" : beam % 37 === 5 ? "nan" : (1 + ((beam * 7919 + t * 104729) % 9973) * 1e-3).toFixed(4)));
  const lines = { flaser: ["PARAM laser_front_laser_fov 239.77 h 0", "PARAM laser_front_laser_resolution 0.3516 h 0"], robot: ["\ufeff# a note \u00e9"] };
  for (let t = 0; t < 60; t++) {
    lines.flaser.push(`${flaser(t, ranges(683, t))}\r`, "ODOM 0 0 0 0 0 0 0 host 0");
    lines.robot.push(robot(t, ranges(181, t)));
  }
  for (const [name, text] of Object.entries(lines)) writeFileSync(join(folder, `${name}.log`), text.join("\n") + "\n");
  // Bags of both ROS, plain, packed with LZ4, and packed with zstd by the writer of the Python client's `make_bag.py`.
  writeFileSync(join(folder, "plain.mcap"), mcapFile());
  writeFileSync(join(folder, "lz4.bag"), rosbagFile());
  copyFileSync(new URL("recordings/zstd.mcap", import.meta.url), join(folder, "zstd.mcap"));
  const files = ["flaser.log", "robot.log", "guest.log", "plain.mcap", "lz4.bag", "zstd.mcap"].map((name) => join(folder, name));
  run("replay", "--url", server.direct, "--site", "by-command", ...files);
  await page.goto("/ui");
  await page.getByLabel("Name of the site").fill("by-browser");
  await page.getByRole("button", { name: "Make the site" }).click();
  await page.getByLabel("Recordings", { exact: true }).setInputFiles(files);
  await page.getByText("laser hangs upside down").first().waitFor();
  await page.getByRole("button", { name: "Send 6 runs" }).click();
  await page.getByText("Sent. The map is being built").waitFor();
  // Angles of bags come from quaternions, and browsers have another arc tangent in the last bit.
  const rounded = (text) => text.replace(/("theta": ?)(-?[0-9.e-]+)/g, (_, key, theta) => key + Number(theta).toFixed(12));
  for (const name of ["flaser", "robot", "guest", "plain", "lz4", "zstd"]) {
    const isBag = !["flaser", "robot", "guest"].includes(name);
    const [command, browser] = await Promise.all(["by-command", "by-browser"].map(async (site) => ({
      geometry: (await ask(server.direct, `/v1/sites/${site}/runs/${name}`)).geometry,
      // As text: a number of JavaScript would hide a nanosecond.
      scans: await (await fetch(`${server.direct}/v1/sites/${site}/runs/${name}/scans?limit=10000`)).text(),
    })));
    const same = (a, b, what) => assert(isBag ? rounded(a) === rounded(b) : a === b, `${name}: ${what}`);
    same(JSON.stringify(browser.geometry), JSON.stringify(command.geometry), "the laser");
    same(browser.scans, command.scans, "every scan to the last bit");
  }
});

test("a file that is no recording is refused with the line", async () => {
  writeFileSync(join(folder, "odd.log"), "FLASER 3 1 2\n");
  await page.getByLabel("Recordings", { exact: true }).setInputFiles(join(folder, "odd.log"));
  await page.getByRole("alert").filter({ hasText: "odd.log: line 1: the line ends before reading 2" }).waitFor();
  writeFileSync(join(folder, "cut.mcap"), readFileSync(join(folder, "plain.mcap")).subarray(0, -2000));
  await page.getByLabel("Recordings", { exact: true }).setInputFiles(join(folder, "cut.mcap"));
  await page.getByRole("alert").filter({ hasText: "cut.mcap: the file is cut off" }).waitFor();
  await page.getByText("If a file is not read as it should be").click();
  await page.getByLabel(/damaged or cut off/).check();
  await page.getByLabel("Topic of the laser").fill("/nose");
  await page.getByRole("button", { name: "Read again" }).click();
  await page.getByRole("alert").filter({ hasText: "no laser topic /nose; the bag has /scan" }).waitFor();
  await page.getByLabel("Topic of the laser").fill("");
  await page.getByRole("button", { name: "Read again" }).click();
  await page.getByText("the file is cut off; what follows is left out").waitFor();
});

test("the page asked nobody else and never complained", () => {
  assert.deepEqual(chrome.complaints, []);
});
