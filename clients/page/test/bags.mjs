// Bags of ROS as a robot would have recorded them, written from the same drive in both containers.

/** Bytes that grow; CDR aligns numbers to their size, ROS 1 does not. */
class Writer {
  constructor(isCdr) {
    this.isCdr = isCdr;
    this.bytes = isCdr ? [0, 1, 0, 0] : [];
    this.start = this.bytes.length;
  }

  number(size, write) {
    while (this.isCdr && (this.bytes.length - this.start) % size) this.bytes.push(0);
    const buffer = Buffer.alloc(size);
    write(buffer);
    this.bytes.push(...buffer);
    return this;
  }

  u32 = (value) => this.number(4, (buffer) => buffer.writeUInt32LE(value));
  f32 = (value) => this.number(4, (buffer) => buffer.writeFloatLE(value));
  f64 = (value) => this.number(8, (buffer) => buffer.writeDoubleLE(value));

  text(text) {
    const bytes = [...Buffer.from(this.isCdr ? `${text}\0` : text)];
    this.u32(bytes.length).bytes.push(...bytes);
    return this;
  }

  header(timestamp_ns, frame) {
    if (!this.isCdr) this.u32(0);
    return this.u32(Math.floor(timestamp_ns / 1e9)).u32(timestamp_ns % 1e9).text(frame);
  }

  f64s(...values) {
    for (const value of values) this.f64(value);
    return this;
  }

  end = () => Buffer.from(this.bytes);
}

/** What a robot drove: topics with their type and messages. Its laser hangs upside down, ahead of the center and turned. */
function topics(isCdr) {
  const open = () => new Writer(isCdr);
  const quaternion = (theta) => [0, 0, Math.sin(theta / 2), Math.cos(theta / 2)];
  const scans = [];
  const odometry = [];
  for (let t = 0; t < 40; t++) {
    const ranges = Array.from({ length: 90 + (t % 3) }, (_, beam) => (beam % 7 === 0 ? Infinity : beam % 11 === 5 ? NaN : beam % 13 === 6 ? 0.01 : 1 + ((beam * 7919 + t * 104729) % 9973) * 1e-3));
    const scan = open().header(1e9 + t * 1e8, "/laser");
    for (const value of [-0.8, 0.8, 0.0175, 0, 0.1, 0.06, 10]) scan.f32(value);
    scan.u32(ranges.length);
    for (const range of ranges) scan.f32(range);
    scans.push(scan.u32(0).end());
    const pose = open().header(0.96e9 + t * 1e8, "odom").text("base_link").f64s(0.03 * t, 0.01 * t, 0, ...quaternion(0.05 * t - 3));
    odometry.push(pose.f64s(...new Array(36 + 6 + 36).fill(0)).end());
  }
  const mounting = open().u32(1).header(0, "base_link").text("laser").f64s(0.3, 0.1, 0.2, Math.cos(0.1), Math.sin(0.1), 0, 0).end();
  const kind = (ros1) => (isCdr ? ros1.replace("/", "/msg/") : ros1);
  return [
    ["/tf_static", kind("tf2_msgs/TFMessage"), [mounting]],
    ["/odom", kind("nav_msgs/Odometry"), odometry],
    ["/scan", kind("sensor_msgs/LaserScan"), scans],
  ];
}

/** A CARMEN log of the simulator as what its robot would have recorded with ROS 2: odometry between the scans, by transforms. */
export function mcapOfLog(log) {
  const scans = [];
  const transforms = [];
  for (const line of log.split("\n")) {
    const words = line.split(" ");
    if (words[0] !== "ROBOTLASER1") continue;
    const [min, field, increment, max, count] = [2, 3, 4, 5, 8].map((idx) => Number(words[idx]));
    const ranges = words.slice(9, 9 + count).map(Number);
    const rest = words.slice(9 + count);
    // Remissions, the laser's pose, the robot's pose, five words of motion, the time.
    const [x, y, theta] = rest.slice(4, 7).map(Number);
    const timestamp_ns = Math.round(1e9 * (1 + Number(rest[12])));
    const scan = new Writer(true).header(timestamp_ns, "laser");
    for (const value of [min, min + field, increment, 0, 0.1, 0.05, max]) scan.f32(value);
    scan.u32(count);
    for (const range of ranges) scan.f32(range);
    scans.push(scan.u32(0).end());
    transforms.push(new Writer(true).u32(1).header(timestamp_ns, "odom").text("base_link").f64s(x, y, 0, 0, 0, Math.sin(theta / 2), Math.cos(theta / 2)).end());
  }
  return mcapFile([
    ["/tf", "tf2_msgs/msg/TFMessage", transforms],
    ["/scan", "sensor_msgs/msg/LaserScan", scans],
  ]);
}

const u16 = (value) => Buffer.from(Uint16Array.of(value).buffer);
const u32 = (value) => Buffer.from(Uint32Array.of(value).buffer);
const u64 = (value) => Buffer.from(BigUint64Array.of(BigInt(value)).buffer);
const text = (content) => Buffer.concat([u32(Buffer.byteLength(content)), Buffer.from(content)]);
const joined = (...parts) => Buffer.concat(parts);

/** An MCAP file without chunks and index. */
export function mcapFile(recorded = topics(true)) {
  const magic = Buffer.from("\x89MCAP0\r\n", "latin1");
  const record = (opcode, ...content) => joined(Buffer.of(opcode), u64(joined(...content).length), ...content);
  const records = recorded.flatMap(([topic, kind, messages], idx) => {
    const id = u16(idx + 1);
    return [
      record(3, id, text(kind), text("ros2msg"), text("")),
      record(4, id, id, text(topic), text("cdr"), u32(0)),
      ...messages.map((message) => record(5, id, Buffer.alloc(20), message)),
    ];
  });
  return joined(magic, record(1, text("ros2"), text("")), ...records, record(15, u32(0)), record(2, Buffer.alloc(20)), magic);
}

/** A bag of ROS 1 without an index, with one chunk, which LZ4 has packed. */
export function rosbagFile() {
  const field = (name, value) => joined(u32(name.length + 1 + value.length), Buffer.from(`${name}=`), value);
  const record = (fields, data) => joined(u32(joined(...fields).length), ...fields, u32(data.length), data);
  const op = (value) => field("op", Buffer.of(value));
  const records = topics(false).flatMap(([topic, kind, messages], idx) => {
    const conn = field("conn", u32(idx));
    return [
      record([op(7), conn, field("topic", Buffer.from(topic))], field("type", Buffer.from(kind))),
      ...messages.map((message) => record([op(2), conn, field("time", Buffer.alloc(8))], message)),
    ];
  });
  const chunk = joined(...records);
  const fields = [op(5), field("compression", Buffer.from("lz4")), field("size", u32(chunk.length))];
  return joined(Buffer.from("#ROSBAG V2.0\n"), record([op(3)], Buffer.alloc(50, " ")), record(fields, lz4Frame(chunk)));
}

/** A frame of LZ4 with blocks that refer to those before them, packed as greedily as it goes. */
export function lz4Frame(plain) {
  const BLOCK = 65536;
  const seen = new Map();
  const blocks = [];
  for (let start = 0; start < plain.length; start += BLOCK) {
    const end = Math.min(start + BLOCK, plain.length);
    const packed = [];
    let literalsFrom = start;
    const sequence = (until, length, offset) => {
      const numLiterals = until - literalsFrom;
      const more = (value) => {
        for (let left = value - 15; left >= 0; left -= 255) packed.push(Math.min(left, 255));
      };
      packed.push((Math.min(numLiterals, 15) << 4) | (length ? Math.min(length - 4, 15) : 0));
      if (numLiterals >= 15) more(numLiterals);
      packed.push(...plain.subarray(literalsFrom, until));
      if (!length) return;
      packed.push(offset & 255, offset >> 8);
      if (length - 4 >= 15) more(length - 4);
    };
    // The last bytes of a block have to be literals.
    for (let at = start; at < end - 12; ) {
      const word = plain.readUInt32LE(at);
      const before = seen.get(word);
      seen.set(word, at);
      if (before === undefined || at - before > 65535) {
        at++;
        continue;
      }
      let length = 4;
      while (at + length < end - 5 && plain[before + length] === plain[at + length]) length++;
      sequence(at, length, at - before);
      at += length;
      literalsFrom = at;
    }
    sequence(end, 0, 0);
    blocks.push(u32(packed.length), Buffer.from(packed));
  }
  // Version 1, blocks of 64 KiB at most that hang together, and a checksum that nobody looks at.
  return joined(u32(0x184d2204), Buffer.of(0x40, 0x40, 0xc0), ...blocks, u32(0));
}
