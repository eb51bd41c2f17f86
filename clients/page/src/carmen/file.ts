// CARMEN logs from files of the browser, line by line.

import { runName } from "../recording";
import type { Recording } from "../recording";
import { CarmenReader } from "./log";
import type { CarmenOptions } from "./log";

/** Reads a log, plain or gzipped; `progress` is told the share of the file that is read. */
export async function readCarmen(file: File, options: CarmenOptions, progress: (share: number) => void): Promise<Recording> {
  const reader = new CarmenReader(options);
  let bytesRead = 0;
  const counted = new TransformStream<Uint8Array, Uint8Array>({
    transform(chunk, controller) {
      bytesRead += chunk.byteLength;
      controller.enqueue(chunk);
    },
  });
  const head = new Uint8Array(await file.slice(0, 2).arrayBuffer());
  const isPacked = head[0] === 0x1f && head[1] === 0x8b;
  const bytes = file.stream().pipeThrough(counted) as ReadableStream<BufferSource>;
  const unpacked = isPacked ? bytes.pipeThrough(new DecompressionStream("gzip")) : bytes;
  const texts = unpacked.pipeThrough(new TextDecoderStream("utf-8", { ignoreBOM: true })).getReader();
  let rest = "";
  let numRounds = 0;
  for (;;) {
    const { done, value } = await texts.read();
    const lines = (rest + (value ?? "")).split("\n");
    rest = done ? "" : (lines.pop() ?? "");
    // What follows the last line feed is a line only if there is something.
    if (done && lines.at(-1) === "") lines.pop();
    for (const line of lines) reader.push(line.replace(/\r+$/, ""));
    progress(bytesRead / Math.max(file.size, 1));
    if (done) break;
    // The page stays alive while a long file is read.
    if (++numRounds % 16 === 0) await new Promise((resolve) => setTimeout(resolve));
  }
  return reader.finish(runName(file.name));
}
