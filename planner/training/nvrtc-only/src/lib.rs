//! What `cubecl-cuda` needs to know of an LLVM back-end to be built, and nothing behind it.
//!
//! `cubecl-cuda` with its feature `cpp` sends CUDA C++ through NVRTC and never comes here.
//! Without that feature it would; then every kernel is refused with the reason.
#![forbid(unsafe_code)]

use cubecl_environment::backtrace::BackTrace;
use cubecl_core::ir::nvidia::SmArch;
use cubecl_core::prelude::KernelDefinition;
use cubecl_server::compiler::CompilationError;
use cubecl_server::kernel::BufferIOAttr;

/// Where kernels would run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LlvmTarget {
    /// An NVIDIA card.
    Nvptx,
}

/// A compiler that refuses.
#[derive(Clone, Debug)]
pub struct PlironCompiler {
    /// Where kernels would run.
    pub target: LlvmTarget,
}

/// Options of the compiler.
#[derive(Clone, Debug, Default)]
pub struct PlironOptions {
    /// Architecture of an AMD card; there is none here.
    pub arch: Option<core::convert::Infallible>,
    /// Architecture of an NVIDIA card.
    pub sm_arch: Option<SmArch>,
    /// Version of PTX.
    pub ptx_version: Option<nvptx::ptx_version::PtxVersion>,
    /// Whether scalars come in the kernel's parameters.
    pub grid_constants: bool,
}

/// A compiled kernel; never made here.
#[derive(Clone, Debug)]
pub struct NvptxModule {
    /// PTX, ended by a zero.
    pub ptx: Vec<core::ffi::c_char>,
    /// Text for logs.
    pub ir: String,
    /// Shared memory of a launch (bytes).
    pub shared_memory_size: usize,
    /// Access to the buffers, in their order.
    pub io: Vec<BufferIOAttr>,
}

/// What comes out of the compiler; never made here.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub enum PlironArtifact {
    /// For an NVIDIA card.
    NvptxCode(NvptxModule),
}

impl PlironCompiler {
    /// Refuses.
    ///
    /// # Errors
    /// Always: this build has no LLVM.
    pub fn compile(
        &mut self,
        _kernel: KernelDefinition,
        _options: &PlironOptions,
    ) -> Result<PlironArtifact, CompilationError> {
        Err(CompilationError::Generic {
            reason: "this build has no LLVM: build with cubecl's feature `cuda-cpp`, which \
                     compiles kernels with NVRTC"
                .to_owned(),
            backtrace: BackTrace::capture(),
        })
    }

    /// Name of the language in logs.
    #[must_use]
    pub fn lang_tag(&self) -> &'static str {
        "none"
    }
}

/// NVIDIA cards.
pub mod nvptx {
    /// Versions of PTX.
    pub mod ptx_version {
        use core::fmt;

        /// A version of PTX; never made here.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
        pub enum PtxVersion {}

        impl PtxVersion {
            /// None: nothing here emits PTX.
            #[must_use]
            pub fn for_driver(_driver: i32) -> Option<Self> {
                None
            }
        }

        impl fmt::Display for PtxVersion {
            fn fmt(&self, _: &mut fmt::Formatter<'_>) -> fmt::Result {
                match *self {}
            }
        }
    }
}

/// What back-ends share.
pub mod shared {
    /// Features of devices.
    pub mod lowered_features {
        use cubecl_core::ir::DeviceProperties;

        /// A kind of card.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub enum GpuTarget {
            /// NVIDIA's.
            Nvptx,
        }

        /// Leaves the properties as they are: no kernel comes through here.
        pub fn restrict_features(_props: &mut DeviceProperties, _target: GpuTarget) {}
    }
}
