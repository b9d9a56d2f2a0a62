//! Typed request-response over shared memory: one request, a stream of events.
//!
//! Requests and events vary in size, so they travel as postcard bytes behind a
//! small header (magic, version, length, CRC-32). Not RT-safe.

use super::bytes::{BytesCall, BytesClient, BytesServer, PendingBytes};
use super::{Bus, IpcError};
use serde::{Serialize, de::DeserializeOwned};
use std::marker::PhantomData;
use std::time::{Duration, Instant};

/// A service that processes ask each other.
pub trait Rpc {
    /// Service name.
    const NAME: &'static str;
    /// What is asked.
    type Request: Serialize + DeserializeOwned;
    /// What is answered, possibly many times; see [`Rpc::is_last`].
    type Event: Serialize + DeserializeOwned;
    /// Whether no event follows this one.
    fn is_last(event: &Self::Event) -> bool;
}

const MAGIC: [u8; 4] = *b"WAG1";
const HEADER: usize = 12;

/// Wraps `value` as magic, length, CRC-32 and postcard bytes.
///
/// # Errors
/// [`IpcError::Message`] when the value cannot be written.
pub fn encode<T: Serialize>(service: &'static str, value: &T) -> Result<Vec<u8>, IpcError> {
    let fail = |reason: String| IpcError::Message { service, reason };
    let body = postcard::to_allocvec(value).map_err(|e| fail(e.to_string()))?;
    let length = u32::try_from(body.len()).map_err(|e| fail(e.to_string()))?;
    let mut out = Vec::with_capacity(HEADER + body.len());
    out.extend_from_slice(&MAGIC);
    out.extend_from_slice(&length.to_le_bytes());
    out.extend_from_slice(&crc32fast::hash(&body).to_le_bytes());
    out.extend_from_slice(&body);
    Ok(out)
}

/// Undoes [`encode`].
///
/// # Errors
/// [`IpcError::Message`] for wrong magic, length, checksum or content.
pub fn decode<T: DeserializeOwned>(service: &'static str, bytes: &[u8]) -> Result<T, IpcError> {
    let fail = |reason: &str| IpcError::Message {
        service,
        reason: reason.to_owned(),
    };
    let (header, body) = bytes
        .split_first_chunk::<HEADER>()
        .ok_or_else(|| fail("too short"))?;
    let (words, _) = header.as_chunks::<4>();
    if words[0] != MAGIC {
        return Err(fail("unknown magic number"));
    }
    if body.len() != u32::from_le_bytes(words[1]) as usize {
        return Err(fail("wrong length"));
    }
    if crc32fast::hash(body) != u32::from_le_bytes(words[2]) {
        return Err(fail("wrong checksum"));
    }
    postcard::from_bytes(body).map_err(|e| fail(&e.to_string()))
}

/// The answering end.
#[derive(Debug)]
pub struct RpcServer<R: Rpc>(BytesServer, PhantomData<R>);

impl<R: Rpc> RpcServer<R> {
    /// Opens the service. There is one server per domain.
    ///
    /// # Errors
    /// [`IpcError::Open`], for instance when another process serves already.
    pub fn open(bus: &Bus) -> Result<Self, IpcError> {
        Ok(Self(BytesServer::open(bus, R::NAME)?, PhantomData))
    }

    /// The next request, if one waits.
    ///
    /// # Errors
    /// [`IpcError::Failed`]; [`IpcError::Message`] for one that cannot be
    /// understood (it is dropped, the caller sees its answer end).
    pub fn receive(&self) -> Result<Option<Call<R>>, IpcError> {
        let Some((request, active)) = self.0.receive(R::NAME)? else {
            return Ok(None);
        };
        let request = decode(R::NAME, &request)?;
        Ok(Some(Call { request, active }))
    }
}

/// One request being answered.
#[derive(Debug)]
pub struct Call<R: Rpc> {
    /// What was asked.
    pub request: R::Request,
    active: BytesCall,
}

impl<R: Rpc> Call<R> {
    /// Sends one event.
    pub fn send(&self, event: &R::Event) -> Result<(), IpcError> {
        self.active.send(R::NAME, &encode(R::NAME, event)?)
    }

    /// Whether the caller still listens.
    #[must_use]
    pub fn is_wanted(&self) -> bool {
        self.active.is_wanted()
    }
}

/// The asking end.
#[derive(Debug)]
pub struct RpcClient<R: Rpc>(BytesClient, PhantomData<R>);

impl<R: Rpc> RpcClient<R> {
    /// Opens the service; the server may come later.
    pub fn open(bus: &Bus) -> Result<Self, IpcError> {
        Ok(Self(BytesClient::open(bus, R::NAME)?, PhantomData))
    }

    /// Sends a request.
    ///
    /// # Errors
    /// [`IpcError::Gone`] when nobody serves, else transfer errors.
    pub fn call(&self, request: &R::Request) -> Result<Pending<R>, IpcError> {
        let bytes = encode(R::NAME, request)?;
        Ok(Pending(self.0.call(R::NAME, &bytes)?, PhantomData))
    }
}

/// A request on its way; events come out.
#[derive(Debug)]
pub struct Pending<R: Rpc>(PendingBytes, PhantomData<R>);

impl<R: Rpc> Pending<R> {
    /// The next event, if one has come.
    ///
    /// # Errors
    /// [`IpcError::Gone`] when the server ended before its last event.
    pub fn try_next(&self) -> Result<Option<R::Event>, IpcError> {
        let event = self.0.try_next(R::NAME)?;
        event.map(|bytes| decode(R::NAME, &bytes)).transpose()
    }

    /// Waits for the last event and returns it; earlier ones go to `each`.
    /// `keep_waiting` is asked every few milliseconds.
    ///
    /// # Errors
    /// [`IpcError::Failed`] when time is up, [`IpcError::Gone`], or what `keep_waiting` says.
    pub fn finish<E: From<IpcError>>(
        &self,
        timeout: Duration,
        mut keep_waiting: impl FnMut() -> Result<(), E>,
        mut each: impl FnMut(&R::Event),
    ) -> Result<R::Event, E> {
        let began = Instant::now();
        loop {
            if let Some(event) = self.try_next()? {
                if R::is_last(&event) {
                    return Ok(event);
                }
                each(&event);
                continue;
            }
            keep_waiting()?;
            if began.elapsed() > timeout {
                return Err(IpcError::Failed(format!(
                    "the process behind `{}` did not answer within {} s",
                    R::NAME,
                    timeout.as_secs()
                ))
                .into());
            }
            std::thread::sleep(Duration::from_millis(2));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    struct Counting;
    impl Rpc for Counting {
        const NAME: &'static str = "wag/v1/test/counting";
        type Request = (u32, Vec<u8>);
        type Event = Option<u32>;
        fn is_last(event: &Self::Event) -> bool {
            event.is_none()
        }
    }

    fn domain(tag: &str) -> String {
        format!("test_{tag}_{}", std::process::id())
    }

    #[test]
    fn a_request_is_answered_by_a_stream_of_events() {
        let name = domain("stream");
        let bus = Bus::join(&name).unwrap();
        let server = RpcServer::<Counting>::open(&bus).unwrap();
        let client = RpcClient::<Counting>::open(&Bus::join(&name).unwrap()).unwrap();
        let pending = client.call(&(3, vec![7; 50_000])).unwrap();
        let call = server.receive().unwrap().unwrap();
        assert_eq!(call.request.1.len(), 50_000);
        for i in 0..call.request.0 {
            call.send(&Some(i)).unwrap();
        }
        call.send(&None).unwrap();
        drop(call);
        let mut seen = Vec::new();
        let last = pending.finish::<IpcError>(Duration::from_secs(1), || Ok(()), |e| seen.push(*e));
        assert_eq!(last, Ok(None));
        assert_eq!(seen, [Some(0), Some(1), Some(2)]);
    }

    #[test]
    fn a_server_that_ends_early_is_noticed() {
        let name = domain("gone");
        let bus = Bus::join(&name).unwrap();
        let client = RpcClient::<Counting>::open(&bus).unwrap();
        let gone = IpcError::Gone {
            service: Counting::NAME,
        };
        assert_eq!(client.call(&(0, vec![])).err(), Some(gone.clone()));
        let server = RpcServer::<Counting>::open(&bus).unwrap();
        let pending = client.call(&(1, vec![])).unwrap();
        drop(server.receive().unwrap().unwrap());
        let end = pending.finish::<IpcError>(Duration::from_secs(1), || Ok(()), |_| ());
        assert_eq!(end, Err(gone));
    }

    #[test]
    fn domains_do_not_see_each_other() {
        let server = RpcServer::<Counting>::open(&Bus::join(&domain("one")).unwrap()).unwrap();
        let client = RpcClient::<Counting>::open(&Bus::join(&domain("two")).unwrap()).unwrap();
        assert!(client.call(&(0, vec![])).is_err());
        assert!(server.receive().unwrap().is_none());
        let refused = Bus::join("no/slash");
        assert!(matches!(refused, Err(IpcError::Domain { .. })));
    }

    proptest! {
        #[test]
        fn damaged_messages_are_refused(at in 0usize..40, flip in 1u8..=255) {
            let mut bytes = encode("t", &vec![1u32, 70_000, 3_000_000_000, 7]).unwrap();
            let at = at % bytes.len();
            bytes[at] ^= flip;
            prop_assert!(decode::<Vec<u32>>("t", &bytes).is_err());
        }

        #[test]
        fn any_bytes_are_refused_or_read(bytes in prop::collection::vec(any::<u8>(), 0..64)) {
            let _ = decode::<Vec<(u64, String)>>("t", &bytes);
        }
    }
}
