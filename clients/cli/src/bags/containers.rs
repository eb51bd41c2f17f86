//! The two containers of recorded messages: MCAP and the bag of ROS 1. Read record by record, whether they have an index or
//! not, so that a file that was never closed is read as far as it goes.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, BufReader, Cursor, Read};
use std::path::Path;

use anyhow::{Context, Result, anyhow, bail, ensure};

use super::messages::Layout;

const MCAP_MAGIC: &[u8] = b"\x89MCAP0\r\n";
const BAG_MAGIC: &[u8] = b"#ROSBAG V2.0\n";
/// Longest record or chunk that is taken into memory, bytes; those of recorders are some megabytes.
const RECORD_BYTES_MAX: u64 = 1 << 30;

/// Where messages of one kind stand.
#[derive(Clone, Debug)]
pub struct Channel {
    /// Its name.
    pub topic: String,
    /// Type of the messages as ROS 1 says it, such as `sensor_msgs/LaserScan`.
    pub kind: String,
    /// How their bytes are laid out.
    pub layout: Layout,
}

/// What is done with every message.
pub type Visit<'a> = dyn FnMut(&Channel, &[u8]) -> Result<()> + 'a;

/// Whether a file begins like either container.
///
/// # Errors
/// A file that cannot be read.
pub fn is_bag_file(path: &Path) -> io::Result<bool> {
    Ok(begins_with(path, MCAP_MAGIC)? || begins_with(path, BAG_MAGIC)?)
}

fn begins_with(path: &Path, magic: &[u8]) -> io::Result<bool> {
    let mut head = Vec::new();
    File::open(path)?.take(magic.len() as u64).read_to_end(&mut head)?;
    Ok(head == magic)
}

/// Walks through the messages of a file, in the order of its bytes.
///
/// # Errors
/// A file that is of neither kind, is cut off or damaged, and what the visitor says.
pub fn visit_messages(path: &Path, visit: &mut Visit<'_>) -> Result<()> {
    let is_mcap = begins_with(path, MCAP_MAGIC)?;
    ensure!(is_mcap || begins_with(path, BAG_MAGIC)?, "neither an MCAP file nor a bag of ROS 1");
    let mut input = BufReader::new(File::open(path)?);
    let magic = if is_mcap { MCAP_MAGIC } else { BAG_MAGIC };
    bytes(&mut input, magic.len() as u64)?;
    if is_mcap {
        let is_whole = Mcap::default().visit(&mut input, visit)?;
        ensure!(is_whole, CUT_OFF);
        Ok(())
    } else {
        visit_bag_records(&mut input, &mut BTreeMap::new(), visit)
    }
}

const CUT_OFF: &str = "the file is cut off";

/// The next bytes; memory grows only as they come, whatever the length claims.
fn bytes(input: &mut impl Read, num_bytes: u64) -> Result<Vec<u8>> {
    ensure!(num_bytes <= RECORD_BYTES_MAX, "a record of {num_bytes} bytes");
    let mut read = Vec::new();
    input.take(num_bytes).read_to_end(&mut read)?;
    ensure!(read.len() as u64 == num_bytes, CUT_OFF);
    Ok(read)
}

fn array<const N: usize>(input: &mut impl Read) -> Result<[u8; N]> {
    let mut number = [0; N];
    input.read_exact(&mut number).map_err(|_| anyhow!(CUT_OFF))?;
    Ok(number)
}

fn u16_of(input: &mut impl Read) -> Result<u16> {
    Ok(u16::from_le_bytes(array(input)?))
}

fn u32_of(input: &mut impl Read) -> Result<u32> {
    Ok(u32::from_le_bytes(array(input)?))
}

fn u64_of(input: &mut impl Read) -> Result<u64> {
    Ok(u64::from_le_bytes(array(input)?))
}

fn text_of(input: &mut impl Read) -> Result<String> {
    let length = u32_of(input)?;
    Ok(String::from_utf8_lossy(&bytes(input, u64::from(length))?).into_owned())
}

/// Passes over bytes without taking them into memory.
fn skip(input: &mut impl Read, num_bytes: u64) -> Result<()> {
    let skipped = io::copy(&mut input.take(num_bytes), &mut io::sink())?;
    ensure!(skipped == num_bytes, CUT_OFF);
    Ok(())
}

/// The bytes of a chunk, which says how many they are.
fn unpacked(packed: Vec<u8>, compression: &str, num_bytes: u64) -> Result<Vec<u8>> {
    ensure!(num_bytes <= RECORD_BYTES_MAX, "a chunk of {num_bytes} bytes");
    let packed = Cursor::new(packed);
    match compression {
        "" | "none" => Ok(packed.into_inner()),
        "lz4" => bytes(&mut lz4_flex::frame::FrameDecoder::new(packed), num_bytes),
        "zstd" => bytes(&mut zstd::stream::read::Decoder::new(packed)?, num_bytes),
        "bz2" => bail!("chunks packed with bz2; `rosbag decompress` unpacks them"),
        other => bail!("chunks packed with '{other}'"),
    }
    .context("a chunk cannot be unpacked")
}

/// What an MCAP file has said so far of its channels.
#[derive(Default)]
struct Mcap {
    kinds: BTreeMap<u16, String>,
    channels: BTreeMap<u16, Channel>,
}

impl Mcap {
    const SCHEMA: u8 = 0x03;
    const CHANNEL: u8 = 0x04;
    const MESSAGE: u8 = 0x05;
    const CHUNK: u8 = 0x06;
    const DATA_END: u8 = 0x0F;

    /// Walks through records; true when the one was among them that ends the messages.
    fn visit(&mut self, input: &mut impl Read, visit: &mut Visit<'_>) -> Result<bool> {
        let mut opcode = [0];
        while input.read(&mut opcode)? == 1 {
            let length = u64_of(input)?;
            match opcode[0] {
                Self::DATA_END => return Ok(true),
                Self::SCHEMA | Self::CHANNEL | Self::MESSAGE | Self::CHUNK => {
                    self.take(opcode[0], &bytes(input, length)?, visit)?;
                }
                _ => skip(input, length)?,
            }
        }
        Ok(false)
    }

    fn take(&mut self, opcode: u8, record: &[u8], visit: &mut Visit<'_>) -> Result<()> {
        let mut rest = record;
        match opcode {
            Self::SCHEMA => {
                let id = u16_of(&mut rest)?;
                self.kinds.insert(id, text_of(&mut rest)?.replace("/msg/", "/"));
            }
            Self::CHANNEL => {
                let (id, schema_id) = (u16_of(&mut rest)?, u16_of(&mut rest)?);
                let topic = text_of(&mut rest)?;
                let layout = match text_of(&mut rest)?.as_str() {
                    "ros1" => Layout::Ros1,
                    "cdr" => Layout::Cdr,
                    // No messages of ROS.
                    _ => return Ok(()),
                };
                let kind = self.kinds.get(&schema_id).cloned().unwrap_or_default();
                self.channels.insert(id, Channel { topic, kind, layout });
            }
            Self::MESSAGE => {
                let id = u16_of(&mut rest)?;
                // A counter, the time of logging and of publishing.
                skip(&mut rest, 4 + 8 + 8)?;
                if let Some(channel) = self.channels.get(&id) {
                    visit(channel, rest)?;
                }
            }
            _ => {
                // First and last time.
                skip(&mut rest, 8 + 8)?;
                let (num_bytes, checksum) = (u64_of(&mut rest)?, u32_of(&mut rest)?);
                let compression = text_of(&mut rest)?;
                let packed_length = u64_of(&mut rest)?;
                let records = unpacked(bytes(&mut rest, packed_length)?, &compression, num_bytes)?;
                // A chunk without a checksum says 0.
                let is_sound = checksum == 0 || crc32fast::hash(&records) == checksum;
                ensure!(is_sound, "a chunk is damaged: its checksum is wrong");
                self.visit(&mut records.as_slice(), visit)?;
            }
        }
        Ok(())
    }
}

/// The kinds of records of a bag of ROS 1 that count here.
const BAG_MESSAGE: u8 = 0x02;
const BAG_CHUNK: u8 = 0x05;
const BAG_CONNECTION: u8 = 0x07;

/// The fields of a record's header, or of a connection.
fn fields_of(mut header: &[u8]) -> Result<BTreeMap<String, Vec<u8>>> {
    let mut fields = BTreeMap::new();
    while !header.is_empty() {
        let length = u32_of(&mut header)?;
        let field = bytes(&mut header, u64::from(length))?;
        let end = field.iter().position(|&byte| byte == b'=').context("a header field without a name")?;
        let name = String::from_utf8_lossy(&field[..end]).into_owned();
        fields.insert(name, field[end + 1..].to_vec());
    }
    Ok(fields)
}

/// A header field that is a number.
fn number_of(fields: &BTreeMap<String, Vec<u8>>, name: &str) -> Result<u32> {
    let value = fields.get(name).with_context(|| format!("a record without the field '{name}'"))?;
    u32_of(&mut value.as_slice())
}

fn visit_bag_records(
    input: &mut impl Read,
    channels: &mut BTreeMap<u32, Channel>,
    visit: &mut Visit<'_>,
) -> Result<()> {
    let mut first = [0];
    while input.read(&mut first)? == 1 {
        let [b, c, d] = array(input)?;
        let header_length = u32::from_le_bytes([first[0], b, c, d]);
        let fields = fields_of(&bytes(input, u64::from(header_length))?)?;
        let data_length = u64::from(u32_of(input)?);
        let text = |value: Option<&Vec<u8>>| value.map(|text| String::from_utf8_lossy(text).into_owned());
        match fields.get("op").and_then(|op| op.first()).copied() {
            Some(BAG_MESSAGE) => {
                let data = bytes(input, data_length)?;
                if let Some(channel) = channels.get(&number_of(&fields, "conn")?) {
                    visit(channel, &data)?;
                }
            }
            Some(BAG_CONNECTION) => {
                let connection = fields_of(&bytes(input, data_length)?)?;
                let topic = text(fields.get("topic")).context("a connection without a topic")?;
                let kind = text(connection.get("type")).context("a connection without a type")?;
                channels.insert(number_of(&fields, "conn")?, Channel { topic, kind, layout: Layout::Ros1 });
            }
            Some(BAG_CHUNK) => {
                let packed = bytes(input, data_length)?;
                let compression = text(fields.get("compression")).unwrap_or_default();
                let chunk = unpacked(packed, &compression, u64::from(number_of(&fields, "size")?))?;
                visit_bag_records(&mut chunk.as_slice(), channels, visit)?;
            }
            _ => skip(input, data_length)?,
        }
    }
    Ok(())
}
