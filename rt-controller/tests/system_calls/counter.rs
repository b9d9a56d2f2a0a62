//! Counts the system calls of one thread, without slowing others down and
//! without any program beside the test.
//!
//! A seccomp filter turns every system call of the thread into a `SIGSYS`, whose
//! handler counts it and makes the call in the thread's stead, from the one
//! instruction that the filter lets through. Nothing can be called past it; what
//! the kernel answers without being called (`clock_gettime` in the vDSO) is no
//! system call.

use std::cell::Cell;
use std::io::Error;

/// Numbers above the newest call of any kernel.
const NUMBERS: usize = 512;

thread_local! {
    static COUNTS: [Cell<u32>; NUMBERS] = const { [const { Cell::new(0) }; NUMBERS] };
    static ON: Cell<bool> = const { Cell::new(false) };
}

/// Calls since they were last taken, by number.
pub(crate) struct Calls(Vec<(usize, u32)>);

impl Calls {
    /// How often `number` was called.
    pub(crate) fn of(&self, number: libc::c_long) -> u32 {
        self.0
            .iter()
            .filter(|(n, _)| usize::try_from(number) == Ok(*n))
            .map(|(_, count)| count)
            .sum()
    }

    /// Number and count of every other call than these.
    pub(crate) fn beside(&self, numbers: &[libc::c_long]) -> Vec<(usize, u32)> {
        let known = |n: &usize| numbers.iter().any(|k| usize::try_from(*k) == Ok(*n));
        self.0.iter().filter(|(n, _)| !known(n)).copied().collect()
    }
}

/// Starts or stops the count of the calling thread.
pub(crate) fn count(on: bool) {
    ON.with(|o| o.set(on));
}

/// What the calling thread has called since the last time.
pub(crate) fn take() -> Calls {
    COUNTS.with(|counts| {
        let found = counts.iter().map(Cell::take).enumerate();
        Calls(found.filter(|(_, count)| *count > 0).collect())
    })
}

core::arch::global_asm!(
    "wag_test_call:",
    "mov rax, rdi",
    "mov r11, rsi",
    "mov rdi, [r11]",
    "mov rsi, [r11 + 8]",
    "mov rdx, [r11 + 16]",
    "mov r10, [r11 + 24]",
    "mov r8, [r11 + 32]",
    "mov r9, [r11 + 40]",
    "syscall",
    "wag_test_called:",
    "ret",
);

unsafe extern "C" {
    /// Makes system call `number` with six arguments.
    fn wag_test_call(number: i64, arguments: *const i64) -> i64;
    /// Where it returns to; no function.
    fn wag_test_called();
}

extern "C" fn on_call(_: libc::c_int, _: *mut libc::siginfo_t, context: *mut libc::c_void) {
    use libc::{REG_R8, REG_R9, REG_R10, REG_RAX, REG_RDI, REG_RDX, REG_RSI};
    // SAFETY: the kernel passes a valid context to a SA_SIGINFO handler, and
    // nobody else has it while the handler runs.
    let context = unsafe { &mut *context.cast::<libc::ucontext_t>() };
    let registers = &mut context.uc_mcontext.gregs;
    let number = registers[REG_RAX as usize];
    let place = usize::try_from(number).unwrap_or(0).min(NUMBERS - 1);
    if ON.with(Cell::get) {
        COUNTS.with(|counts| counts[place].set(counts[place].get() + 1));
    }
    let arguments = [REG_RDI, REG_RSI, REG_RDX, REG_R10, REG_R8, REG_R9]
        .map(|register| registers[register as usize]);
    // SAFETY: exactly the call that the thread was about to make; its pointers
    // are the thread's, which waits for this handler.
    registers[REG_RAX as usize] = unsafe { wag_test_call(number, arguments.as_ptr()) };
}

/// Puts the calling thread under watch for the rest of its life.
pub(crate) fn watch_this_thread() {
    install_handler();
    let at = wag_test_called as *const () as u64;
    let (low, high) = ((at & 0xffff_ffff) as u32, (at >> 32) as u32);
    let load = |offset: u32| statement(libc::BPF_LD | libc::BPF_W | libc::BPF_ABS, offset);
    let equal = |value: u32, yes: u8, no: u8| libc::sock_filter {
        jt: yes,
        jf: no,
        ..statement(libc::BPF_JMP | libc::BPF_JEQ | libc::BPF_K, value)
    };
    let give = |action: u32| statement(libc::BPF_RET | libc::BPF_K, action);
    // seccomp_data: number at 0, instruction pointer at 8.
    let mut filter = [
        load(8),
        equal(low, 0, 2),
        load(12),
        equal(high, 3, 0),
        load(0),
        equal(libc::SYS_rt_sigreturn as u32, 1, 0),
        give(libc::SECCOMP_RET_TRAP),
        give(libc::SECCOMP_RET_ALLOW),
    ];
    let program = libc::sock_fprog {
        len: u16::try_from(filter.len()).unwrap(),
        filter: filter.as_mut_ptr(),
    };
    // SAFETY: plain numbers; the filter below needs it without privileges.
    let code = unsafe { libc::prctl(libc::PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) };
    assert_eq!(code, 0, "{}", Error::last_os_error());
    // SAFETY: `program` points to a valid filter, which the kernel copies.
    let code = unsafe {
        libc::syscall(
            libc::SYS_seccomp,
            libc::SECCOMP_SET_MODE_FILTER,
            0,
            &raw const program,
        )
    };
    assert_eq!(code, 0, "no seccomp filter: {}", Error::last_os_error());
}

fn statement(code: u32, k: u32) -> libc::sock_filter {
    libc::sock_filter {
        code: u16::try_from(code).unwrap(),
        jt: 0,
        jf: 0,
        k,
    }
}

fn install_handler() {
    // SAFETY: an all-zero sigaction is valid; its fields are set just below.
    let mut action: libc::sigaction = unsafe { core::mem::zeroed() };
    action.sa_sigaction = on_call as *const () as usize;
    action.sa_flags = libc::SA_SIGINFO;
    // SAFETY: `action` is valid; the handler touches thread-local cells only.
    let code = unsafe { libc::sigaction(libc::SIGSYS, &raw const action, core::ptr::null_mut()) };
    assert_eq!(code, 0, "{}", Error::last_os_error());
}
