//! Kernels that are compiled where they are written.

/// A trait whose methods are kernels for any count of axes, compiled in the crate that says so, once for each
/// count that is named (an axis that rests changes no result, so that few are enough). Callers in other crates compile nothing.
///
/// `fn name(&self, ...) -> ... = kernel;` calls `kernel(self, ...)`; `M` is the count of axes in all types. Tests inside the
/// crate call the kernels themselves, for the few axes that they have: there nothing is compiled ahead.
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
