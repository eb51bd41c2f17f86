// Builds the page into the folder that the server's binary is made with: node build.mjs FOLDER
import { copyFileSync, mkdirSync } from "node:fs";
import { join } from "node:path";
import { build } from "esbuild";

const folder = process.argv[2];
if (!folder) throw new Error("usage: node build.mjs FOLDER");
mkdirSync(folder, { recursive: true });
await build({
  entryPoints: { page: "src/main.tsx" },
  outdir: folder,
  bundle: true,
  minify: true,
  format: "esm",
  target: ["es2022"],
  jsx: "automatic",
  jsxImportSource: "preact",
  legalComments: "none",
  logLevel: "warning",
});
await build({ entryPoints: ["src/page.css"], outdir: folder, minify: true, logLevel: "warning" });
for (const name of ["index.html", "icon.svg"]) copyFileSync(join("src", name), join(folder, name));
