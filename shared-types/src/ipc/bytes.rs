//! Requests and answers as bytes. Nothing here is generic: what uses the library's
//! request-response ports is compiled in this crate, not in every crate and test that calls a
//! service.

use super::bus::{Transport, open_error};
use super::{Bus, IpcError};
use iceoryx2::active_request::ActiveRequest;
use iceoryx2::pending_response::PendingResponse;
use iceoryx2::port::client::Client;
use iceoryx2::port::server::Server;
use iceoryx2::prelude::*;
use iceoryx2::service::port_factory::request_response::PortFactory;

/// Events a caller may leave unread before the server has to wait.
const EVENT_BUFFER: usize = 256;
/// Of one service; each page that is watched keeps one of the controller's.
const MAX_CLIENTS: usize = 16;

type BytesService = PortFactory<Transport, [u8], (), [u8], ()>;

fn open(bus: &Bus, name: &'static str) -> Result<BytesService, IpcError> {
    bus.service(name)?
        .request_response::<[u8], [u8]>()
        .max_clients(MAX_CLIENTS)
        .max_servers(1)
        .max_nodes(MAX_CLIENTS + 1)
        .max_active_requests_per_client(4)
        .max_response_buffer_size(EVENT_BUFFER)
        .enable_safe_overflow_for_responses(false)
        .open_or_create()
        .map_err(open_error(name))
}

/// The answering end of one service.
#[derive(Debug)]
pub(super) struct BytesServer(Server<Transport, [u8], (), [u8], ()>);

impl BytesServer {
    pub(super) fn open(bus: &Bus, name: &'static str) -> Result<Self, IpcError> {
        let server = open(bus, name)?
            .server_builder()
            .initial_max_slice_len(4096)
            .allocation_strategy(AllocationStrategy::PowerOfTwo)
            .backpressure_strategy(BackpressureStrategy::RetryUntilDelivered)
            .create()
            .map_err(open_error(name))?;
        Ok(Self(server))
    }

    /// The next request, if one waits.
    pub(super) fn receive(
        &self,
        name: &'static str,
    ) -> Result<Option<(Vec<u8>, BytesCall)>, IpcError> {
        let active = self.0.receive().map_err(IpcError::transfer(name))?;
        Ok(active.map(|active| (active.payload().to_vec(), BytesCall(active))))
    }
}

/// A request being answered.
#[derive(Debug)]
pub(super) struct BytesCall(ActiveRequest<Transport, [u8], (), [u8], ()>);

impl BytesCall {
    pub(super) fn send(&self, name: &'static str, bytes: &[u8]) -> Result<(), IpcError> {
        let loan = self.0.loan_slice_uninit(bytes.len());
        let loan = loan.map_err(IpcError::transfer(name))?;
        let sent = loan.write_from_slice(bytes).send();
        sent.map_err(IpcError::transfer(name))
    }

    pub(super) fn is_wanted(&self) -> bool {
        self.0.is_connected()
    }
}

/// The asking end of one service.
#[derive(Debug)]
pub(super) struct BytesClient(Client<Transport, [u8], (), [u8], ()>);

impl BytesClient {
    pub(super) fn open(bus: &Bus, name: &'static str) -> Result<Self, IpcError> {
        let client = open(bus, name)?
            .client_builder()
            .initial_max_slice_len(4096)
            .allocation_strategy(AllocationStrategy::PowerOfTwo)
            .create()
            .map_err(open_error(name))?;
        Ok(Self(client))
    }

    /// Sends a request. [`IpcError::Gone`] when nobody serves.
    pub(super) fn call(&self, name: &'static str, bytes: &[u8]) -> Result<PendingBytes, IpcError> {
        let loan = self.0.loan_slice_uninit(bytes.len());
        let loan = loan.map_err(IpcError::transfer(name))?;
        let pending = loan.write_from_slice(bytes).send();
        let pending = pending.map_err(IpcError::transfer(name))?;
        if pending.number_of_server_connections() == 0 {
            return Err(IpcError::Gone { service: name });
        }
        Ok(PendingBytes(pending))
    }
}

/// A request on its way.
#[derive(Debug)]
pub(super) struct PendingBytes(PendingResponse<Transport, [u8], (), [u8], ()>);

impl PendingBytes {
    /// The next event, if one has come. [`IpcError::Gone`] when the server ended and none is
    /// left.
    pub(super) fn try_next(&self, name: &'static str) -> Result<Option<Vec<u8>>, IpcError> {
        // Asked first: what came before the server ended must not be lost.
        let connected = self.0.is_connected();
        match self.0.receive().map_err(IpcError::transfer(name))? {
            Some(response) => Ok(Some(response.payload().to_vec())),
            None if !connected => Err(IpcError::Gone { service: name }),
            None => Ok(None),
        }
    }
}
