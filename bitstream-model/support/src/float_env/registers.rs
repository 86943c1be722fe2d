//! Reads and writes the registers of the floating-point environment: the one module with their
//! instructions.
//!
//! # Safety
//!
//! Two invariants make every write sound. A written value was read from the registers before, or is
//! [`Registers::STANDARD`], or was given to [`foreign::under`](super::foreign::under), whose caller
//! answers for it, or differs from one of them in flags, and on aarch64 in FZ: no reserved bit is
//! set. And Rust's own requirement, that its code runs in the standard environment, is established
//! by a write, or given up to code that was in another one already. With FZ set it holds as long as
//! no flag says that a number was flushed, and where one does, the results are dropped.

pub(super) use arch::Registers;

impl Registers {
    /// Has this thread leave the environment that was just read for this one, if it is in another.
    #[inline]
    pub(super) fn enter_from(self, found: Self) {
        if found.control() != self.control() {
            self.write();
        }
    }

    /// Gives this thread the environment back, its exception flags too.
    #[inline]
    pub(super) fn restore(self) {
        self.write_over(Self::read());
    }
}

/// An effect on memory and on the environment, as far as the compiler can tell.
#[inline]
pub(super) fn effect() {
    #[cfg(all(any(target_arch = "x86_64", target_arch = "aarch64"), not(miri)))]
    // SAFETY: there is no instruction.
    unsafe {
        std::arch::asm!("", options(nostack, preserves_flags));
    }
}

#[cfg(all(target_arch = "x86_64", not(miri)))]
mod arch {
    use std::arch::asm;

    /// MXCSR.
    #[derive(Debug, Clone, Copy, PartialEq, Eq)]
    pub(in crate::float_env) struct Registers(u32);

    impl Registers {
        /// All exceptions masked, everything else 0.
        pub(in crate::float_env) const STANDARD: Self = Self(0x1F80);
        /// The exception flags.
        const FLAGS: u32 = 0x3F;
        /// Of them denormal and underflow.
        const SUBNORMAL: u32 = 0x12;
        /// Of callers.
        #[cfg(any(test, feature = "foreign-environment"))]
        pub(in crate::float_env) const FOREIGN: &[(&str, Self)] = &[
            ("flush to zero", Self(0x9FC0)),
            ("upward", Self(0x5F80)),
            ("downward", Self(0x3F81)),
            ("toward zero", Self(0x7FBF)),
            ("every exception traps", Self(0)),
        ];

        /// The registers of this thread.
        #[inline]
        pub(in crate::float_env) fn read() -> Self {
            let mut mxcsr = 0_u32;
            // SAFETY: `stmxcsr` stores the four bytes of `mxcsr` and changes no register.
            unsafe {
                asm!("stmxcsr [{}]", in(reg) &raw mut mxcsr, options(nostack, preserves_flags));
            }
            Self(mxcsr)
        }

        /// The same, with the flags down that a subnormal number raises.
        pub(in crate::float_env) const fn watching(self) -> Self {
            Self(self.0 & !Self::SUBNORMAL)
        }

        /// Whether all of these flags are still down.
        pub(in crate::float_env) const fn saw_no_subnormal(self) -> bool {
            self.0 & Self::SUBNORMAL == 0
        }

        /// The bits that decide results and traps.
        #[inline]
        pub(in crate::float_env) const fn control(self) -> u32 {
            self.0 & !Self::FLAGS
        }

        /// Writes these registers over the current ones, `now`, where they differ.
        #[inline]
        pub(super) fn write_over(self, now: Self) {
            if self != now {
                self.write();
            }
        }

        /// Sets this.
        #[inline]
        pub(super) fn write(self) {
            let mxcsr = self.0;
            // SAFETY: `ldmxcsr` loads the four bytes of `mxcsr`; no reserved bit is set in it, and
            // whose environment it is, the module's head says. Flags that are loaded do not trap.
            unsafe { asm!("ldmxcsr [{}]", in(reg) &raw const mxcsr, options(nostack)) };
        }
    }
}

#[cfg(all(target_arch = "aarch64", not(miri)))]
mod arch {
    use std::arch::asm;

    /// FPCR and FPSR.
    #[derive(Debug, Clone, Copy, PartialEq, Eq)]
    pub(in crate::float_env) struct Registers {
        control: u64,
        status: u64,
    }

    impl Registers {
        /// No alternative half precision, no default NaN, no flush to zero in any width, round to
        /// nearest, no trap.
        pub(in crate::float_env) const STANDARD: Self = Self::of(0, 0);
        /// Of callers.
        #[cfg(any(test, feature = "foreign-environment"))]
        pub(in crate::float_env) const FOREIGN: &[(&str, Self)] = &[
            ("flush to zero", Self::of(1 << 24, 0)),
            ("upward", Self::of(0b01 << 22, 0)),
            ("downward", Self::of(0b10 << 22, 0x01)),
            ("toward zero", Self::of(0b11 << 22, 0x9F)),
            ("default NaN", Self::of(1 << 25, 0)),
        ];

        /// The flags UFC and IDC of FPSR.
        const SUBNORMAL: u64 = 0x88;

        const fn of(control: u64, status: u64) -> Self {
            Self { control, status }
        }

        /// The registers of this thread.
        #[inline]
        pub(in crate::float_env) fn read() -> Self {
            let (control, status);
            // SAFETY: reading FPCR, which every program may, changes nothing.
            unsafe { asm!("mrs {}, fpcr", out(reg) control, options(nostack, preserves_flags)) };
            // SAFETY: reading FPSR, which every program may, changes nothing.
            unsafe { asm!("mrs {}, fpsr", out(reg) status, options(nostack, preserves_flags)) };
            Self { control, status }
        }

        /// The same with FZ set, and with the flags down that a flushed number raises: UFC and IDC.
        pub(in crate::float_env) const fn watching(self) -> Self {
            Self::of(self.control | 1 << 24, self.status & !Self::SUBNORMAL)
        }

        /// Whether all of these flags are still down.
        pub(in crate::float_env) const fn saw_no_subnormal(self) -> bool {
            self.status & Self::SUBNORMAL == 0
        }

        /// The bits that decide results and traps.
        #[inline]
        pub(in crate::float_env) const fn control(self) -> u64 {
            self.control
        }

        /// Writes these registers over the current ones, `now`, where they differ.
        #[inline]
        pub(super) fn write_over(self, now: Self) {
            if self.control != now.control {
                self.write();
            }
            if self.status != now.status {
                let status = self.status;
                // SAFETY: FPSR holds flags alone, which change no result and do not trap; these
                // were read from it.
                unsafe { asm!("msr fpsr, {}", in(reg) status, options(nostack)) };
            }
        }

        /// Sets how this thread computes.
        #[inline]
        pub(super) fn write(self) {
            let control = self.control;
            // SAFETY: no reserved bit is set in it, and whose environment it is, the module's head
            // says.
            unsafe { asm!("msr fpcr, {}", in(reg) control, options(nostack)) };
        }
    }
}

#[cfg(any(miri, not(any(target_arch = "x86_64", target_arch = "aarch64"))))]
mod arch {
    /// Empty: the registers of this processor are unknown.
    #[derive(Debug, Clone, Copy, PartialEq, Eq)]
    pub(in crate::float_env) struct Registers;

    impl Registers {
        pub(in crate::float_env) const STANDARD: Self = Self;
        #[cfg(any(test, feature = "foreign-environment"))]
        pub(in crate::float_env) const FOREIGN: &[(&str, Self)] = &[];

        pub(in crate::float_env) fn read() -> Self {
            Self
        }

        pub(in crate::float_env) const fn watching(self) -> Self {
            Self
        }

        pub(in crate::float_env) const fn saw_no_subnormal(self) -> bool {
            false
        }

        pub(in crate::float_env) const fn control(self) {}

        pub(super) fn write_over(self, _: Self) {}

        pub(super) fn write(self) {}
    }
}
