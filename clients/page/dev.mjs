// Serves the page from its sources, built at every load, before a running server: node dev.mjs [SERVER] [PORT]
import { execFileSync } from "node:child_process";
import { mkdtempSync, readFileSync } from "node:fs";
import { createServer, request } from "node:http";
import { tmpdir } from "node:os";
import { join } from "node:path";

const server = new URL(process.argv[2] ?? "http://127.0.0.1:7070");
const port = Number(process.argv[3] ?? 7071);
const folder = mkdtempSync(join(tmpdir(), "locution-page-"));
const TYPES = { html: "text/html; charset=utf-8", js: "text/javascript", css: "text/css", svg: "image/svg+xml" };

createServer((asked, answer) => {
  const path = new URL(asked.url ?? "/", "http://localhost").pathname;
  const name = path === "/ui" ? "index.html" : path.match(/^\/ui\/([a-z]+\.[a-z]+)$/)?.[1];
  if (name) {
    try {
      if (name === "index.html") execFileSync("node", ["build.mjs", folder], { stdio: "inherit" });
      answer.setHeader("content-type", TYPES[name.split(".").pop()] ?? "text/plain");
      answer.setHeader("cache-control", "no-store");
      answer.end(readFileSync(join(folder, name)));
    } catch (error) {
      answer.writeHead(500).end(String(error));
    }
    return;
  }
  const passed = request(
    { host: server.hostname, port: server.port, path: asked.url, method: asked.method, headers: asked.headers },
    (reply) => {
      answer.writeHead(reply.statusCode ?? 502, reply.headers);
      reply.pipe(answer);
    },
  );
  passed.on("error", (error) => answer.writeHead(502).end(String(error)));
  asked.pipe(passed);
}).listen(port, "127.0.0.1", () => console.log(`http://127.0.0.1:${port}/ui before ${server.href}`));
