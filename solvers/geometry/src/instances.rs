//! A macro that compiles generic kernels once, for a few numbers of axes, in the crate that defines them.

/// Defines a trait whose methods are kernels for any number of axes M, and compiles them for each number in the list, in the
/// crate that uses this macro; crates that call the trait compile no kernel. A few numbers are enough, because additional axes at
/// rest change no result.
///
/// `fn name(&self, ...) -> ... = kernel;` calls `kernel(self, ...)`. Tests inside the crate call the kernels directly, with the
/// few axes that they need.
#[macro_export]
macro_rules! instances {
    ($(#[$about:meta])* pub trait $name:ident for [$($count:literal),+] $kind:ty = $body:tt) => {
        $crate::instances! { @trait [$(#[$about])*] $name $body }
        $($crate::instances! { @for $count, $name, [$kind], $body })+
    };
    (@trait [$(#[$about:meta])*] $name:ident {
        $($(#[$does:meta])* fn $method:ident(&self $(, $argument:ident: $type:ty)*) -> $result:ty = $kernel:path;)*
    }) => {
        $(#[$about])*
        pub trait $name<const M: usize> {
            $($(#[$does])* fn $method(&self $(, $argument: $type)*) -> $result;)*
        }
    };
    (@for $count:literal, $name:ident, [$kind:ty], {
        $($(#[$does:meta])* fn $method:ident(&self $(, $argument:ident: $type:ty)*) -> $result:ty = $kernel:path;)*
    }) => {
        #[cfg(not(test))]
        const _: () = {
            const M: usize = $count;
            impl $name<M> for $kind {
                $(fn $method(&self $(, $argument: $type)*) -> $result {
                    $kernel(self $(, $argument)*)
                })*
            }
        };
    };
}
