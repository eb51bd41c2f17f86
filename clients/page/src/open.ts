// Recordings from files that a person chose in the browser, told apart by their content.

import { bagKind, readBag } from "./bags/read";
import type { BagOptions } from "./bags/read";
import { readCarmen } from "./carmen/file";
import type { CarmenOptions } from "./carmen/log";
import type { Recording } from "./recording";

/** What readers are told; each takes what concerns it. */
export type ReadOptions = CarmenOptions & BagOptions;

/** Reads a recording; `progress` is told the share of the file that is read. */
export async function readFile(file: File, options: ReadOptions, progress: (share: number) => void): Promise<Recording> {
  const head = new Uint8Array(await file.slice(0, 16).arrayBuffer());
  const kind = bagKind(head);
  if (kind) return readBag(file, kind, options, progress);
  if (new TextDecoder("latin1").decode(head).startsWith("SQLite format 3")) {
    throw new Error("bags that ROS 2 keeps in SQLite are read by the Python client, or as MCAP after `ros2 bag convert`");
  }
  return readCarmen(file, options, progress);
}
