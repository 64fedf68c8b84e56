//! Channels of an MCAP recording, made when their first message comes.

use std::collections::BTreeMap;
use std::io::{self, Seek, Write};

use foxglove::Encode;
use mcap::records::MessageHeader;
use mcap::{WriteOptions, Writer};
use serde::Serialize;

/// Channels by topic, with the number of the next message.
pub(crate) struct Recorder<W: Write + Seek> {
    writer: Writer<W>,
    channels: BTreeMap<String, (u16, u32)>,
}

impl<W: Write + Seek> Recorder<W> {
    /// A recording without a message.
    pub(crate) fn new(out: W) -> Result<Self, mcap::McapError> {
        Self::of_profile(out, "")
    }

    /// The same, whose messages keep the rules of a profile of MCAP.
    pub(crate) fn of_profile(out: W, profile: &str) -> Result<Self, mcap::McapError> {
        // The library's name would carry its version, and with it change the bytes. Without seeking a chunk is written whole, never
        // first its beginning: a file that ends anywhere can be read up to there.
        let options = WriteOptions::new()
            .compression(None)
            .profile(profile)
            .library("cslam")
            .disable_seeking(true);
        Ok(Self {
            writer: options.create(out)?,
            channels: BTreeMap::new(),
        })
    }

    /// Writes one of Foxglove's well-known messages.
    pub(crate) fn message<M: Encode>(
        &mut self,
        topic: &str,
        time_ns: u64,
        message: &M,
    ) -> Result<(), mcap::McapError> {
        let mut bytes = Vec::with_capacity(message.encoded_len().unwrap_or(0));
        message
            .encode(&mut bytes)
            .map_err(|e| io::Error::other(e.to_string()))?;
        let schema = || {
            let schema = M::get_schema().unwrap_or_else(|| foxglove::Schema::new("", "", &[][..]));
            (schema.name, schema.encoding, schema.data.into_owned())
        };
        self.put(topic, &M::get_message_encoding(), schema, time_ns, &bytes)
    }

    /// Writes a JSON object.
    pub(crate) fn json(
        &mut self,
        topic: &str,
        name: &str,
        schema: &str,
        time_ns: u64,
        object: &impl Serialize,
    ) -> Result<(), mcap::McapError> {
        let bytes = serde_json::to_vec(object).map_err(io::Error::from)?;
        let schema = || {
            (
                name.to_owned(),
                "jsonschema".to_owned(),
                schema.as_bytes().to_vec(),
            )
        };
        self.put(topic, "json", schema, time_ns, &bytes)
    }

    /// Writes a message of ROS 2.
    pub(crate) fn cdr(
        &mut self,
        topic: &str,
        name: &str,
        schema: impl FnOnce() -> String,
        time_ns: u64,
        bytes: &[u8],
    ) -> Result<(), mcap::McapError> {
        let schema = || (name.to_owned(), "ros2msg".to_owned(), schema().into_bytes());
        self.put(topic, "cdr", schema, time_ns, bytes)
    }

    /// Closes the chunk and gives it to the system: whatever happens then, a reader finds what was written up to here.
    #[cfg(feature = "ground")]
    pub(crate) fn flush(&mut self) -> Result<(), mcap::McapError> {
        self.writer.flush()
    }

    /// Writes the index; without it a recording can be read from its beginning only.
    pub(crate) fn finish(&mut self) -> Result<(), mcap::McapError> {
        self.writer.finish().map(drop)
    }

    fn put(
        &mut self,
        topic: &str,
        encoding: &str,
        schema: impl FnOnce() -> (String, String, Vec<u8>),
        time_ns: u64,
        bytes: &[u8],
    ) -> Result<(), mcap::McapError> {
        if !self.channels.contains_key(topic) {
            let (name, schema_encoding, data) = schema();
            let schema_id = self.writer.add_schema(&name, &schema_encoding, &data)?;
            let channel_id = self
                .writer
                .add_channel(schema_id, topic, encoding, &BTreeMap::new())?;
            self.channels.insert(topic.to_owned(), (channel_id, 0));
        }
        let Some((channel_id, sequence)) = self.channels.get_mut(topic) else {
            return Ok(());
        };
        let header = MessageHeader {
            channel_id: *channel_id,
            sequence: *sequence,
            log_time: time_ns,
            publish_time: time_ns,
        };
        *sequence += 1;
        self.writer.write_to_known_channel(&header, bytes)
    }
}
