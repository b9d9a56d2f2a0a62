//! A socket that the application Foxglove connects to, and whatever else knows its protocol.
//!
//! Channels, schemas and messages are those of `run.mcap`. The library serves each client from a
//! queue of its own and drops the oldest messages of one that is slow; nobody is waited for.

use anyhow::{Context as _, Result};
use cli_output::{Failure, Outcome};
use foxglove::{
    ChannelBuilder, Context, FoxgloveError, PartialMetadata, RawChannel, Schema, WebSocketServer,
    WebSocketServerHandle,
};
use run_log::{Channel, Sink};
use serde_json::Value;
use std::net::SocketAddr;
use std::sync::Arc;

/// Messages that wait for a client at most: more than a second of all but the fast ones. A
/// picture may have half a megabyte.
const BACKLOG: usize = 64;

/// A server with all channels of a run.
#[derive(Debug)]
pub struct Socket {
    /// By number of the channel; none where nothing is told.
    channels: Vec<Option<Arc<RawChannel>>>,
    address: SocketAddr,
    /// The server knows it, and through it the channels, for as long as it is here.
    _context: Arc<Context>,
    server: Option<WebSocketServerHandle>,
}

impl Socket {
    /// Begins to serve. Clients can subscribe, and nothing else: neither publish nor set
    /// parameters nor call services.
    ///
    /// # Errors
    /// Nothing can be listened to there.
    pub fn start(bind: SocketAddr) -> Outcome<Self> {
        Self::serve(bind).map_err(Failure::of_server)
    }

    fn serve(bind: SocketAddr) -> Result<Self> {
        let context = Context::new();
        let mut channels = Vec::new();
        for (channel, schema) in Channel::with_schemas()? {
            // Simulated when a run has ended, for its file.
            let told = schema.filter(|_| channel != Channel::Rope);
            let raw = told.map(|(name, schema)| {
                ChannelBuilder::new(channel.topic())
                    .context(&context)
                    .message_encoding("json")
                    .schema(Schema::new(name, "jsonschema", schema.into_bytes()))
                    .build_raw()
            });
            channels.push(raw.transpose()?);
        }
        let server = WebSocketServer::new()
            .context(&context)
            .name("wag")
            .capabilities([])
            .message_backlog_size(BACKLOG)
            .bind(bind.ip().to_string(), bind.port())
            .start_blocking()
            .map_err(|error| match error {
                // Told as what it is, so that an address that there is not can be told apart.
                FoxgloveError::Bind(error) => anyhow::Error::from(error),
                error => error.into(),
            })
            .with_context(|| {
                format!(
                    "cannot serve Foxglove at {bind}; name another place with --foxglove=ADDR:PORT"
                )
            })?;
        let address = SocketAddr::new(bind.ip(), server.port());
        Ok(Self {
            channels,
            address,
            _context: context,
            server: Some(server),
        })
    }

    /// Where clients connect to.
    #[must_use]
    pub fn url(&self) -> String {
        format!("ws://{}", self.address)
    }

    fn channel(&self, channel: Channel) -> Option<&RawChannel> {
        self.channels.get(channel as usize)?.as_deref()
    }
}

impl Sink for Socket {
    fn wants(&self, channel: Channel) -> bool {
        self.channel(channel).is_some_and(RawChannel::has_sinks)
    }

    fn message(&mut self, channel: Channel, at_ns: u64, message: &Value) -> Result<()> {
        if let Some(raw) = self.channel(channel).filter(|raw| raw.has_sinks()) {
            let at = PartialMetadata::with_log_time(at_ns);
            raw.log_with_meta(message.to_string().as_bytes(), at);
        }
        Ok(())
    }

    fn begin_anew(&mut self) -> Result<()> {
        if let Some(server) = &self.server {
            server.clear_session(None);
        }
        Ok(())
    }
}

impl Drop for Socket {
    fn drop(&mut self) {
        // Not waited for: a client that takes nothing in could make it last for ever.
        drop(self.server.take().map(WebSocketServerHandle::stop));
    }
}
