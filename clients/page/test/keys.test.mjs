// A server without keys gets its first, and more, in the browser.

import assert from "node:assert/strict";
import { after, before, test } from "node:test";
import { assertAccessible, assertFits, picture, startBrowser, startServer } from "./surroundings.mjs";

let server;
let chrome;
let page;

before(async () => {
  server = await startServer();
  chrome = await startBrowser(server.url);
  page = await chrome.open();
});

after(async () => {
  await chrome?.browser.close();
  await server?.stop();
});

const statusOf = async (secret, path = "/v1/sites") => (await fetch(server.direct + path, { headers: secret ? { authorization: `Bearer ${secret}` } : {} })).status;
const dialog = () => page.getByRole("dialog");
const line = (name) => page.locator(".keys li").filter({ has: page.locator("strong", { hasText: name }) });

/** Reads the secret that is shown, and closes. */
async function secret() {
  const shown = (await dialog().locator(".secret").textContent()).trim();
  await dialog().getByRole("button", { name: "I have it" }).click();
  await dialog().waitFor({ state: "detached" });
  return shown;
}

test("the first key locks the server and is taken up by the browser", async () => {
  await page.goto("/ui");
  await page.getByRole("link", { name: "Keys" }).click();
  await page.getByText("This server has no keys").waitFor();
  await assertAccessible(page, "no keys");
  await page.getByLabel("Name of the key").fill("boss");
  await page.getByRole("button", { name: "Make the key" }).click();
  await dialog().getByText("shown this once").waitFor();
  await assertAccessible(page, "secret");
  const boss = await secret();
  await line("boss").getByText("admin").waitFor();
  assert.equal(await statusOf(undefined), 401, "whoever has no key is refused");
  assert.equal(await statusOf(boss), 200);
  await page.getByRole("button", { name: "Key in use" }).waitFor();
});

test("a key is made for a robot, gets another secret, and is revoked", async () => {
  await page.getByLabel("Name of the key").fill("robot-7");
  await page.getByLabel("It may").selectOption("write");
  await page.getByLabel("Sites", { exact: true }).fill("office, lab");
  await page.getByLabel("Valid").selectOption("86400");
  await page.getByLabel("Requests a second").fill("50");
  await page.getByRole("button", { name: "Make the key" }).click();
  const old = await secret();
  await line("robot-7").getByText(/office, lab; valid until .*; 50 requests\/s at most/).waitFor();
  assert.equal(await statusOf(old), 200);
  await picture(page, "keys");
  await assertAccessible(page, "keys");
  await page.getByRole("button", { name: "New secret for robot-7" }).click();
  await page.getByLabel("The secret so far").selectOption("0");
  await assertAccessible(page, "new secret");
  await page.getByRole("button", { name: "Make it" }).click();
  const fresh = await secret();
  assert.notEqual(fresh, old);
  assert.deepEqual([await statusOf(old), await statusOf(fresh)], [401, 200]);
  await page.getByRole("button", { name: "Revoke robot-7" }).click();
  await dialog().getByLabel("Type robot-7 to confirm").fill("robot-7");
  await dialog().getByRole("button", { name: "Revoke it" }).click();
  await line("robot-7").waitFor({ state: "detached" });
  assert.equal(await statusOf(fresh), 401);
});

test("the last key that can make others stays, and the server says why", async () => {
  chrome.expect("409");
  await page.getByRole("button", { name: "Revoke boss" }).click();
  await dialog().getByLabel("Type boss to confirm").fill("boss");
  await dialog().getByRole("button", { name: "Revoke it" }).click();
  await dialog().getByRole("alert").waitFor();
  await page.keyboard.press("Escape");
  await line("boss").waitFor();
});

test("a browser without a key is asked for one, and one that may only look sees no keys", async () => {
  await page.getByLabel("Name of the key").fill("guest");
  await page.getByLabel("It may").selectOption("read");
  await page.getByRole("button", { name: "Make the key" }).click();
  const guest = await secret();
  chrome.expect("401", "403");
  const other = await chrome.open({ viewport: { width: 390, height: 844 } });
  await other.goto("/ui#/keys");
  await other.getByText("This server asks for a key.").waitFor();
  await other.getByLabel("API key").fill(guest);
  await other.getByRole("button", { name: "Use it", exact: true }).click();
  await other.getByText("Only a key of scope admin may see keys").waitFor();
  await assertFits(other, "keys on a phone");
  await other.context().close();
});

test("the page asked nobody else and never complained", () => {
  assert.deepEqual(chrome.complaints, []);
});
