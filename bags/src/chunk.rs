//! Unpacking of chunks: uncompressed ones without a copy.

use std::{borrow::Cow, io::Read};

use crate::record::Chunk;

/// More than this in one chunk is taken for damage \[bytes\]. rosbag2 writes a few megabytes. With what stands beside it in
/// [`Messages`](crate::Messages) no bag takes more than half a gigabyte of memory.
pub(crate) const LARGEST: u64 = 128 << 20;

/// Unpacks chunks; keeps what can be used again from one to the next.
#[derive(Default)]
pub(crate) struct Unpacker {
    zstd: Option<zstd::bulk::Decompressor<'static>>,
}

impl Unpacker {
    /// The records of a whole chunk, into `buffer` where they have to be unpacked. The reason, where it is not good.
    pub fn unpack<'a>(
        &mut self,
        chunk: &Chunk<'a>,
        mut buffer: Vec<u8>,
    ) -> Result<Cow<'a, [u8]>, String> {
        if chunk.unpacked_length > LARGEST {
            return Err(format!(
                "it claims to hold {} bytes, expected at most {LARGEST}",
                chunk.unpacked_length
            ));
        }
        let length = chunk.unpacked_length as usize;
        buffer.clear();
        let records = match chunk.compression {
            "" => Cow::Borrowed(chunk.packed),
            "zstd" => {
                buffer
                    .try_reserve_exact(length)
                    .map_err(|e| e.to_string())?;
                if self.zstd.is_none() {
                    self.zstd = Some(zstd::bulk::Decompressor::new().map_err(|e| e.to_string())?);
                }
                if let Some(zstd) = &mut self.zstd {
                    zstd.decompress_to_buffer(chunk.packed, &mut buffer)
                        .map_err(|e| e.to_string())?;
                }
                Cow::Owned(buffer)
            }
            "lz4" => {
                let decoder = lz4::Decoder::new(chunk.packed).map_err(|e| e.to_string())?;
                decoder
                    .take(chunk.unpacked_length + 1)
                    .read_to_end(&mut buffer)
                    .map_err(|e| e.to_string())?;
                Cow::Owned(buffer)
            }
            other => return Err(format!("compression '{other}' is not known")),
        };
        if records.len() != length {
            return Err(format!(
                "it unpacks to {} bytes instead of {length}",
                records.len()
            ));
        }
        if chunk.crc != 0 {
            let calculated = crc32fast::hash(&records);
            if calculated != chunk.crc {
                return Err(format!(
                    "CRC is {calculated:08x} instead of {:08x}",
                    chunk.crc
                ));
            }
        }
        Ok(records)
    }

    /// What can be unpacked of a chunk that the end of the file cut off; its CRC cannot be checked.
    pub fn salvage(chunk: &Chunk<'_>) -> Vec<u8> {
        let limit = chunk.unpacked_length.min(LARGEST);
        let mut records = Vec::new();
        // The end of the input is an error to every decoder; what came out before it counts.
        let _ = match chunk.compression {
            "" => chunk.packed.take(limit).read_to_end(&mut records),
            "zstd" => zstd::Decoder::new(chunk.packed)
                .and_then(|d| d.take(limit).read_to_end(&mut records)),
            "lz4" => lz4::Decoder::new(chunk.packed)
                .and_then(|d| d.take(limit).read_to_end(&mut records)),
            _ => Ok(0),
        };
        records
    }
}
