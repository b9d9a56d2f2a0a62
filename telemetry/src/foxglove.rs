//! A socket that the application Foxglove connects to, and whatever else knows its protocol.
//!
//! Channels, schemas and messages are those of `run.mcap`. The library serves each client from a
//! queue of its own and drops the oldest messages of one that is slow; nobody is waited for.

#[cfg(feature = "foxglove")]
mod socket {
    use anyhow::{Context as _, Result};
    use foxglove::{
        ChannelBuilder, Context, PartialMetadata, RawChannel, Schema, WebSocketServer,
        WebSocketServerHandle,
    };
    use run_log::{Channel, Sink};
    use serde_json::Value;
    use std::net::SocketAddr;
    use std::sync::Arc;

    /// A server with all channels of a run.
    #[derive(Debug)]
    pub struct Socket {
        /// By number of the channel; none for bytes that only this program reads.
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
        pub fn start(bind: SocketAddr) -> Result<Self> {
            let context = Context::new();
            let mut channels = Vec::new();
            for channel in Channel::all() {
                let raw = channel.schema()?.map(|(name, schema)| {
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
                .bind(bind.ip().to_string(), bind.port())
                .start_blocking()
                .with_context(|| format!("cannot serve Foxglove at {bind}"))?;
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
    }

    impl Drop for Socket {
        fn drop(&mut self) {
            if let Some(server) = self.server.take() {
                server.stop().wait_blocking();
            }
        }
    }
}

#[cfg(not(feature = "foxglove"))]
mod socket {
    use anyhow::{Result, bail};
    use run_log::{Channel, Sink};
    use serde_json::Value;
    use std::convert::Infallible;
    use std::net::SocketAddr;

    /// There is none in this build.
    #[derive(Debug)]
    pub struct Socket(Infallible);

    impl Socket {
        /// Always refuses.
        ///
        /// # Errors
        /// How a build that can is made.
        pub fn start(_bind: SocketAddr) -> Result<Self> {
            bail!(
                "this build has no socket for Foxglove; build it with `cargo build --release -p \
                 wag --features foxglove` (the Debian package has it)"
            )
        }

        /// Never called.
        #[must_use]
        pub fn url(&self) -> String {
            match self.0 {}
        }
    }

    impl Sink for Socket {
        fn message(&mut self, _: Channel, _: u64, _: &Value) -> Result<()> {
            match self.0 {}
        }
    }
}

pub use socket::Socket;
