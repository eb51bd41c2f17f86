//! Files as they come, plain or packed by gzip: in one part or several, padded with zeros, or cut off.

use std::fs::File;
use std::io::{self, BufRead, BufReader, ErrorKind, Read};
use std::path::Path;

use anyhow::{Context, Result};
use flate2::bufread::GzDecoder;

/// The first two bytes of gzip, by which it is recognised, whatever the file is called.
const GZIP_MARK: [u8; 2] = [0x1f, 0x8b];

/// Opens a file for reading what is in it, unpacked.
///
/// # Errors
/// The file cannot be opened. Reading fails with an error of which [`is_damage`] holds where packed data end in the
/// middle or are not what they were.
pub fn open_unpacked(path: &Path) -> Result<Box<dyn BufRead>> {
    let file = File::open(path).with_context(|| format!("cannot open {}", path.display()))?;
    let mut plain = BufReader::with_capacity(1 << 16, file);
    let is_packed = plain.fill_buf().with_context(|| path.display().to_string())?.starts_with(&GZIP_MARK);
    Ok(if is_packed {
        Box::new(BufReader::with_capacity(1 << 16, Members::new(plain)))
    } else {
        Box::new(plain)
    })
}

/// Whether a reading error says that the packed data are damaged, and what came before is good.
pub fn is_damage(error: &io::Error) -> bool {
    matches!(error.kind(), ErrorKind::UnexpectedEof | ErrorKind::InvalidData)
}

/// All members of a gzip file, one after the other. Zeros after a member are padding.
struct Members<R> {
    /// `None` at the end.
    member: Option<GzDecoder<R>>,
}

impl<R: BufRead> Members<R> {
    fn new(packed: R) -> Self {
        Self { member: Some(GzDecoder::new(packed)) }
    }

    /// Goes to the next member; false when there is none.
    fn advance(&mut self) -> io::Result<bool> {
        let Some(member) = self.member.take() else { return Ok(false) };
        let mut packed = member.into_inner();
        loop {
            let rest = packed.fill_buf()?;
            let num_zeros = rest.iter().take_while(|&&byte| byte == 0).count();
            if rest.is_empty() {
                return Ok(false);
            }
            if num_zeros == 0 {
                break;
            }
            packed.consume(num_zeros);
        }
        if packed.fill_buf()?.first() != Some(&GZIP_MARK[0]) {
            return Err(io::Error::new(ErrorKind::InvalidData, "other bytes follow the packed data"));
        }
        self.member = Some(GzDecoder::new(packed));
        Ok(true)
    }
}

impl<R: BufRead> Read for Members<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        loop {
            let Some(member) = &mut self.member else { return Ok(0) };
            match member.read(buffer) {
                Ok(0) if !buffer.is_empty() => {
                    if !self.advance()? {
                        return Ok(0);
                    }
                }
                Err(error) if error.kind() == ErrorKind::UnexpectedEof => {
                    let problem = "the packed data are cut off";
                    return Err(io::Error::new(ErrorKind::UnexpectedEof, problem));
                }
                Err(error) if error.kind() == ErrorKind::InvalidInput => {
                    let problem = format!("the packed data are damaged ({error})");
                    return Err(io::Error::new(ErrorKind::InvalidData, problem));
                }
                outcome => return outcome,
            }
        }
    }
}
