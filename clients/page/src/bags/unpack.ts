// Packed chunks: zstd by a library, LZ4 here.

import { decompress } from "fzstd";
import { ByteReader, checkedLength } from "./bytes";

/** The bytes of a chunk that says how many they are. */
export function unpacked(packed: Uint8Array, compression: string, length: number): Uint8Array {
  checkedLength(length);
  if (compression === "" || compression === "none") return packed;
  if (compression === "bz2") throw new Error("chunks packed with bz2; `rosbag decompress` unpacks them");
  if (compression !== "lz4" && compression !== "zstd") throw new Error(`chunks packed with '${compression}'`);
  let plain: Uint8Array;
  try {
    plain = compression === "lz4" ? unpackLz4(packed, length) : decompress(packed);
  } catch (error) {
    throw new Error(`a chunk cannot be unpacked: ${error instanceof Error ? error.message : String(error)}`);
  }
  if (plain.length !== length) throw new Error(`a chunk of ${plain.length} bytes that says it has ${length}`);
  return plain;
}

const LZ4_MAGIC = 0x184d2204;
/** Set in a block's length when the block is not packed. */
const PLAIN_BLOCK = 0x80000000;

/** A frame of LZ4; blocks may refer to those before them. */
export function unpackLz4(packed: Uint8Array, length: number): Uint8Array {
  const input = new ByteReader(packed);
  if (input.u32() !== LZ4_MAGIC) throw new Error("no frame of LZ4");
  const flags = input.u8();
  if (flags >> 6 !== 1) throw new Error(`version ${flags >> 6} of LZ4`);
  const [hasBlockSums, hasSize, hasDictionary] = [flags & 0x10, flags & 0x08, flags & 0x01];
  // The largest block, the length of all, the dictionary's name and a checksum of these.
  input.take(1 + (hasSize ? 8 : 0) + (hasDictionary ? 4 : 0) + 1);
  const plain = new Uint8Array(length);
  let at = 0;
  for (let size = input.u32(); size !== 0; size = input.u32()) {
    const block = input.take(size & ~PLAIN_BLOCK);
    if (hasBlockSums) input.take(4);
    if (size & PLAIN_BLOCK) {
      if (block.length > length - at) throw new Error("more bytes than it says");
      plain.set(block, at);
      at += block.length;
    } else {
      at = unpackBlock(block, plain, at);
    }
  }
  return plain.subarray(0, at);
}

/** Appends a block at a place of `plain`, and answers where it ends. */
function unpackBlock(block: Uint8Array, plain: Uint8Array, start: number): number {
  let [from, at] = [0, start];
  const next = () => {
    if (from >= block.length) throw new Error("a block ends too early");
    return block[from++]!;
  };
  /** A length of four bits goes on in whole bytes while they are full. */
  const longer = (length: number) => {
    if (length < 15) return length;
    let byte: number;
    do {
      byte = next();
      length += byte;
    } while (byte === 255);
    return length;
  };
  while (from < block.length) {
    const token = next();
    const numLiterals = longer(token >> 4);
    if (numLiterals > block.length - from || numLiterals > plain.length - at) throw new Error("literals beyond the end");
    plain.set(block.subarray(from, from + numLiterals), at);
    from += numLiterals;
    at += numLiterals;
    // The last sequence has literals only.
    if (from === block.length) break;
    const offset = next() | (next() << 8);
    const numRepeated = longer(token & 15) + 4;
    if (offset === 0 || offset > at || numRepeated > plain.length - at) throw new Error("a repetition beyond the ends");
    // Byte by byte, since a repetition may repeat itself.
    for (let i = 0; i < numRepeated; i++, at++) plain[at] = plain[at - offset]!;
  }
  return at;
}
